"""The envelope: what it refuses, and what follows from it."""

import pytest

import hydrodamp as hd


def written(folder, text):
    path = folder / "envelope.yaml"
    path.write_text(text, "utf-8")
    return path


def test_an_envelope_ends_above_the_bottom(tmp_path):
    path = written(tmp_path, "depth: [3, 30]\nbottom: 20\naltitude: 4\nnoise: {u: 0.1}")
    found = hd.read_envelope(path)
    assert (found.max_depth, found.mid_depth, found.noise_std[0]) == (16.0, 9.5, 0.1)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "the envelope is empty"),
        ("depth: [20, 3]", "`depth` must be a band"),
        ("depth: [-20, -10]", "`depth` must be a band below the surface"),
        ("depth: [3, 30]\nbottom: 5", "leaves nothing below the least depth of 3 m"),
        ("speed: [2, 1]", "`speed` must be a band"),
        ("area: {north: [5, 10], east: [-5, 5]}", "`area.north` must hold the start"),
        (
            "commands: {rudder: {lowest: 1, highest: 0}}",
            "`commands.rudder` must have lowest below highest",
        ),
        ("steering: direct\nautopilot: {depth: [1, 0, 0]}", "leave one of them out"),
        ("home: [95, 400]", "`home` must be a latitude of at most 89 deg"),
        ("speed: 0", "`speed`"),
        ("noise: {surge: 1}", "`noise` is of u v w"),
        ("dept: [3, 30]", "unknown key `dept`. Did you mean 'depth'?"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(tmp_path, text, says):
    with pytest.raises(hd.FileError, match=r"envelope\.yaml") as caught:
        hd.read_envelope(written(tmp_path, text))
    assert says in str(caught.value)

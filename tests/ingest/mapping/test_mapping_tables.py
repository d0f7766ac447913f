from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hydrodamp.data.attitude import down_vectors, rotation_vectors
from hydrodamp.data.channel_regression import integrate_rotation, regress_channel
from hydrodamp.errors import GapWarning, LogError
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.read import read_log
from table_rows import rows

Write = Callable[..., Path]
EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "bluerov2" / "mapping.yaml"


@pytest.fixture
def read_table(csv_file):
    """What reads a text by a mapping whose clock is the column `t`."""

    def read(text, **groups):
        return read_log(csv_file(text), LogMapping.from_dict({"time": "t", **groups}))

    return read


def test_names_units_and_signs_are_turned(read_table):
    log = read_table(
        "t_ms,spd,yawrate,fin,ignored\n0,1,90,5,abc\n500,2,180,,def\n1000,2,0,7,\n",
        time={"column": "t_ms", "unit": "ms"},
        velocity={"u": {"column": "spd", "unit": "knots"}}
        | {"r": {"column": "yawrate", "unit": "deg/s", "sign": -1}},
        commands={"rudder": {"column": "fin", "unit": "deg", "hold": True}},
        source="a test",
        note=None,
    )
    assert log.time.tolist() == [0, 0.5, 1]
    np.testing.assert_allclose(log.velocity[:, 0], np.array([1, 2, 2]) * 1852 / 3600)
    np.testing.assert_allclose(log.velocity[:, 5], [-np.pi / 2, -np.pi, 0])
    np.testing.assert_allclose(log.command("rudder"), np.radians([5, 5, 7]))
    assert log.velocity_names == ("u", "r")


@rows("header, direction, is_told")
def test_a_direction_gives_components(read_table, header, direction, is_told, refused):
    """From ahead it blows aft, from starboard to port; 359 deg and 1 deg are neighbours."""
    source = {"column": "w", "direction": direction, "sign": -1}
    wind = {f"wind_{axis}": source | {"along": axis} for axis in "xy"}
    text, groups = f"{header}\n0,1,2,0\n1,1,2,90\n2,1,2,359\n3,1,2,1\n", {"commands": wind}
    if is_told:
        refused(LogError, read_table, text, velocity={"u": "u"}, **groups)
    else:
        x, y = 2 * np.cos(np.radians(1)), 2 * np.sin(np.radians(1))
        found = read_table(text, velocity={"u": "u"}, **groups).commands
        np.testing.assert_allclose(found, [[-2, 0], [0, -2], [-x, y], [-x, -y]], atol=1e-12)


def test_a_stamp_that_nobody_filled_gives_way_to_the_next(read_table):
    text = "stamp,t,u\nnan,0,1\nnan,1,1\nnan,2,1\n"
    log = read_table(text, time=["stamp", "t"], velocity={"u": "u"})
    assert log.time.tolist() == [0, 1, 2]


@rows("header, channel, told")
def test_a_unit_of_the_file_is_never_passed_over(read_table, header, channel, told, refused):
    row = "1,2,3\n" if "furlong" in header and "m/s" in header else "1,2\n"
    text = f"{header}\n{row}{row.replace('1', '2', 1)}"
    if told is None:
        assert read_table(text, velocity={"u": channel}).velocity[0, 0] in (2.0, 4.0)
    else:
        refused(LogError, read_table, text, velocity={"u": channel})


def test_every_group_finds_its_place(read_table):
    log = read_table(
        "t,s,u1,a1,x1,n1,e\n0,a,1,2,3,4,50\n1,a,1,2,3,4,50\n0,b,1,2,3,4,50\n1,b,1,2,3,4,5\n",
        segment="s",
        velocity={"u": "u1"},
        acceleration={"du": {"column": "a1", "unit": "g"}},
        wrench={"X": {"column": "x1", "unit": "kN"}, "N": "n1"}
        | {axis: {"value": 0} for axis in "YZKM"},
        eta={"column": "e", "unit": "%"},
    )
    assert [segment.name for segment in log.segments] == ["a", "b"]
    assert log.acceleration[0, 0] == 2 * 9.80665
    assert log.wrench[0].tolist() == [3000, 0, 0, 0, 0, 4]
    assert log.propulsion_ratio[0] == 0.5


@pytest.mark.parametrize("content", [None, [1], "time"])
def test_a_mapping_must_be_a_table(content, refused):
    refused(LogError, LogMapping.from_dict, content)
    refused(LogError, LogMapping.from_dict, {"time": "t"})


@rows("text")
def test_columns_the_log_lacks_are_named_with_the_nearest(csv_file, text, refused):
    content = {"time": "time_s", "velocity": {"u": "surge"}, "segment": "run"}
    mapping = LogMapping.from_dict(content, "map.yaml")
    refused(LogError, lambda: read_log(csv_file(text), mapping))


@pytest.mark.slow
def test_the_bluerov2_moves_as_its_rates_and_depth_say(bluerov2_runs):
    for path in bluerov2_runs:
        log = read_log(path, EXAMPLE)
        turns, rates = integrate_rotation(log.attitude, log.bounds), log.velocity[:, 3:]
        for k in range(3):
            both = regress_channel(log.time, log.bounds, rates[:, [k]], turns[:, [k]])
            assert both.scale == pytest.approx(1, abs=0.1)
        steps = np.diff(log.time)
        differenced = rotation_vectors(log.attitude[:-1], log.attitude[1:]) / steps[:, np.newaxis]
        recorded = (log.velocity[1:, 3:] + log.velocity[:-1, 3:]) / 2
        sound = np.abs(differenced - recorded).max(axis=1) < 3
        for axis in range(3):
            assert np.corrcoef(differenced[sound, axis], recorded[sound, axis])[0, 1] > 0.8
        sinks = np.einsum("ni,ni->n", down_vectors(log.attitude), log.velocity[:, :3])
        height = np.genfromtxt(path, delimiter=",", names=True)["z_m"]
        assert np.corrcoef(-np.diff(height) / steps, sinks[1:] + sinks[:-1])[0, 1] > 0.6
        heave = log.command("ch_heave")
        if heave.any():
            assert np.corrcoef(heave, log.velocity[:, 2])[0, 1] < -0.4


def test_a_sparse_column_stays_in_its_own_run(read_table):
    """Its own stamps, 1.5 and then 0.5 s, do not tell that the clock began anew."""
    rows = [
        f"{0.1 * k:.1f},1.0,{(700 if run else 500) if k == (5 if run else 15) else ''}"
        for run in (0, 1)
        for k in range(20)
    ]
    text = "\n".join(["t,spd,rpm", *rows, ""])
    held = {"rpm": {"column": "rpm", "hold": True}}
    with pytest.warns(GapWarning):
        log = read_table(text, velocity={"u": "spd"}, commands=held)
    rpm = [log.command("rpm")[first:last] for first, last in log.bounds]
    assert [set(values[np.isfinite(values)]) for values in rpm] == [{500.0}, {700.0}]

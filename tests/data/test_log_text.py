from __future__ import annotations

import numpy as np

from hydrodamp.data.log import Log, Segment


def test_what_is_there_and_what_is_not(swim: Log) -> None:
    text = str(swim)
    assert "100 samples, 9.9 s in 1 segment, median step 0.1 s" in text
    assert "with attitude; without acceleration, propulsion ratio, wrench, position" in text
    assert "m/s" in text
    assert "rudder" in text
    assert "more" not in text


def test_a_crowded_log_fits_on_one_screen() -> None:
    names = tuple(f"c{index}" for index in range(40))
    log = Log(
        time=np.tile([0.0, 1.0], 30),
        velocity=np.zeros((60, 6)),
        velocity_names=("u", "r"),
        command_names=names,
        commands=np.zeros((60, 40)),
        segments=tuple(Segment(f"s{k}", 2 * k, 2 * k + 2) for k in range(30)),
    )
    text = str(log)
    assert len(text.splitlines()) < 45
    assert "... and 28 more commands" in text
    assert "... and 18 more segments" in text
    assert "with velocity only" in text


def test_nothing_is_lacking_in_a_full_log() -> None:
    block = np.zeros((2, 6))
    log = Log(
        time=[0, 1],
        velocity=block,
        attitude=[[1, 0, 0, 0]] * 2,
        wrench=block,
        acceleration=block,
        propulsion_ratio=[1, 1],
        position=block[:, :3],
        specific_force=block[:, :3],
    )
    assert "without" not in str(log)


def test_what_was_done_is_told_at_the_end(swim: Log) -> None:
    text = str(swim.noted(*(f"step {k}" for k in range(20))))
    assert "  what was done to it\n    step 0\n" in text
    assert text.endswith("... and 8 more notes")
    assert max(map(len, str(swim.noted("word " * 200)).splitlines())) < 170

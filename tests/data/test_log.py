import dataclasses

import numpy as np
import pytest

from hydrodamp.data.channels import BLOCKS
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log, Segment
from hydrodamp.errors import LogError

STILL = np.zeros((4, 6))
SPANS = (20, 30), (5, 5), (7, 3), (-9, 0), (0, 0.05)


def test_arrays_are_copied_and_read_only(swim):
    time = np.array([0.0, 1.0])
    log = Log(time=time, velocity=np.ones((2, 6)))
    time[0] = 5.0
    assert log.time[0] == 0.0
    for array in (swim.time, swim.velocity, swim.attitude, swim.commands, swim.down):
        assert not array.flags.writeable


def test_euler_angles_and_dicts_will_do():
    log = Log.from_arrays([0, 1], {"r": [1, 2], "u": [3, 4]}, attitude=[[0, 0, 0], [0, 0, 1.5]])
    assert log.velocity_names == ("u", "r")
    assert log.velocity.tolist() == [[3, 0, 0, 0, 0, 1], [4, 0, 0, 0, 0, 2]]
    np.testing.assert_allclose(log.attitude[1], [np.cos(0.75), 0, 0, np.sin(0.75)])


def test_every_block_is_kept():
    rng = np.random.default_rng(2)
    shapes = {block.name: (3, *block.shape) for block in BLOCKS[3:]}
    blocks = {name: rng.normal(size=shape) for name, shape in shapes.items()}
    log = Log.from_arrays([0, 1, 2], STILL[:3], commands={"a": [1, 2, 3]}, **blocks)
    for name, block in blocks.items():
        np.testing.assert_array_equal(getattr(log, name), block)
        np.testing.assert_array_equal(getattr(log.between(1, 3), name), block[1:])
    assert log.command("a").tolist() == [1, 2, 3]
    assert log.bounds.tolist() == [[0, 3]]


def test_all_wrong_arrays_are_named_at_once(refused):
    refused(
        LogError,
        lambda: Log.from_arrays(
            [0, 1, 2],
            np.zeros((6, 3)),
            attitude=np.zeros((3, 5)),
            wrench=[["a"] * 6] * 3,
            commands={"rudder": [1, 2], "uv": [1, 2, 3]},
            segment=["a"],
        ),
    )


@pytest.mark.parametrize(
    "fields",
    [
        {"time": [0, 1, 2]},
        {"velocity": STILL * np.nan},
        {"time": [0, 1, 1, 2]},
        {"attitude": np.full((4, 4), 0.4)},
        {"segments": (Segment("a", 0, 3),)},
        {"segments": (Segment("a", 0, 2), Segment("a", 2, 4))},
        {"segments": (Segment("a", 0, 3), Segment("b", 3, 4))},
        {"velocity_names": ("r", "u")},
        {"commands": STILL, "command_names": ("a",)},
        {"commands": STILL[:, :2], "command_names": ("a", "a")},
    ],
)
def test_what_cannot_be_a_log(fields, refused):
    given = {"time": [0, 1, 2, 3], "velocity": STILL} | fields
    refused(LogError, Log, **given)


def test_a_clock_may_restart_at_a_segment():
    log = Log.from_arrays([5, 6, 7, 0, 1], np.zeros((5, 6)), segment="aaabb")
    assert log.duration == 3.0
    assert log.elapsed.tolist() == [0, 1, 2, 3, 4]
    on_one_clock = Log.from_arrays([0, 1, 10, 11], np.zeros((4, 6)), segment="aabb")
    assert on_one_clock.elapsed.tolist() == [0, 1, 10, 11]
    assert on_one_clock.duration == 2.0


def test_a_slice_across_segments_keeps_their_names():
    log = Log.from_arrays([0, 1, 2, 0, 1, 2], np.zeros((6, 6)), segment="aaabbb")
    part = log.between(1, 5)
    assert part.segments == (Segment("a", 0, 2), Segment("b", 2, 4))
    assert log.between(2, 5).segments == (Segment("b", 0, 2),)


@pytest.mark.parametrize("span", SPANS)
def test_a_span_without_samples_is_named(swim, span, refused):
    refused(LogError, swim.between, *span)


def test_what_is_not_there_is_named(swim, refused):
    for names in ((), ("x", "swim", "y")):
        refused(LogError, swim.select, *names)
    refused(LogError, swim.command, "ruder")
    refused(LogError, Log(swim.time, swim.velocity).command, "x")
    refused(LogError, Log.from_arrays, [0, 1], {"uu": [1, 2]})


def test_notes_are_kept_in_order_through_every_cut(swim):
    log = swim.with_notes("first").with_notes("second", "third")
    assert log.notes == ("first", "second", "third")
    assert swim.notes == ()
    assert log.between(2, 5).notes == log.notes
    assert log.select("swim").notes == log.notes
    assert dataclasses.replace(log, source="x").notes == log.notes
    assert concatenate([log, swim.with_notes("fourth"), log]).notes == (*log.notes, "fourth")


def test_each_log_becomes_a_segment(swim):
    both = concatenate([swim.between(0, 4), swim.between(4, 10)])
    assert both.segments == (Segment("swim", 0, 40), Segment("swim-2", 40, 100))
    np.testing.assert_array_equal(both.velocity, swim.velocity)
    assert both.source == "swim.csv"


def test_commands_may_stand_in_another_order():
    first = Log.from_arrays([0, 1], {"u": [1, 2]}, commands={"a": [1, 1], "b": [2, 2]})
    second = Log.from_arrays([0, 1], {"u": [1, 2]}, commands={"b": [4, 4], "a": [3, 3]})
    assert concatenate([first, second]).command("a").tolist() == [1, 1, 3, 3]


def test_other_columns_are_refused_both_ways(swim, refused):
    bare = Log.from_arrays([0, 1], np.zeros((2, 6)), commands={"fin": [1, 2]}, source="bare.csv")
    refused(LogError, concatenate, [swim, bare])


def test_what_was_done_is_told_at_the_end(swim):
    text = str(swim.with_notes(*(f"step {k}" for k in range(20))))
    assert "  processing:\n  step 0\n" in text
    assert text.endswith("... and 8 more notes")
    assert max(map(len, str(swim.with_notes("word " * 200)).splitlines())) < 170

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hydrodamp.data.attitude import down, quaternion_from_euler
from hydrodamp.data.log import Log, Segment, concatenate
from hydrodamp.errors import GapWarning, LogError

STILL = np.zeros((4, 6))


def test_arrays_are_copied_and_read_only(swim: Log) -> None:
    time = np.array([0.0, 1.0])
    log = Log(time=time, velocity=np.ones((2, 6)))
    time[0] = 5.0
    assert log.time[0] == 0.0
    for array in (swim.time, swim.velocity, swim.attitude, swim.commands, swim.down):
        assert array is not None
        assert not array.flags.writeable


def test_a_log_without_attitude_is_level() -> None:
    log = Log(time=[0.0, 1.0], velocity=np.ones((2, 6)))
    assert log.down.tolist() == [[0, 0, 1], [0, 0, 1]]


def test_down_follows_the_attitude() -> None:
    q = quaternion_from_euler(np.array([[0.3, -0.2, 1.0], [0.0, 0.0, 0.0]]))
    log = Log(time=[0.0, 1.0], velocity=np.zeros((2, 6)), attitude=q)
    np.testing.assert_array_equal(log.down, down(q))


def test_a_quaternion_that_is_nearly_unit_is_made_so() -> None:
    log = Log(time=[0.0, 1.0], velocity=np.zeros((2, 6)), attitude=[[1.0005, 0, 0, 0]] * 2)
    assert log.attitude is not None
    np.testing.assert_array_equal(log.attitude[:, 0], 1.0)
    again = dataclasses.replace(log)
    np.testing.assert_array_equal(again.attitude, log.attitude)


def test_euler_angles_and_dicts_will_do() -> None:
    log = Log.from_arrays([0, 1], {"r": [1, 2], "u": [3, 4]}, attitude=[[0, 0, 0], [0, 0, 1.5]])
    assert log.velocity_names == ("u", "r")
    assert log.velocity.tolist() == [[3, 0, 0, 0, 0, 1], [4, 0, 0, 0, 0, 2]]
    assert log.attitude is not None
    np.testing.assert_allclose(log.attitude[1], [np.cos(0.75), 0, 0, np.sin(0.75)])


def test_a_command_that_reads_as_a_product_is_refused() -> None:
    with pytest.raises(LogError, match="Command name `uv` reads as the product"):
        Log.from_arrays([0, 1], {"u": [1, 2]}, commands={"uv": [1, 2]})


def test_every_block_is_kept() -> None:
    rng = np.random.default_rng(2)
    wrench, acceleration, eta = rng.normal(size=(3, 6)), rng.normal(size=(3, 6)), np.ones(3)
    position, force = rng.normal(size=(2, 3, 3))
    log = Log.from_arrays(
        [0, 1, 2],
        np.zeros((3, 6)),
        wrench=wrench,
        acceleration=acceleration,
        propulsion_ratio=eta,
        position=position,
        specific_force=force,
        commands={"a": [1, 2, 3]},
    )
    np.testing.assert_array_equal(log.wrench, wrench)
    np.testing.assert_array_equal(log.acceleration, acceleration)
    np.testing.assert_array_equal(log.propulsion_ratio, eta)
    np.testing.assert_array_equal(log.position, position)
    np.testing.assert_array_equal(log.specific_force, force)
    np.testing.assert_array_equal(log.between(1, 3).position, position[1:])
    assert log.command("a").tolist() == [1, 2, 3]
    assert log.bounds.tolist() == [[0, 3]]


def test_all_wrong_arrays_are_named_at_once() -> None:
    with pytest.raises(LogError) as caught:
        Log.from_arrays(
            [0, 1, 2],
            np.zeros((6, 3)),
            attitude=np.zeros((3, 5)),
            wrench=[["a"] * 6] * 3,
            commands={"rudder": [1, 2]},
            segment=["a"],
        )
    message = str(caught.value)
    assert len(caught.value.faults) == 5
    assert "`velocity` must have shape (3, 6); got (6, 3). Did you pass it transposed?" in message
    assert "`attitude` must have shape (3, 4)" in message
    assert "`wrench` must be numbers" in message
    assert "`rudder` must have shape (3)" in message
    assert "`segment` must have 3 labels; got 1" in message


def test_an_unknown_velocity_is_refused_with_the_nearest() -> None:
    with pytest.raises(LogError, match=r"got 'uu'\. Did you mean 'u'"):
        Log.from_arrays([0, 1], {"uu": [1, 2]})


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"time": [0, 1, 2]}, r"`velocity` must have shape \(3, 6\)"),
        ({"velocity": STILL * np.nan}, "`u` must be finite; it is not a number in row 1"),
        ({"time": [0, 1, 1, 2]}, "`time` must increase; it repeats 1 s in row 3"),
        ({"attitude": np.full((4, 4), 0.4)}, "qw qx qy qz must have norm 1; it is 0.8 in row 1"),
        ({"segments": (Segment("a", 0, 3),)}, "must follow one another from 0 to 4"),
        ({"segments": (Segment("a", 0, 2), Segment("a", 2, 4))}, "must have different names"),
        ({"segments": (Segment("a", 0, 3), Segment("b", 3, 4))}, "at least two are needed"),
        ({"velocity_names": ("r", "u")}, "some of u v w p q r in this order"),
        ({"commands": STILL, "command_names": ("a",)}, "6 different names"),
        ({"commands": STILL[:, :2], "command_names": ("a", "a")}, "2 different names"),
    ],
)
def test_what_cannot_be_a_log(fields: dict[str, object], says: str) -> None:
    given = {"time": [0, 1, 2, 3], "velocity": STILL} | fields
    with pytest.raises(LogError, match=says):
        Log(**given)  # type: ignore[arg-type]


def test_a_clock_may_restart_at_a_segment() -> None:
    log = Log.from_arrays([5, 6, 7, 0, 1], np.zeros((5, 6)), segment="aaabb")
    assert log.duration == 3.0
    assert log.elapsed.tolist() == [0, 1, 2, 3, 4]
    on_one_clock = Log.from_arrays([0, 1, 10, 11], np.zeros((4, 6)), segment="aabb")
    assert on_one_clock.elapsed.tolist() == [0, 1, 10, 11]
    assert on_one_clock.duration == 2.0


def test_slices_are_half_open_and_share_nothing(swim: Log) -> None:
    first, second = swim.between(0, 5), swim.between(5, 100)
    assert first.n + second.n == swim.n
    assert first.time[-1] < 5 <= second.time[0]
    np.testing.assert_array_equal(second.command("rudder"), swim.command("rudder")[50:])
    assert first.source == "swim.csv"


def test_a_slice_across_segments_keeps_their_names() -> None:
    log = Log.from_arrays([0, 1, 2, 0, 1, 2], np.zeros((6, 6)), segment="aaabbb")
    part = log.between(1, 5)
    assert part.segments == (Segment("a", 0, 2), Segment("b", 2, 4))
    assert log.between(2, 5).segments == (Segment("b", 0, 2),)


def test_seconds_count_from_the_first_sample_whatever_the_clock_says() -> None:
    log = Log(time=1.7e9 + np.arange(10), velocity=np.zeros((10, 6)))
    assert log.between(2, 5).n == 3


@pytest.mark.parametrize("span", [(20, 30), (5, 5), (7, 3), (-9, 0), (0, 0.05)])
def test_an_empty_slice_says_the_span(swim: Log, span: tuple[float, float]) -> None:
    with pytest.raises(LogError, match=r"swim.csv: no two samples .* spans 0 s to 9.9 s"):
        swim.between(*span)


def test_segments_are_selected_in_the_order_asked() -> None:
    log = Log.from_arrays([0, 1] * 3, {"u": [1, 1, 2, 2, 3, 3]}, segment="aabbcc")
    part = log.select("c", "a")
    assert part.velocity[:, 0].tolist() == [3, 3, 1, 1]
    assert [piece.name for piece in part.segments] == ["c", "a"]
    assert log.select("a", "a").n == 2


def test_pieces_answer_to_the_name_of_their_label() -> None:
    with pytest.warns(GapWarning):
        log = Log.from_arrays(
            [0, 1, 20, 21, 0, 1], np.zeros((6, 6)), segment=["dive"] * 4 + ["turn"] * 2
        )
    assert [piece.name for piece in log.segments] == ["dive.1", "dive.2", "turn"]
    assert log.select("dive").n == 4
    assert log.select("dive.2").n == 2


def test_unknown_segments_are_all_named() -> None:
    log = Log.from_arrays([0, 1, 0, 1], np.zeros((4, 6)), segment="aabb")
    with pytest.raises(LogError) as caught:
        log.select("x", "a", "y")
    assert len(caught.value.faults) == 2
    assert "there is no segment 'x'. The segments are: a b" in str(caught.value)
    with pytest.raises(LogError, match="name at least one segment of: a b"):
        log.select()


def test_an_unknown_command_is_refused_with_the_nearest(swim: Log) -> None:
    with pytest.raises(LogError, match=r"no command 'ruder'. Did you mean 'rudder'\?"):
        swim.command("ruder")
    with pytest.raises(LogError, match="The commands are: none"):
        Log(time=[0, 1], velocity=np.zeros((2, 6))).command("x")


def test_a_log_prints_itself_short(swim: Log) -> None:
    assert repr(swim) == "<Log swim.csv: 100 samples, 9.9 s>"
    assert "Log swim.csv" in str(swim)


def test_notes_are_kept_in_order_through_every_cut(swim: Log) -> None:
    log = swim.noted("first").noted("second", "third")
    assert log.notes == ("first", "second", "third")
    assert swim.notes == ()
    assert log.between(2, 5).notes == log.notes
    assert log.select("swim").notes == log.notes
    assert dataclasses.replace(log, source="x").notes == log.notes
    assert concatenate([log, swim.noted("fourth"), log]).notes == (*log.notes, "fourth")


def test_what_a_log_was_split_at_is_among_its_notes() -> None:
    with pytest.warns(GapWarning):
        log = Log.from_arrays([0, 1, 2, 20, 21], {"u": np.ones(5)})
    assert log.notes == ("split into 2 segments: no samples from 2 s to 20 s",)

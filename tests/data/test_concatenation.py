from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.data.log import Log, Segment, concatenate
from hydrodamp.errors import LogError


def test_each_log_becomes_a_segment(swim: Log) -> None:
    both = concatenate([swim.between(0, 4), swim.between(4, 10)])
    assert both.segments == (Segment("swim", 0, 40), Segment("swim-2", 40, 100))
    np.testing.assert_array_equal(both.velocity, swim.velocity)
    assert both.source == "swim.csv"


def test_a_log_cut_and_put_together_is_the_same(swim: Log) -> None:
    both = concatenate([swim, swim])
    again = both.select("swim-2")
    np.testing.assert_array_equal(again.attitude, swim.attitude)
    np.testing.assert_array_equal(again.commands, swim.commands)


def test_commands_may_stand_in_another_order() -> None:
    first = Log.from_arrays([0, 1], {"u": [1, 2]}, commands={"a": [1, 1], "b": [2, 2]})
    second = Log.from_arrays([0, 1], {"u": [1, 2]}, commands={"b": [4, 4], "a": [3, 3]})
    assert concatenate([first, second]).command("a").tolist() == [1, 1, 3, 3]


def test_other_columns_are_refused_both_ways(swim: Log) -> None:
    bare = Log.from_arrays([0, 1], np.zeros((2, 6)), commands={"fin": [1, 2]}, source="bare.csv")
    with pytest.raises(LogError) as caught:
        concatenate([swim, bare])
    assert caught.value.faults == (
        "bare.csv lacks attitude rpm rudder, which the others have",
        "swim.csv lacks fin, which the others have",
    )


def test_no_log_is_a_fault() -> None:
    with pytest.raises(LogError, match="there is no log"):
        concatenate([])

import warnings

import numpy as np
import pytest

from hydrodamp.data.channels import BLOCKS
from hydrodamp.data.log import Log
from hydrodamp.data.record import Segment
from hydrodamp.errors import GapWarning, LogError


def speeds(n, missing=()):
    u = np.arange(float(n))
    u[list(missing)] = np.nan
    return {"u": u}


def test_a_step_of_more_than_five_medians_is_a_gap():
    time = [0.0, 0.1, 0.2, 1.3, 1.4, 1.5]
    with pytest.warns(GapWarning, match=r"2 segments: no samples for 1.1 s from 0.20 s"):
        log = Log.from_arrays(time, speeds(6))
    assert log.segments == (Segment("1.1", 0, 3), Segment("1.2", 3, 6))


def test_a_step_of_five_medians_is_none():
    assert len(Log.from_arrays([0, 2, 4, 14, 16], speeds(5)).segments) == 1


@pytest.mark.parametrize(("share", "count"), [(0.35, 1), (0.6, 2)])
@pytest.mark.parametrize("period", [10.0, 1000.0])
def test_a_step_of_less_than_two_fifths_of_the_correlation_time_is_none(share, count, period):
    """A sine of period P has a correlation time of acos(1/e) P / 2 pi."""
    correlation_time = np.arccos(np.exp(-1.0)) * period / (2.0 * np.pi)
    time = np.arange(0.0, 20.0 * period, correlation_time / 50.0)
    time[len(time) // 2 :] += share * correlation_time
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", GapWarning)
        log = Log.from_arrays(time, {"u": np.sin(2.0 * np.pi * time / period)})
    assert len(log.segments) == count


@pytest.mark.parametrize("block", BLOCKS[3:], ids=lambda block: block.name)
def test_nan_in_any_block_is_missing(block):
    values = np.zeros((7, *block.shape))
    values[3] = np.nan
    with pytest.warns(GapWarning):
        log = Log.from_arrays(np.arange(7.0), speeds(7), **{block.name: values})
    assert log.n == 6


def test_nan_in_a_command_or_an_attitude_is_missing():
    values, euler = np.zeros(9), np.zeros((9, 3))
    values[3] = euler[6] = np.nan
    with pytest.warns(GapWarning):
        log = Log.from_arrays(np.arange(9.0), speeds(9), commands={"c": values}, attitude=euler)
    assert log.n == 7


def test_a_sample_left_alone_is_dropped_and_named():
    with pytest.warns(GapWarning) as caught:
        log = Log.from_arrays(
            [0, 1, 2, 3, 4, 0, 0, 1], speeds(8, (1,)), segment=list("aaaaabcc"), source="x.csv"
        )
    assert len(caught) == 1
    message = str(caught[0].message)
    assert "split" not in message  # two runs were there, and two there are
    assert "1 sample alone, left out at -2.00 s (by the clock 0.000 s) (segment 'a')" in message
    assert [part.name for part in log.segments] == ["a", "c"]


def test_many_gaps_are_one_warning_that_can_be_read():
    time = np.arange(50.0)
    with pytest.warns(GapWarning, match="3 more parts") as caught:
        Log.from_arrays(time, speeds(50, tuple(range(5, 50, 6))))
    assert len(caught) == 1


def test_no_label_changes_no_warning():
    log = Log.from_arrays([0, 1, 0, 1, 0, 1], speeds(6), segment=list("aabbaa"))
    assert [part.name for part in log.segments] == ["a", "b", "a-2"]


def test_a_log_with_nothing_left_is_a_fault(refused):
    refused(LogError, lambda: Log.from_arrays(np.arange(6.0), speeds(6, (1, 3, 5))))

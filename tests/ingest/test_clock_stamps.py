"""Clocks that repeat, run backwards, are set back, leap or wrap."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats, integers

from hydrodamp.errors import LogError
from hydrodamp.ingest.clock import Clock, IrregularityKind, clean_timestamps
from hydrodamp.ingest.wrapped_counters import unwrap_counter
from table_rows import rows


def right(time, labels=None):
    return clean_timestamps(Clock("dvl", np.asarray(time, float), labels))


def oddities(stamps):
    return {irregularity.kind: irregularity.count for irregularity in stamps.irregularities}


@rows("case, time, labels, kept, run, odd")
def test_odd_stamps_are_dropped_or_begin_a_run(case, time, labels, kept, run, odd):
    stamps = right(time, labels)
    assert stamps.rows.tolist() == kept
    assert stamps.run.tolist() == run
    assert stamps.time.tolist() == [time[row] for row in kept]
    assert {kind.name: count for kind, count in oddities(stamps).items()} == odd


def test_a_clock_set_back_all_the_time_is_none(refused):
    refused(LogError, lambda: right(np.tile(np.arange(10.0), 251)))


@pytest.mark.slow
@given(arrays(float, integers(0, 60), elements=floats(-1e7, 1e7, width=32)))
def test_whatever_the_stamps_time_increases_within_runs(time):
    stamps = right(time)
    inside = stamps.run[1:] == stamps.run[:-1]
    assert (np.diff(stamps.time)[inside] > 0).all()
    assert (np.diff(stamps.run) >= 0).all()
    assert (np.diff(stamps.rows) > 0).all()


def test_a_coarse_clock_is_spread_and_copies_are_not():
    """Stamps of whole seconds at 10 Hz; rows that say the same again are dropped."""
    time = np.arange(0.0, 30.0, 0.1)
    stamps = right(np.floor(time + 1e-9))
    np.testing.assert_allclose(stamps.time, time, atol=1e-9)
    assert oddities(stamps) == {IrregularityKind.COARSE: 270}
    copies = np.arange(300) % 2 == 0
    stamps = clean_timestamps(Clock("dvl", np.repeat(time[:150], 2), None, copies))
    assert stamps.rows.tolist() == np.flatnonzero(copies).tolist()
    assert oddities(stamps) == {IrregularityKind.REPEATED: 150}


def test_a_clock_that_stops_says_what_counts_on():
    stamps = right(np.minimum(np.arange(0.0, 30.0, 0.1), 20.0))
    assert len(stamps.rows) == 201
    (odd,) = stamps.irregularities
    assert odd.kind is IrregularityKind.STOPPED
    assert "`time: {rate: HERTZ}`" in odd.describe()


@pytest.mark.parametrize("period", [2**32 * 1e-3, 2**32 * 1e-6, 86400.0, 604800.0])
@pytest.mark.parametrize("swapped", [(), (50,), (49,), (49, 51)])
@pytest.mark.parametrize("n_wraps", [1, 2])
def test_samples_out_of_order_at_the_wrap(period, swapped, n_wraps):
    time = period - 5.0 + 0.1 * np.arange(100) + 0.05
    if n_wraps == 2:
        time = np.concatenate((time, time + period))
    for row in swapped:
        time[[row, row + 1]] = time[[row + 1, row]]
    np.testing.assert_allclose(unwrap_counter(time % period), time, atol=1e-6)


def test_the_same_time_on_the_next_day_is_a_gap():
    time = np.concatenate((np.arange(100.0), 86400.0 + np.arange(98.0, 200.0)))
    time[5] -= 2.0
    np.testing.assert_array_equal(unwrap_counter(time), time)

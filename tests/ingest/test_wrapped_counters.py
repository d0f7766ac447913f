"""Counters that wrap, with samples out of order at the wrap."""

import numpy as np
import pytest

from hydrodamp.ingest.wrapped_counters import unwrap_counter


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

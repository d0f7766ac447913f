from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.derived import (
    Around,
    best_window,
    fitted,
    relative as columns,
    slopes,
)

CLOCK = np.cumsum(np.random.default_rng(1).uniform(0.05, 0.4, 80))
WHOLE = np.array([[0, 80]])


def relative(values: np.ndarray) -> Around:
    return columns(values[:, np.newaxis])


@settings(max_examples=50, deadline=None)
@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5), st.sampled_from([3, 5, 9, 21]))
def test_a_parabola_is_met_on_any_clock(a: float, b: float, c: float, window: int) -> None:
    values = a + b * CLOCK + c * CLOCK**2
    fit = fitted(CLOCK, WHOLE, relative(values), window)
    np.testing.assert_allclose(fit.value, 0, atol=1e-8)
    np.testing.assert_allclose(fit.slope[:, 0], b + 2 * c * CLOCK, atol=1e-6)


def test_an_even_clock_gives_savitzky_and_golay() -> None:
    """Oracle: scipy.signal.savgol_filter."""
    from scipy.signal import savgol_filter

    values = np.random.default_rng(2).normal(size=60)
    fit = fitted(np.arange(60) / 10, np.array([[0, 60]]), relative(values), 9)
    oracle = savgol_filter(values, 9, 2, deriv=1, delta=0.1)
    np.testing.assert_allclose(fit.slope[:, 0], oracle, atol=1e-9)
    oracle = savgol_filter(values, 9, 2)
    np.testing.assert_allclose(fit.value[:, 0] + values, oracle, atol=1e-9)


def test_segments_stand_alone() -> None:
    values = np.sin(CLOCK)
    bounds = np.array([[0, 30], [30, 80]])
    both = fitted(CLOCK, bounds, relative(values), 9).slope
    alone = fitted(CLOCK[30:], np.array([[0, 50]]), relative(values[30:]), 9).slope
    np.testing.assert_array_equal(both[30:], alone)


@pytest.mark.parametrize(("n", "slope"), [(1, 0.0), (2, 3.0), (3, 3.0)])
def test_short_segments_have_less_than_a_parabola(n: int, slope: float) -> None:
    time = CLOCK[:n]
    fit = fitted(time, np.array([[0, n]]), relative(3 * time), 9)
    np.testing.assert_allclose(fit.slope, slope, atol=1e-9)


def test_the_window_grows_with_the_noise() -> None:
    time = np.arange(2000) / 10
    rng = np.random.default_rng(3)
    whole = np.array([[0, 2000]])
    windows = [
        best_window(time, whole, relative(np.sin(time) + noise * rng.normal(size=2000)))
        for noise in (1e-5, 1e-2, 0.3)
    ]
    assert windows == sorted(windows)
    assert windows[0] < windows[2]


def test_a_window_no_longer_than_the_longest_segment() -> None:
    noise = np.random.default_rng(4).normal(size=80)
    bounds = np.array([[0, 10], [10, 20], [20, 80]])
    assert best_window(CLOCK, bounds[:2], relative(noise)) <= 9
    assert best_window(CLOCK, np.array([[0, 3]]), relative(noise)) == 5


def test_the_window_may_be_given_in_seconds() -> None:
    time = np.r_[np.arange(10.0), np.arange(10.0)]
    line = np.r_[0.1 * np.arange(10), 0.2 * np.arange(10)]
    bounds = np.array([[0, 10], [10, 20]])
    for seconds, samples in ((0.1, 5), (4.0, 5), (8.0, 9)):
        fit, window = slopes(time, bounds, relative(line), seconds)
        assert window == samples
        np.testing.assert_allclose(fit.slope[:, 0], np.repeat([0.1, 0.2], 10), atol=1e-12)

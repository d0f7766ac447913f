"""Decimation keeps extremes, gaps and joins."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import hydrodamp as hd
from hydrodamp.report.figures.traces import PAIRS, clock, min_max_pairs, ribbon, trace


@settings(max_examples=60, deadline=None)
@given(n=st.integers(1, 400), most=st.integers(1, 40), seed=st.integers(0, 9), gaps=st.booleans())
def test_every_bin_keeps_its_extremes(n, most, seed, gaps):
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(n)
    if gaps:
        values[rng.random(n) < 0.3] = np.nan
    kept = min_max_pairs(values, most)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == n - 1
    assert len(kept) <= max(2 * most + 2, 2)
    length = 1 if n <= 2 * most else -(-n // most)
    for start in range(0, n, length):
        bin_values, shown = (
            values[start : start + length],
            values[kept[kept // length == start // length]],
        )
        if np.isfinite(bin_values).any():
            assert np.nanmin(shown) == np.nanmin(bin_values)
            assert np.nanmax(shown) == np.nanmax(bin_values)
        else:
            assert np.isnan(shown).all()
            assert len(shown)


def test_a_spike_in_a_million_samples_is_drawn():
    n = 1_000_000
    velocity = np.zeros((n, 6))
    velocity[654_321, 0] = 7.0
    log = hd.Log(np.arange(n) * 0.01, velocity)
    time, line = trace(log, log.velocity[:, 0])
    assert len(time) <= 2 * PAIRS + 3
    assert np.nanmax(line) == 7.0
    assert time[np.nanargmax(line)] == pytest.approx(6543.21)


def test_lines_break_at_joins_and_the_clock_leaps_none():
    log = hd.Log.from_arrays([5, 6, 7, 90, 92], {"u": [1.0, 2, 3, 4, 5]}, segment="aaabb")
    _, line = trace(log, log.velocity[:, 0])
    assert clock(log).tolist() == [0.0, 1.0, 2.0, 2.0, 4.0]
    assert np.flatnonzero(np.isnan(line)).tolist() == [3, 6]
    assert line[~np.isnan(line)].tolist() == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("most", [3, 50, 5000])
def test_a_band_is_never_drawn_narrower(most):
    rng = np.random.default_rng(0)
    n = 901
    middle = rng.standard_normal(n).cumsum()
    lower, upper = middle - rng.random(n), middle + rng.random(n)
    lower[700:], upper[700:] = np.nan, np.nan
    log = hd.Log.from_arrays(np.arange(n), {"u": np.zeros(n)}, segment=["a"] * 450 + ["b"] * 451)
    time, low, high = ribbon(log, lower, upper, most)
    for start, stop in ((0, 450), (450, 700)):
        at = clock(log)[start:stop]
        inside = (time >= at[0]) & (time <= at[-1]) & np.isfinite(low)
        assert (
            np.all(np.interp(at, time[inside], low[inside]) <= lower[start:stop] + 1e-12)
            or most < n
        )
        assert np.nanmin(low[inside]) <= lower[start:stop].min()
        assert np.nanmax(high[inside]) >= upper[start:stop].max()

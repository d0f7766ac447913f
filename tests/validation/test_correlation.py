"""Effective samples against the theory of an AR(1) series."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from hydrodamp.validation.correlation import autocovariance, effective_samples


def ar1(phi, n, seed):
    noise = np.random.default_rng(seed).normal(size=n)
    noise[0] /= np.sqrt(1 - phi**2)
    return lfilter([1.0], [1.0, -phi], noise)


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9, 0.97])
def test_ar1_counts_as_theory_says(phi):
    """n (1 - phi)/(1 + phi); Sokal's window leaves out exp(-5) and scatters by
    sqrt(2 (2 M + 1)/n), M of five correlation times: three of that are allowed."""
    n = 400_000
    time = (1 + phi) / (1 - phi)
    scatter = np.sqrt(2 * (2 * 5 * time + 1) / n)
    found = effective_samples(ar1(phi, n, 3), np.zeros(n, dtype=int))
    assert found == pytest.approx(n / time, rel=3 * scatter + 2 * np.exp(-5))


def test_pairs_do_not_cross_joins():
    """Segments of AR(1) put together count as many as the theory says, too."""
    parts = [ar1(0.9, 2000, seed) for seed in range(100)]
    series, segment = np.concatenate(parts), np.repeat(np.arange(100), 2000)
    assert effective_samples(series, segment) == pytest.approx(200_000 / 19, rel=0.15)


def test_autocovariance_is_that_of_the_definition():
    rng = np.random.default_rng(5)
    series, segment = rng.normal(size=50), np.repeat([0, 1], [30, 20])
    found = autocovariance(series, segment)
    centred = series - series.mean()
    parts = centred[:30], centred[30:]
    for lag in (0, 1, 7):
        products = np.concatenate([part[: len(part) - lag] * part[lag:] for part in parts])
        assert found[lag] == pytest.approx(products.mean())
    pairs = [max(30 - lag, 0) + max(20 - lag, 0) for lag in range(30)]
    assert len(found) == sum(count >= 25 for count in pairs)


def test_a_series_that_swings_back_counts_as_n_at_most():
    n = 1000
    swinging = np.diff(np.random.default_rng(1).normal(size=n + 1))
    assert effective_samples(swinging, np.zeros(n, dtype=int)) == n


def test_a_series_slower_than_its_record_is_summed_to_half_of_it():
    """A single step: rho_k = (n - 3k)/(n - k), and twice its sum up to n/2 tends to
    2 n (3/2 - 2 log 2), which no lag up to there is five times as long as."""
    n = 20_000
    step = np.repeat([1.0, -1.0], n // 2)
    found = effective_samples(step, np.zeros(n, dtype=int))
    assert found == pytest.approx(1 / (2 * (1.5 - 2 * np.log(2))), rel=1e-3)


@pytest.mark.parametrize("series", [[], [1.0], [2.0, 2.0, 2.0]])
def test_nothing_to_correlate(series):
    assert effective_samples(np.array(series), np.zeros(len(series), dtype=int)) == len(series)

import numpy as np
import pytest
from scipy import signal

from hydrodamp.data import time_scale
from hydrodamp.data.time_scale import motion_time_scale


def gauss_markov(n, step, scale, seed):
    rng = np.random.default_rng(seed)
    decay = np.exp(-step / scale)
    values = np.zeros(n)
    for k, push in enumerate(rng.normal(size=n - 1) * np.sqrt(1 - decay**2)):
        values[k + 1] = decay * values[k] + push
    return values


def test_exponential_autocorrelation_has_its_time_constant_as_scale():
    # R(h) = exp(−h/τ) for a first-order Gauss-Markov process
    time = 0.1 * np.arange(40_000)
    velocity = np.column_stack([gauss_markov(len(time), 0.1, 2.0, seed) for seed in range(3)])
    scale = motion_time_scale(time, velocity, np.array([[0, len(time)]]))
    assert scale == pytest.approx(2.0, rel=0.1)


def test_sine_has_the_lag_at_which_a_cosine_is_1_over_e():
    time = 0.01 * np.arange(100_000)
    velocity = np.sin(2.0 * np.pi * time / 10.0)[:, None]
    bounds = np.array([[0, 50_000], [50_000, 100_000]])
    expected = 10.0 * np.arccos(np.exp(-1.0)) / (2.0 * np.pi)
    assert motion_time_scale(time, velocity, bounds) == pytest.approx(expected, rel=5e-3)


def test_velocities_at_rest_have_no_scale_of_their_own():
    time = 0.5 * np.arange(100)
    assert motion_time_scale(time, np.full((100, 6), 0.1), np.array([[0, 100]])) == 0.5


def test_blocks_of_a_long_series_have_its_autocovariance():
    """Two segments that are no multiples of a block; a slow series is not decided by blocks."""
    rng = np.random.default_rng(4)
    bounds = np.array([[0, 70_000], [70_000, 90_001]])
    values = signal.lfilter([1.0], [1.0, -0.99], rng.standard_normal((bounds.max(), 2)), axis=0)
    early = time_scale._early_autocovariance(values, bounds)
    entire = time_scale._autocovariance(values, bounds)[: len(early)]
    np.testing.assert_allclose(early, entire, rtol=0.0, atol=1e-12 * entire[0].max())
    assert time_scale._early_autocovariance(np.cumsum(values, axis=0), bounds) is None

"""The test of Durbin, Wu and Hausman: its size without noise, its power with noise."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from hydrodamp.basis.basis import Basis
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.trust.endogeneity import endogeneity

NONE = np.zeros((2000, 0))


def rows_of(n: int, segments: int = 2) -> Rows:
    segment = np.arange(n) * segments // n
    return Rows(Basis(()), np.zeros((n, 0)), np.zeros((n, 6)), segment, np.arange(n) * 1.0)


def draw(rng: np.random.Generator, noise: float, colour: float, slope: float = 1.0):
    """Two AR(1) regressors seen through noise, and a target with AR(1) errors."""
    true = lfilter([0.3], [1.0, -0.95], rng.normal(size=(2000, 2)), axis=0)
    errors = lfilter([1.0], [1.0, -colour], rng.normal(size=2000))
    seen = true + noise * rng.normal(size=true.shape)
    return seen, true @ [slope, -1.0] + errors


def rejected(noise: float, colour: float, draws: int = 200) -> float:
    rng = np.random.default_rng(5)
    rows = rows_of(2000)
    found = [endogeneity(rows, seen, NONE, target, 2.0)
             for seen, target in (draw(rng, noise, colour) for _ in range(draws))]  # fmt: skip
    return float(np.mean([one is not None and one.p < 0.05 for one in found]))


def test_size_is_as_said_for_white_and_coloured_errors():
    """5 % of 200 draws, within three standard deviations of a binomial: 1 to 10 %."""
    assert 0.004 <= rejected(0.0, 0.0) <= 0.097
    assert 0.004 <= rejected(0.0, 0.8) <= 0.097


def test_power():
    assert rejected(0.5, 0.0, draws=40) > 0.95


def test_the_shift_is_the_bias_taken_back():
    """Noise of as much power as the regressor halves the slope; instruments restore it."""
    rng = np.random.default_rng(1)
    time = np.arange(2000.0)
    true = np.sqrt(2.0) * np.sin(0.05 * time)[:, None]
    seen = true + rng.normal(size=true.shape)
    found = endogeneity(rows_of(2000), seen, NONE, 3.0 * true[:, 0], 2.0)
    assert found is not None
    assert 0.6 < found.shift < 1.4


def test_a_regressor_that_is_foretold_wholly_leaves_nothing_to_test():
    slow = np.sin(0.01 * np.arange(2000.0))[:, None]
    target = slow[:, 0] + np.random.default_rng(6).normal(size=2000)
    assert endogeneity(rows_of(2000), slow, NONE, target, 2.0) is None


def test_controls_are_not_taken_for_noise():
    """What is left out of the model and foretold by it would look like a tie."""
    rng = np.random.default_rng(2)
    seen, target = draw(rng, 0.0, 0.0)
    missing = np.sign(seen[:, :1]) * seen[:, :1] ** 2
    target = target + 50.0 * missing[:, 0]
    with_it = endogeneity(rows_of(2000), seen, missing, target, 2.0)
    assert with_it is not None
    assert with_it.p > 0.01


def test_too_little_to_tell():
    rng = np.random.default_rng(3)
    seen, target = draw(rng, 0.1, 0.0)
    short = rows_of(2000).taken(np.arange(20))
    assert endogeneity(short, seen[:20], NONE[:20], target[:20], 2.0) is None
    assert endogeneity(rows_of(2000, 1000), seen, NONE, target, 2.0) is None
    assert endogeneity(rows_of(2000), NONE, NONE, target, 2.0) is None


def test_nothing_explained_is_not_shifted():
    rng = np.random.default_rng(4)
    seen, target = draw(rng, 0.5, 0.0)
    found = endogeneity(rows_of(2000), seen, NONE, 0.0 * target, 2.0)
    assert found is None or found.shift == 0.0

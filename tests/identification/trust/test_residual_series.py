"""Residuals as series in time: correlation and spectrum against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.trust.residual_series import residual_series, series


def test_the_spectrum_integrates_to_the_variance():
    rng = np.random.default_rng(0)
    noise = np.convolve(rng.standard_normal(700), [1.0, 0.8, 0.3], "valid")
    found = series(noise, np.repeat([0, 1], [300, len(noise) - 300]), 0.2)
    power = np.trapezoid(found.density, found.frequency)
    assert power == pytest.approx(np.mean(noise**2), rel=1e-6)
    assert found.correlation[0] == 1.0
    assert found.density.min() >= 0.0


def test_correlation_is_that_of_a_moving_average_and_white_beyond():
    """MA(1) with weight 1 has correlation one half at lag one, none beyond."""
    rng = np.random.default_rng(1)
    noise = np.convolve(rng.standard_normal(5001), [1.0, 1.0], "valid")
    found = series(noise, np.zeros(5000, dtype=int), 1.0)
    assert found.correlation[1] == pytest.approx(0.5, abs=0.03)
    assert np.mean(np.abs(found.correlation[2:]) < 2.0 * found.white) > 0.9


def test_no_pair_crosses_a_join():
    apart = series(np.tile([1.0, 1.0, -1.0, -1.0], 2), np.repeat([0, 1], 4), 1.0)
    assert apart.correlation.tolist() == [1.0, 0.25]


def test_zeros_are_not_divided_by():
    assert not series(np.zeros(40), np.zeros(40, dtype=int), 1.0).correlation.any()


def test_short_series_are_refused():
    with pytest.raises(hd.MethodError, match="at least 4 residuals"):
        series(np.ones(3), np.arange(3), 1.0)


def test_residuals_are_target_less_design_times_coefficients():
    campaign = hd.reenact(duration=20.0)
    model = hd.catalog["fossen"]
    problem = hd.prepare(campaign.vehicle, campaign.train, model)
    damping = hd.LeastSquares().identify(problem, model).damping
    (found,) = residual_series(problem, [damping], support=2.0)
    rows = hd.WeakEquations(2.0, overlap=1, windows=()).rows(problem)
    columns = [rows.basis.index(term) for term in model.basis]
    left = rows.target - rows.design[:, columns] @ damping.matrix.T
    assert list(found) == list("XYZKMN")
    for axis, one in found.items():
        expected = series(left[:, "XYZKMN".index(axis)], rows.segment, 2.0)
        np.testing.assert_allclose(one.correlation, expected.correlation, atol=1e-12)

"""Least squares: rank, aliases, units, free axes, too few samples."""

import numpy as np

import hydrodamp as hd
from hydrodamp.identification.regression import PointwiseRegression


def identify(vehicle, log, model, method=None):
    return hd.identify(model, vehicle, log, method or hd.LeastSquares())


ROWS = PointwiseRegression()


def test_the_fit_prints_its_outcome(vehicle, exact_log, true_damping):
    model = hd.catalog["coe-as-printed"]
    text = str(identify(vehicle, exact_log(true_damping(model), forward=3.0), model))
    assert "rank deficient" in text
    assert "X_u^2 X_u|u|" in text


def test_a_long_log_keeps_no_rows(vehicle, exact_log, true_damping, monkeypatch):
    """The same coefficients from a triangle made block by block; residuals count as white."""
    truth = true_damping(hd.catalog["linear"])
    problem = hd.prepare(vehicle, exact_log(truth, n=900), truth.model)
    kept = hd.LeastSquares().identify(problem, truth.model)
    monkeypatch.setattr("hydrodamp.identification.least_squares.MAX_ROWS", 800)
    fit = hd.LeastSquares().identify(problem, truth.model)
    np.testing.assert_allclose(fit.damping.coefficients, kept.damping.coefficients, rtol=1e-9)
    assert kept.uncertainty is not None
    assert fit.uncertainty is None
    assert "white residuals" in str(fit)

"""Least squares: rank, aliases, units, free axes, too few samples."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.regression import PointwiseRegression


def identify(vehicle, log, model, method=None):
    return hd.identify(model, vehicle, log, method or hd.LeastSquares())


ROWS = PointwiseRegression()


@pytest.mark.parametrize(
    "method",
    [
        hd.LeastSquares(),
        hd.Ridge(ROWS),
        hd.Dissipative(ROWS),
        hd.Ridge(ROWS, prior=hd.published["vt690-sname2022"]),
    ],
)
def test_too_few_samples_is_a_status(method, vehicle, exact_log, true_damping):
    log = exact_log(true_damping(hd.catalog["linear"]), n=30)
    fit = identify(vehicle, log, hd.catalog["mcfarland-whitcomb"], method)
    assert fit.status is hd.Status.TOO_FEW_SAMPLES
    assert not fit.status.usable
    assert identify(vehicle, log, hd.catalog["linear"]).status is hd.Status.OK


@pytest.mark.parametrize("method", [hd.LeastSquares(), hd.AdaptiveIdentifier()])
def test_a_model_without_a_term_on_the_free_axes_is_a_status(method, vehicle):
    rolling = replace(vehicle, axes=("K",))
    log = hd.Log.from_arrays(
        np.arange(30) / 10,
        {"p": np.zeros(30)},
        attitude=np.zeros((30, 3)),
        wrench=np.zeros((30, 6)),
    )
    fit = identify(rolling, log, hd.catalog["pitch-yaw"], method)  # its K row is empty
    assert fit.status is hd.Status.EMPTY
    assert not fit.status.usable


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

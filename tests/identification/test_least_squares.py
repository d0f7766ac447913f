"""Least squares: rank, aliases, units, free axes, too few samples."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd


def identify(vehicle, log, model, method=None):
    return hd.identify(model, vehicle, log, method or hd.LeastSquares())


def test_three_degrees_of_freedom_use_the_sub_block(vehicle):
    """Equation 1 on X, Y, N alone, written out."""
    planar = replace(vehicle, axes=("X", "Y", "N"))
    rng = np.random.default_rng(4)
    time = np.arange(600) / 10
    phase = rng.uniform(0, 6, 3)
    rates = np.array([0.3, 0.5, 0.8])
    motion = np.array([0.4, 0.3, 0.2]) * np.sin(np.outer(time, rates) + phase)
    slope = np.array([0.4, 0.3, 0.2]) * rates * np.cos(np.outer(time, rates) + phase)
    truth = np.array([-20.0, -30.0, -15.0])  # X_u, Y_v, N_r
    free = np.ix_([0, 1, 5], [0, 1, 5])
    momentum = motion @ vehicle.mass_matrix[free]
    u, v, r = motion.T
    coriolis = np.column_stack(
        [momentum[:, 1] * r, -momentum[:, 0] * r, momentum[:, 0] * v - momentum[:, 1] * u]
    )
    needed = slope @ vehicle.mass_matrix[free] - coriolis - motion * truth
    wrench = np.zeros((600, 6))
    wrench[:, [0, 1, 5]] = needed
    acceleration = np.zeros((600, 6))
    acceleration[:, [0, 1, 5]] = slope
    log = hd.Log.from_arrays(
        time, {"u": u, "v": v, "r": r}, wrench=wrench, acceleration=acceleration
    )
    fit = identify(planar, log, hd.catalog["linear"])
    assert fit.model.labels == tuple(f"{a}_{b}" for a in "XYN" for b in "uvr")
    expected = np.diag(truth).ravel()
    np.testing.assert_allclose(fit.damping.coefficients, expected, rtol=1e-8, atol=1e-8)


ROWS = hd.Differenced()


@pytest.mark.parametrize(
    "method",
    [
        hd.LeastSquares(),
        hd.Ridge(ROWS),
        hd.Dissipative(ROWS),
        hd.PriorLeastSquares(hd.published["vt690-sname2022"], 0.1, equations=ROWS),
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
    monkeypatch.setattr("hydrodamp.identification.linear.MOST_ROWS", 800)
    fit = hd.LeastSquares().identify(problem, truth.model)
    np.testing.assert_allclose(fit.damping.coefficients, kept.damping.coefficients, rtol=1e-9)
    assert kept.uncertainty is not None
    assert fit.uncertainty is None
    assert "take the residuals as white" in str(fit)

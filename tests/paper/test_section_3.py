"""Section III of the paper, literally: equations 3 to 14."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.regression import damping_wrench


def literal_least_squares(problem, model):
    """Equations 10 to 14 with the Kronecker product and the masking matrix."""
    tau = damping_wrench(problem, problem.log.acceleration)
    regressor = problem.regressor()[:, problem.equations.n_known :]
    n_terms = regressor.shape[1]
    mask = np.zeros((6, n_terms), dtype=bool)
    for axis, terms in enumerate(model.terms):
        mask[axis, [problem.equations.basis.index(term) for term in terms]] = True
    masking = np.eye(6 * n_terms)[mask.ravel()]  # M_m of equation 11
    stacked = np.kron(np.eye(6), regressor) @ masking.T  # Xi of equation 12
    sigma = tau.T.ravel()  # vec(tau*^T)
    kappa = np.linalg.lstsq(stacked, sigma, rcond=None)[0]  # minimises equation 13
    return (masking.T @ kappa).reshape(6, n_terms)  # equation 14


@pytest.mark.parametrize("key", hd.PAPER_MODELS)
def test_least_squares_equals_the_kronecker_form(key, vehicle, exact_log, true_damping):
    model = hd.catalog[key]
    truth = true_damping(hd.catalog["prestero"])  # not the model's own: a residual is left
    problem = hd.prepare(vehicle, exact_log(truth, n=600), model)

    fit = hd.LeastSquares().identify(problem, model)

    literal = literal_least_squares(problem, model)
    found = problem.matrix(fit.damping)[problem.equations.n_known :].T
    np.testing.assert_allclose(found, literal, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("key", hd.PAPER_MODELS)
def test_exact_accelerations_give_back_the_truth_to_1e_8(key, vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog[key])
    problem = hd.prepare(vehicle, exact_log(truth), truth.model)

    fit = hd.LeastSquares().identify(problem, truth.model)

    assert fit.status is hd.Status.OK
    assert fit.rank == truth.model.n_coefficients
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=1e-8)


def test_equation_3_subtracts_everything_known(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["gertler-hagen"])
    log = exact_log(truth, n=300)
    problem = hd.prepare(vehicle, log, truth.model)

    tau = damping_wrench(problem, log.acceleration)

    expected = truth.wrench(log.velocity, propulsion_ratio=log.propulsion_ratio)
    np.testing.assert_allclose(tau, expected, rtol=1e-10, atol=1e-10)


def test_the_printed_coe_has_36_columns_of_rank_33_under_way(vehicle, exact_log, true_damping):
    """For u > 0 the columns u^2 and u|u| are one and the same (X, Z and M)."""
    model = hd.catalog["coe-as-printed"]
    log = exact_log(true_damping(hd.catalog["coe"]), forward=3.0)
    assert log.velocity[:, 0].min() > 0

    fit = hd.LeastSquares().identify(hd.prepare(vehicle, log, model), model)

    assert (model.n_coefficients, fit.rank) == (36, 33)
    assert fit.status is hd.Status.RANK_DEFICIENT
    assert fit.aliased == (("X_u^2", "X_u|u|"), ("Z_u^2", "Z_u|u|"), ("M_u^2", "M_u|u|"))
    assert fit.damping["X_u^2"] == pytest.approx(fit.damping["X_u|u|"], rel=1e-6)

"""Ridge about a prior: the closed form, what the data do not determine, what a set lacks."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd

RECORDED = hd.Differenced()


def noisy(log, size=2.0, seed=0):
    """Return the log with white wrench noise."""
    rng = np.random.default_rng(seed)
    return replace(log, wrench=log.wrench + rng.normal(0, size, log.wrench.shape))


@pytest.fixture
def prestero(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["prestero"])
    log = noisy(exact_log(truth, n=300))
    return truth, log, hd.prepare(vehicle, log, truth.model)


def test_the_closed_form_about_a_prior(prestero):
    """``(XᵀX + n λ S²)⁻¹ (Xᵀy + n λ S² κ₀)`` on each axis."""
    truth, _, problem = prestero
    known = hd.Damping(truth.model, 1.1 * truth.coefficients)
    fit = hd.Ridge(RECORDED, strength=0.2, prior=known).identify(problem, truth.model)
    rows, first = RECORDED.rows(problem), 0
    for axis, terms in enumerate(truth.model.terms):
        design = rows.design[:, [rows.basis.index(term) for term in terms]]
        here = slice(first, first + len(terms))
        first += len(terms)
        penalty = 0.2 * rows.n * np.diag(np.mean(design**2, axis=0))
        expected = np.linalg.solve(
            design.T @ design + penalty,
            design.T @ rows.target[:, axis] + penalty @ known.coefficients[here],
        )
        np.testing.assert_allclose(fit.damping.coefficients[here], expected, rtol=1e-8)


def test_a_triangle_alone_gives_the_same(prestero):
    truth, _, problem = prestero
    method = hd.Ridge(RECORDED, strength=0.2, prior=truth)
    alone = method.solve(hd.accumulate(problem), problem, truth.model)
    whole = method.identify(problem, truth.model)
    np.testing.assert_allclose(alone.damping.coefficients, whole.damping.coefficients, rtol=1e-9)


def test_of_a_true_prior_as_much_is_taken_as_predicts_best(prestero):
    """Cross-validation is made about the prior: the truth wants all of it that the grid has."""
    truth, _, problem = prestero
    fit = hd.Ridge(RECORDED, prior=truth).identify(problem, truth.model)
    plain = hd.Ridge(RECORDED).identify(problem, truth.model)
    away, usual = (
        np.linalg.norm(one.damping.coefficients - truth.coefficients) for one in (fit, plain)
    )
    assert away < 0.5 * usual


def test_what_the_data_do_not_determine_the_prior_does(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["uncoupled"])
    log = noisy(exact_log(truth, n=600, forward=3.0), 0.5)
    fit = hd.identify(truth.model, vehicle, log, hd.Ridge(RECORDED, prior=truth))
    assert fit.rank == 22
    assert ("X_u", "X_|u|") in fit.aliased
    for label in ("X_u", "X_|u|"):  # not the even split of the smallest norm
        assert fit.damping[label] == pytest.approx(truth[label], rel=0.2)


def test_what_a_set_lacks_is_drawn_to_zero(prestero):
    truth, _, problem = prestero
    labels = truth.model.labels
    values = {labels[0]: 3.0, labels[1]: np.nan, "Y_qV": 7.0}
    known = hd.Damping.from_dict(None, values)
    fit = hd.Ridge(RECORDED, strength=1e9, prior=known).identify(problem, truth.model)
    np.testing.assert_allclose(fit.damping.coefficients[:3], [3.0, 0.0, 0.0], atol=1e-4)
    assert fit.remarks[0].startswith(f"Prior 'custom' has 1 of {len(labels)} coefficients;")


def test_a_set_of_another_vehicle_warns(prestero):
    truth, _, problem = prestero
    known = hd.published["remus100-prestero-theory"]
    with pytest.warns(hd.ForeignVehicleWarning, match="remus100"):
        hd.Ridge(RECORDED, prior=known).identify(problem, truth.model)

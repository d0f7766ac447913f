"""Ridge: closed form, units, the choice of the strength, what cannot be chosen; about a prior."""

import re
from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import ForeignVehicleWarning, MethodError, OutlierWarning
from hydrodamp.identification import regression
from hydrodamp.identification.regression import PointwiseRegression, accumulate

RECORDED = PointwiseRegression()


def noisy(log, size=5.0, seed=0):
    """Return the log with white wrench noise."""
    rng = np.random.default_rng(seed)
    return replace(log, wrench=log.wrench + rng.normal(0, size, log.wrench.shape))


@pytest.fixture
def linear(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["linear"])
    log = noisy(exact_log(truth, n=900))
    return truth, log, hd.prepare(vehicle, log, truth.model)


def test_no_strength_is_least_squares(vehicle, exact_log, true_damping):
    model = hd.catalog["uncoupled"]
    log = noisy(exact_log(true_damping(model), n=900, forward=3.0))
    fit = hd.identify(model, vehicle, log, hd.Ridge(RECORDED, strength=0.0))
    plain = hd.identify(model, vehicle, log, hd.LeastSquares())
    np.testing.assert_allclose(fit.damping.coefficients, plain.damping.coefficients, rtol=1e-8)
    assert (fit.rank, fit.aliased, fit.status) == (plain.rank, plain.aliased, plain.status)


@pytest.mark.slow
def test_the_choice_is_that_of_refitting_without_each_fold(linear):
    """No strength of a fine grid predicts the rows left out better, by the normal equations."""
    truth, _, problem = linear
    rows, fit = RECORDED.rows(problem), hd.Ridge(RECORDED).identify(problem, truth.model)
    made, size = regression.folds(rows), np.mean(rows.design**2, axis=0)
    for axis, said in enumerate(fit.remarks[1:]):
        lost = []
        for strength in np.logspace(-6, 2, 200):
            squares = 0.0
            for fold in range(made.n):
                test, train = (rows.select(part) for part in (made.fold == fold, made.fold != fold))
                normal = train.design.T @ train.design + strength * train.n * np.diag(size)
                kappa = np.linalg.solve(normal, train.design.T @ train.target[:, axis])
                squares += np.sum((test.target[:, axis] - test.design @ kappa) ** 2)
            lost.append(np.sqrt(squares / rows.n))
        found = float(re.search(r"RMS prediction error (\S+)", said)[1])
        assert found == pytest.approx(min(lost), rel=6e-3)  # three digits are printed


def test_remarks_tell_the_choice(linear):
    truth, _, problem = linear
    fit = hd.Ridge(RECORDED).identify(problem, truth.model)
    assert fit.remarks[0] == "Ridge strengths by cross-validation: 3 folds, one per segment."
    assert len(fit.remarks) == 7
    assert "N on the folds" in fit.remarks[1]
    assert "effective of 6 coefficients" in fit.remarks[6]
    assert "N m on the folds" in fit.remarks[6]
    given = hd.Ridge(RECORDED, strength=0.1).identify(problem, truth.model)
    assert given.remarks[0].startswith("X: ridge strength 0.1;")


def test_ends_of_the_grid_are_said(vehicle, exact_log, true_damping):
    """Exact data want no ridge; pure noise wants nothing but."""
    truth = true_damping(hd.catalog["fossen"])
    exact = exact_log(truth, n=600)
    remarks = hd.identify(truth.model, vehicle, exact, hd.Ridge(RECORDED)).remarks
    assert all("no ridge predicts better" in said for said in remarks[1:])
    nothing = replace(exact, wrench=exact.acceleration * 0.0, acceleration=np.zeros((exact.n, 6)))
    noise = noisy(nothing, 1e5, seed=3)
    with pytest.warns(OutlierWarning, match="all are kept"):
        fit = hd.identify(hd.catalog["mcfarland-whitcomb"], vehicle, noise, hd.Ridge(RECORDED))
    strongest = [said for said in fit.remarks if "strength 1e+02," in said]
    assert strongest
    assert all("the largest candidate" in said for said in strongest)


def test_a_triangle_alone_has_no_folds(linear):
    truth, _, problem = linear
    with pytest.raises(MethodError, match="cross-validation needs the rows"):
        hd.Ridge().solve(accumulate(problem), problem, truth.model)


@pytest.fixture
def prestero(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["prestero"])
    log = noisy(exact_log(truth, n=300), 2.0)
    return truth, log, hd.prepare(vehicle, log, truth.model)


@pytest.mark.parametrize("share", [0.0, 1.1])
def test_the_closed_form_of_hoerl_and_kennard_about_a_prior(prestero, share):
    """``(XᵀX + n λ S²)⁻¹ (Xᵀy + n λ S² κ₀)`` on each axis, S the root mean square of columns."""
    truth, _, problem = prestero
    known = hd.Damping(truth.model, share * truth.coefficients)
    prior = known if share else None
    fit = hd.Ridge(RECORDED, strength=0.2, prior=prior).identify(problem, truth.model)
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
    alone = method.solve(accumulate(problem), problem, truth.model)
    whole = method.identify(problem, truth.model)
    np.testing.assert_allclose(alone.damping.coefficients, whole.damping.coefficients, rtol=1e-9)


def test_of_a_true_prior_as_much_is_taken_as_predicts_best(prestero):
    """Cross-validation is made about the prior: the truth wants all of it that the grid has."""
    truth, _, problem = prestero
    fit = hd.Ridge(RECORDED, prior=truth).identify(problem, truth.model)
    plain = hd.Ridge(RECORDED).identify(problem, truth.model)
    away, usual = (one.damping.coefficients - truth.coefficients for one in (fit, plain))
    assert np.linalg.norm(away) < 0.5 * np.linalg.norm(usual)


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
    with pytest.warns(ForeignVehicleWarning, match="remus100"):
        hd.Ridge(RECORDED, prior=known).identify(problem, truth.model)

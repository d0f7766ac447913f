"""Priors: the conjugate posterior, what a set lacks, what the data do not determine."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd

RECORDED = hd.Differenced()


def posterior_by_the_book(design, target, mean, covariance):
    """Bishop (2006), equations 3.50 and 3.51, for rows of unit noise."""
    precision = np.linalg.inv(covariance)
    found = np.linalg.inv(precision + design.T @ design)
    return found @ (precision @ mean + design.T @ target), found


def noisy(log, size=2.0, seed=0):
    """Return the log with white wrench noise."""
    rng = np.random.default_rng(seed)
    return replace(log, wrench=log.wrench + rng.normal(0, size, log.wrench.shape))


@pytest.fixture
def prestero(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["prestero"])
    log = noisy(exact_log(truth, n=300))
    return truth, log, hd.prepare(vehicle, log, truth.model)


def around(truth, factor=1.1):
    """Return a set some way off."""
    return hd.Damping(truth.model, factor * truth.coefficients)


def by(known, relative, **more):
    """Return the method with a prior and a row a sample."""
    return hd.PriorLeastSquares(known, relative, equations=RECORDED, **more)


def test_a_fit_is_the_posterior_of_each_axis(prestero):
    """Noise of each axis by ordinary least squares, the rest by the book, on all rows."""
    truth, _, problem = prestero
    known = around(truth)
    fit = by(known, 0.2).identify(problem, truth.model)
    rows, first = RECORDED.rows(problem), 0
    for axis, terms in enumerate(truth.model.terms):
        design = rows.design[:, [rows.basis.index(term) for term in terms]]
        here = slice(first, first + len(terms))
        first += len(terms)
        _, lost, _, _ = np.linalg.lstsq(design, rows.target[:, axis], rcond=None)
        noise = np.sqrt(lost[0] / (rows.n - len(terms)))
        mean = known.coefficients[here]
        expected = posterior_by_the_book(
            design / noise, rows.target[:, axis] / noise, mean, np.diag((0.2 * mean) ** 2)
        )
        np.testing.assert_allclose(fit.damping.coefficients[here], expected[0], rtol=1e-8)
        np.testing.assert_allclose(
            fit.damping.covariance[here, here], expected[1], rtol=1e-7, atol=1e-14
        )


def test_what_is_known_and_what_a_set_lacks(vehicle, exact_log, true_damping):
    """Zero and NaN count as lacking; rotary terms have their own share; no data, no spread."""
    known = hd.Damping.from_dict(None, {"Y_v": -20.0, "Y_r": 10.0, "Y_w": 0.0, "Y_p": np.nan})
    model = hd.DampingModel.from_table({"Y": "v w p r u^2(eta-1)"}, key="five")
    log = exact_log(true_damping(hd.catalog["linear"]), n=300)
    with pytest.warns(hd.PropulsionWarning):
        problem = hd.prepare(vehicle, replace(log, propulsion_ratio=None), model)
    rows = RECORDED.rows(problem)
    prior = by(known, 0.05, rotary=0.1)
    mean, deviation = prior._belief(rows.triangle(), 1, model.terms[1])
    np.testing.assert_allclose(mean, [-20.0, 0.0, 0.0, 10.0, 0.0])
    wrench = np.linalg.norm(rows.target[:, 1])
    lacking = [wrench / np.linalg.norm(log.velocity[:, place]) for place in (2, 3)]
    np.testing.assert_allclose(deviation, [1.0, *lacking, 1.0, 0.0])
    assert by(known, 0.2)._belief(rows.triangle(), 1, model.terms[1])[1][3] == pytest.approx(2.0)


def test_what_the_data_do_not_determine_the_prior_does(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["uncoupled"])
    log = noisy(exact_log(truth, n=600, forward=3.0), 0.5)
    fit = hd.identify(truth.model, vehicle, log, by(truth, 0.1))
    assert fit.rank == 22
    assert ("X_u", "X_|u|") in fit.aliased
    for label in ("X_u", "X_|u|"):  # not the even split of the smallest norm
        assert fit.damping[label] == pytest.approx(truth[label], rel=0.2)


def test_remarks_tell_what_moved_and_what_stayed(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["fossen"])
    log = noisy(exact_log(truth, n=600), 0.5)
    model = truth.model.with_terms({"X Y Z K M N": "u^2(eta-1)"}, key="more")
    values = truth.as_dict()
    known = hd.Damping.from_dict(None, {**values, "Y_v": 3.0 * values["Y_v"], "Z_u^2(eta-1)": 1e-9})
    fit = hd.identify(model, vehicle, log, by(known, 0.05))
    assert fit.remarks[0] == ("Prior 'custom' has 13 of 18 coefficients; the others start at zero.")
    moved, stayed = fit.remarks[1:]
    assert moved.startswith("Moved by more than 2 prior deviations: ")
    assert "Y_v" in moved
    assert stayed.startswith("The data say next to nothing about: ")
    assert "Z_u^2(eta-1)" in stayed


def test_outcomes_that_are_no_numbers(prestero):
    truth, _, problem = prestero
    method = by(truth, 0.1)
    triangle = RECORDED.rows(problem).triangle()
    absurd = replace(triangle, r=np.full_like(triangle.r, np.nan))
    assert method.solve(absurd, problem, truth.model).status is hd.Status.FAILED
    few = replace(triangle, n_samples=5)  # residuals that cannot tell the noise
    assert method.solve(few, problem, truth.model).status is hd.Status.TOO_FEW_SAMPLES
    nothing = replace(truth.model, terms=((),) * 6)
    assert method.solve(triangle, problem, nothing).status is hd.Status.EMPTY


def test_a_set_of_another_vehicle_warns(prestero):
    truth, _, problem = prestero
    known = hd.published["remus100-prestero-theory"]
    with pytest.warns(hd.ForeignVehicleWarning, match="remus100"):
        by(known, 0.3).identify(problem, truth.model)


@pytest.mark.parametrize("shares", [{"relative": 0.0}, {"relative": 0.1, "rotary": np.inf}])
def test_a_prior_that_says_nothing_is_a_sentence(shares):
    with pytest.raises(hd.MethodError, match="must be a positive share"):
        hd.PriorLeastSquares(hd.published["vt690-sname2022"], **shares)

"""Priors: the conjugate posterior, what a set lacks, what a fit could not determine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.prior import Belief, Prior, PriorLeastSquares, posterior
from hydrodamp.identification.rows import Differenced

RECORDED = Differenced()


def posterior_by_the_book(design, target, mean, covariance):
    """Bishop (2006), equations 3.50 and 3.51, for rows of unit noise."""
    precision = np.linalg.inv(covariance)
    found = np.linalg.inv(precision + design.T @ design)
    return found @ (precision @ mean + design.T @ target), found


def noisy(log: hd.Log, size: float = 2.0, seed: int = 0) -> hd.Log:
    """Return the log with white wrench noise."""
    rng = np.random.default_rng(seed)
    return replace(log, wrench=log.wrench + rng.normal(0, size, log.wrench.shape))


@pytest.fixture
def prestero(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["prestero"])
    log = noisy(exact_log(truth, n=300))
    return truth, log, hd.prepare(vehicle, log, truth.model)


def around(truth: hd.Damping, factor: float = 1.1) -> hd.Damping:
    """Return a set some way off."""
    return hd.Damping(truth.model, factor * truth.coefficients)


def test_rows_update_as_the_conjugate_posterior():
    rng = np.random.default_rng(2)
    design, target = rng.normal(size=(20, 5)), rng.normal(size=20)
    mean, factor = rng.normal(size=5), rng.normal(size=(5, 5))
    covariance = factor @ factor.T + np.eye(5)
    root = np.linalg.cholesky(np.linalg.inv(covariance)).T
    found, spread = posterior(design, target, Belief(mean, np.ones(5), root))
    expected = posterior_by_the_book(design, target, mean, covariance)
    np.testing.assert_allclose(found, expected[0], rtol=1e-10)
    np.testing.assert_allclose(spread, expected[1], rtol=1e-10)


def test_a_fit_is_the_posterior_of_each_axis(prestero):
    """Noise of each axis by ordinary least squares, the rest by the book, on all rows."""
    truth, _, problem = prestero
    known = around(truth)
    fit = PriorLeastSquares(Prior(known, relative=0.2), RECORDED).identify(problem, truth.model)
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


def test_two_logs_in_turn_are_both_at_once():
    """The posterior of the first half is the prior of the second, cross terms and all."""
    rng = np.random.default_rng(6)
    model = hd.DampingModel.from_table({"Y": "v r", "N": "v"}, key="three")
    design, target = rng.normal(size=(30, 3)), rng.normal(size=30)
    start = Belief(np.zeros(3), np.ones(3), np.eye(3))
    mean, covariance = posterior(design[:15], target[:15], start)
    between = Prior(hd.Damping(model, mean, covariance)).belief(model.labels, np.ones(3))
    np.testing.assert_allclose(between.deviation, np.sqrt(np.diag(covariance)), rtol=1e-10)
    in_turn = posterior(design[15:], target[15:], between)
    at_once = posterior(design, target, start)
    np.testing.assert_allclose(in_turn[0], at_once[0], rtol=1e-9)
    np.testing.assert_allclose(in_turn[1], at_once[1], rtol=1e-9)


def test_a_sure_prior_stays_and_a_wide_one_is_least_squares(prestero):
    truth, _, problem = prestero
    known = around(truth, 3.0)
    sure, wide = (
        PriorLeastSquares(Prior(known, relative=share), RECORDED).identify(problem, truth.model)
        for share in (1e-9, 1e6)
    )
    np.testing.assert_allclose(sure.damping.coefficients, known.coefficients, rtol=1e-6)
    plain = hd.LeastSquares().identify(problem, truth.model)
    np.testing.assert_allclose(wide.damping.coefficients, plain.damping.coefficients, rtol=1e-6)
    assert wide.rank == plain.rank == 30


def test_rotary_terms_have_their_own_share():
    known = hd.Damping.from_dict(None, {"Y_v": -20.0, "Y_ur": 10.0, "N_|r|V_v": 2.0, "N_uv": -4.0})
    labels, none = ("Y_v", "Y_ur", "N_|r|V_v", "N_uv"), np.full(4, np.inf)
    both = Prior(known, relative=0.05, rotary=0.1).belief(labels, none)
    np.testing.assert_allclose(both.deviation, [1.0, 1.0, 0.2, 0.2])
    one = Prior(known, relative=0.05).belief(labels, none)
    np.testing.assert_allclose(one.deviation, [1.0, 0.5, 0.1, 0.2])


def test_what_a_set_lacks_is_wide_around_zero():
    """Zero and NaN count as lacking; a column without size is left free."""
    known = hd.Damping.from_dict(None, {"X_u": -2.0, "X_u|u|": 0.0, "X_u^2": np.nan, "X_v": 1.0})
    sizes = np.array([5.0, 7.0, 9.0, np.inf])
    prior = Prior(known, relative=0.5, wide=0.1)
    belief = prior.belief(("X_u", "X_u|u|", "X_u^2", "X_w"), sizes)
    np.testing.assert_allclose(belief.mean, [-2.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(belief.deviation, [1.0, 0.7, 0.9, np.inf])
    nothing = prior.belief(("X_w",), sizes[3:])
    assert nothing.root.shape == (0, 1)
    np.testing.assert_array_equal(nothing.deviation, [np.inf])


def test_what_an_earlier_fit_could_not_determine_is_left_free(vehicle, exact_log, true_damping):
    """Its covariance is zero along u - |u|, which is ignorance and not certainty."""
    truth = true_damping(hd.catalog["uncoupled"])
    ahead = noisy(exact_log(truth, n=600, forward=3.0), 0.5)
    earlier = hd.identify(truth.model, vehicle, ahead, hd.LeastSquares())
    assert earlier.rank == 22
    both_ways = noisy(exact_log(truth, n=600), 0.5, seed=5)
    fit = hd.identify(
        truth.model, vehicle, both_ways, PriorLeastSquares(Prior(earlier.damping), RECORDED)
    )
    error = fit.damping.coefficients - truth.coefficients
    assert np.all(np.abs(error) < 5 * np.sqrt(np.diag(fit.damping.covariance)))


def test_what_the_data_do_not_determine_the_prior_does(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["uncoupled"])
    log = noisy(exact_log(truth, n=600, forward=3.0), 0.5)
    fit = hd.identify(
        truth.model, vehicle, log, PriorLeastSquares(Prior(truth, relative=0.1), RECORDED)
    )
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
    fit = hd.identify(model, vehicle, log, PriorLeastSquares(Prior(known, relative=0.05), RECORDED))
    assert fit.remarks[0] == ("Prior 'custom' has 13 of 18 coefficients; the others start at zero.")
    moved, stayed = fit.remarks[1:]
    assert moved.startswith("Moved by more than 2 prior deviations: ")
    assert "Y_v" in moved
    assert stayed.startswith("The data say next to nothing about: ")
    assert "Z_u^2(eta-1)" in stayed


def test_many_labels_are_counted(prestero):
    truth, _, problem = prestero
    fit = PriorLeastSquares(Prior(around(truth), relative=1e-9), RECORDED).identify(
        problem, truth.model
    )
    assert fit.remarks[-1].endswith("and 22 more.")


def test_outcomes_that_are_no_numbers(prestero):
    truth, _, problem = prestero
    method = PriorLeastSquares(Prior(truth, relative=0.1), RECORDED)
    triangle = RECORDED.rows(problem).triangle()
    absurd = replace(triangle, r=np.full_like(triangle.r, np.nan))
    assert method.solve(absurd, problem, truth.model).status is hd.Status.FAILED
    few = replace(triangle, n_samples=5)  # residuals that cannot tell the noise
    assert method.solve(few, problem, truth.model).status is hd.Status.TOO_FEW_SAMPLES
    nothing = replace(truth.model, terms=((),) * 6)
    assert method.solve(triangle, problem, nothing).status is hd.Status.EMPTY


def test_locked_axes_are_left_out(vehicle):
    planar = replace(vehicle, axes=("X", "Y", "N"))
    rng = np.random.default_rng(5)
    motion = {name: rng.normal(size=400) for name in "uvr"}
    log = hd.Log.from_arrays(
        np.arange(400) / 10,
        motion,
        wrench=rng.normal(size=(400, 6)),
        acceleration=np.zeros((400, 6)),
    )
    known = hd.published["vt690-sname2022"]
    method = PriorLeastSquares(Prior(known, relative=0.3), RECORDED)
    fit = hd.identify(hd.catalog["prestero"], planar, log, method)
    assert {label[0] for label in fit.model.labels} == set("XYN")
    assert fit.status is hd.Status.OK


def test_a_set_of_another_vehicle_warns(prestero):
    truth, _, problem = prestero
    known = hd.published["remus100-prestero-theory"]
    with pytest.warns(hd.ForeignVehicleWarning, match="remus100"):
        PriorLeastSquares(Prior(known, relative=0.3), RECORDED).identify(problem, truth.model)


def test_a_prior_that_says_nothing_is_a_sentence():
    known = hd.Damping.from_dict(None, {"Y_v": -20.0})
    sure = hd.Damping(known.model, known.coefficients, covariance=[[1.0]])
    for damping, shares, message in (
        (known, {}, "have no covariance: state how sure"),
        (known, {"relative": 0.0}, "`relative` must be a positive share"),
        (known, {"relative": 0.1, "wide": np.inf}, "`wide` must be a positive share"),
        (sure, {"rotary": 0.1}, "`rotary` goes with `relative`"),
    ):
        with pytest.raises(MethodError, match=message):
            Prior(damping, **shares)
    with pytest.raises(MethodError, match="got Damping"):
        PriorLeastSquares(known)

"""Generalised least squares: textbook oracles, singular weights, fewer axes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression.generalised import GeneralisedLeastSquares
from hydrodamp.identification.regression.weighting import whitening
from hydrodamp.identification.rows.equations import Differenced

RECORDED = Differenced()
COUPLED = np.array([[4.0, 0.95 * 2.0 * 0.1], [0.95 * 2.0 * 0.1, 0.01]])  # Y [N] and K [N m]


def coupled_noise(log: hd.Log, seed: int) -> hd.Log:
    """Return the log with wrench noise that Y and K share, white in time."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 0.5, log.wrench.shape)
    noise[:, [1, 3]] = rng.multivariate_normal([0, 0], COUPLED, log.n)
    return replace(log, wrench=log.wrench + noise)


def weighted_by_the_book(rows, model, covariance):
    """``(Xᵀ (Σ⁻¹ ⊗ I) X)⁻¹ Xᵀ (Σ⁻¹ ⊗ I) y`` on all rows, written out (Zellner 1962, eq. 2.8)."""
    axes = [axis for axis, terms in enumerate(model.terms) if terms]
    inverse = np.linalg.inv(covariance[np.ix_(axes, axes)])
    designs = [rows.design[:, [rows.basis.index(t) for t in model.terms[a]]] for a in axes]
    normal = np.block(
        [
            [inverse[i, j] * one.T @ other for j, other in enumerate(designs)]
            for i, one in enumerate(designs)
        ]
    )
    right = [one.T @ rows.target[:, axes] @ inverse[i] for i, one in enumerate(designs)]
    return np.linalg.solve(normal, np.concatenate(right)), np.linalg.inv(normal)


def white_least_squares(problem, model):
    """Least squares from its triangle: the covariance is that of white residuals."""
    return hd.LeastSquares().solve(hd.accumulate(problem), problem, model)


@pytest.fixture
def prestero(exact_log, true_damping):
    truth = true_damping(hd.catalog["prestero"])
    return truth, coupled_noise(exact_log(truth, n=1500), 3)


def test_a_given_covariance_is_aitkens_estimate_on_all_rows(vehicle, prestero):
    truth, log = prestero
    problem = hd.prepare(vehicle, log, truth.model)
    given = block_diag(0.25, COUPLED[0, 0], 0.25, COUPLED[1, 1], 0.25, 0.25)
    given[1, 3] = given[3, 1] = COUPLED[0, 1]
    fit = GeneralisedLeastSquares(RECORDED, weighting=given).identify(problem, truth.model)
    expected, _ = weighted_by_the_book(RECORDED.rows(problem), truth.model, given)
    np.testing.assert_allclose(fit.damping.coefficients, expected, rtol=1e-8)


def white(problem, model, **settings):
    """The estimate with the covariance of rows that are white in time, as they are here."""
    method = GeneralisedLeastSquares(RECORDED, **settings)
    return method.solve(RECORDED.triangle(problem), problem, model)


def test_coloured_rows_have_wider_intervals(vehicle, exact_log, true_damping):
    """Noise held over ten samples: tenfold variance, and the white covariance misses it."""
    truth = true_damping(hd.catalog["fossen"])
    log = exact_log(truth, n=3000)
    noise = np.repeat(np.random.default_rng(3).normal(0, 2.0, (300, 6)), 10, axis=0)
    problem = hd.prepare(vehicle, replace(log, wrench=log.wrench + noise), truth.model)
    coloured = GeneralisedLeastSquares(RECORDED).identify(problem, truth.model)
    ratio = np.diag(coloured.damping.covariance) / np.diag(
        white(problem, truth.model).damping.covariance
    )
    assert 3.0 < np.median(ratio) < 20.0


def test_settled_weights_are_the_covariance_of_their_own_residuals(vehicle, prestero):
    """The iterated estimate is a fixed point: Aitken's with the Σ it leaves over."""
    truth, log = prestero
    problem = hd.prepare(vehicle, log, truth.model)
    fit = white(problem, truth.model)
    rows = RECORDED.rows(problem)
    left_over = rows.target - rows.design @ fit.damping.matrix.T
    freedom = np.sqrt([rows.n - len(terms) for terms in truth.model.terms])
    found = left_over.T @ left_over / np.outer(freedom, freedom)
    expected, covariance = weighted_by_the_book(rows, truth.model, found)
    np.testing.assert_allclose(fit.damping.coefficients, expected, rtol=1e-6)
    np.testing.assert_allclose(fit.damping.covariance, covariance, rtol=1e-5, atol=1e-12)
    assert any("Y and K" in said and "0.95" in said for said in fit.remarks)
    assert any("settled in round" in said for said in fit.remarks)


def test_shared_noise_makes_it_better_than_least_squares(vehicle, prestero):
    """K has one term, Y six: what K leaves over is the noise of Y.

    At best standard errors fall to ``√(1 − ρ²)`` of those of least squares (Zellner 1962).
    """
    truth, log = prestero
    problem = hd.prepare(vehicle, log, truth.model)
    of_y = [label.startswith("Y") for label in truth.model.labels]
    weighted = white(problem, truth.model).damping
    plain = white_least_squares(problem, truth.model).damping
    deviation = [np.sqrt(np.diag(d.covariance))[of_y] for d in (weighted, plain)]
    best = np.sqrt(1 - 0.95**2)
    assert np.all((deviation[0] / deviation[1] > 0.95 * best) & (deviation[0] < 0.4 * deviation[1]))
    error = [np.abs(d.coefficients - truth.coefficients)[of_y] for d in (weighted, plain)]
    assert np.linalg.norm(error[0] / deviation[1]) < 0.6 * np.linalg.norm(error[1] / deviation[1])


def test_covariance_has_its_nominal_size(vehicle, exact_log, true_damping):
    """Noise white in time: (estimate - truth) / standard error has unit spread."""
    truth = true_damping(hd.catalog["prestero"])
    log = exact_log(truth, n=900)
    scores = []
    for seed in range(25):
        problem = hd.prepare(vehicle, coupled_noise(log, seed), truth.model)
        damping = white(problem, truth.model).damping
        error = damping.coefficients - truth.coefficients
        scores.append(error / np.sqrt(np.diag(damping.covariance)))
    assert np.std(scores) == pytest.approx(1.0, abs=0.07)


def test_any_weighting_has_an_honest_covariance(vehicle, prestero):
    """A weighting of ones is least squares, and so is its covariance on each axis."""
    truth, log = prestero
    problem = hd.prepare(vehicle, log, truth.model)
    fit = white(problem, truth.model, weighting=np.eye(6))
    plain = white_least_squares(problem, truth.model)
    np.testing.assert_allclose(fit.damping.coefficients, plain.damping.coefficients, rtol=1e-9)
    same = plain.damping.covariance != 0.0
    np.testing.assert_allclose(
        fit.damping.covariance[same], plain.damping.covariance[same], rtol=1e-8
    )
    assert np.abs(fit.damping.covariance[~same]).max() > 0.0  # Y and K share their noise


def test_the_same_terms_on_all_axes_gain_nothing(vehicle, exact_log, true_damping):
    """Zellner (1962, section 3): identical regressors make it ordinary least squares."""
    truth = true_damping(hd.catalog["linear"])
    problem = hd.prepare(vehicle, coupled_noise(exact_log(truth, n=900), 1), truth.model)
    fit = GeneralisedLeastSquares(RECORDED).identify(problem, truth.model)
    plain = white_least_squares(problem, truth.model)
    np.testing.assert_allclose(fit.damping.coefficients, plain.damping.coefficients, rtol=1e-8)


def test_rank_and_smallest_norm_are_those_of_least_squares(vehicle, exact_log, true_damping):
    model = hd.catalog["uncoupled"]
    log = coupled_noise(exact_log(true_damping(model), n=900, forward=3.0), 2)
    fit = hd.identify(model, vehicle, log, GeneralisedLeastSquares(RECORDED))
    plain = white_least_squares(hd.prepare(vehicle, log, model), model)
    assert (fit.rank, fit.aliased, fit.status) == (plain.rank, plain.aliased, plain.status)
    ratio = fit.damping["X_u"] / fit.damping["X_|u|"]
    assert ratio == pytest.approx(1.0, rel=1e-6)


def test_exact_data_fall_back_to_a_floor(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["prestero"])
    fit = hd.identify(truth.model, vehicle, exact_log(truth), GeneralisedLeastSquares(RECORDED))
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=1e-7)
    assert any("singular" in said for said in fit.remarks)


def test_axes_that_leave_over_the_same_fall_back_to_a_floor(vehicle, exact_log, true_damping):
    truth = true_damping(hd.catalog["fossen"])
    log = exact_log(truth, n=900)
    noise = np.zeros((log.n, 6))
    noise[:] = np.random.default_rng(0).normal(size=(log.n, 1))
    fit = hd.identify(
        truth.model,
        vehicle,
        replace(log, wrench=log.wrench + noise),
        GeneralisedLeastSquares(RECORDED),
    )
    assert any("singular" in said for said in fit.remarks)
    np.testing.assert_allclose(fit.damping.coefficients, truth.coefficients, rtol=0.02)


def test_residuals_of_nothing_still_whiten():
    white = whitening(np.zeros((3, 2)), np.ones(2), np.array([0.0, 5.0]))
    assert white.floored
    assert np.all(np.isfinite(white.matrix))


def test_one_round_is_zellners_two_step_estimate(vehicle, prestero):
    truth, log = prestero
    problem = hd.prepare(vehicle, log, truth.model)
    fit = GeneralisedLeastSquares(RECORDED, rounds=1).identify(problem, truth.model)
    rows = RECORDED.rows(problem)
    plain = white_least_squares(problem, truth.model).damping
    left_over = rows.target - rows.design @ plain.matrix.T
    freedom = np.sqrt([rows.n - len(terms) for terms in truth.model.terms])
    expected, _ = weighted_by_the_book(
        rows, truth.model, left_over.T @ left_over / np.outer(freedom, freedom)
    )
    np.testing.assert_allclose(fit.damping.coefficients, expected, rtol=1e-8)
    assert not any("settled" in said for said in fit.remarks)


def test_weights_that_do_not_settle_are_said(vehicle, prestero):
    truth, log = prestero
    fit = hd.identify(truth.model, vehicle, log, GeneralisedLeastSquares(RECORDED, rounds=2))
    assert any("had not settled after 2 rounds" in said for said in fit.remarks)


def test_fewer_axes_use_their_part_of_the_weighting(vehicle):
    planar = replace(vehicle, axes=("X", "Y", "N"))
    rng = np.random.default_rng(5)
    time = np.arange(400) / 10
    motion = {name: rng.normal(size=400) for name in "uvr"}
    log = hd.Log.from_arrays(
        time, motion, wrench=rng.normal(size=(400, 6)), acceleration=np.zeros((400, 6))
    )
    given = np.zeros((6, 6))
    free = [0, 1, 5]
    given[np.ix_(free, free)] = np.diag([1.0, 2.0, 0.5]) + 0.3
    problem = hd.prepare(planar, log, hd.catalog["coe"])
    for method in (GeneralisedLeastSquares(RECORDED, given), GeneralisedLeastSquares(RECORDED)):
        fit = method.identify(problem, hd.catalog["coe"])
        assert fit.status.usable
        assert {label[0] for label in fit.model.labels} == set("XYN")


def test_an_axis_without_terms_is_left_out(vehicle, exact_log, true_damping):
    """Noise on K alone changes nothing where K has no terms."""
    truth = true_damping(hd.catalog["pitch-yaw"])
    log = coupled_noise(exact_log(truth, n=900), 4)
    other = log.wrench.copy()
    other[:, 3] += 5.0
    one, two = (
        hd.identify(truth.model, vehicle, each, GeneralisedLeastSquares(RECORDED))
        for each in (log, replace(log, wrench=other))
    )
    np.testing.assert_allclose(one.damping.coefficients, two.damping.coefficients, rtol=1e-9)


def test_one_axis_has_no_correlation_to_tell(vehicle, exact_log, true_damping):
    model = hd.DampingModel.from_table({"Y": "v v|v|"}, key="sway")
    log = coupled_noise(exact_log(true_damping(model), n=600), 1)
    problem = hd.prepare(vehicle, log, model)
    fit, plain = white(problem, model), white_least_squares(problem, model)
    np.testing.assert_allclose(fit.damping.covariance, plain.damping.covariance, rtol=1e-8)
    assert not any("alike" in said for said in fit.remarks)


def test_outcomes_that_are_no_numbers(vehicle, exact_log, true_damping):
    model = hd.catalog["mcfarland-whitcomb"]
    log = exact_log(true_damping(hd.catalog["linear"]), n=30)
    method = GeneralisedLeastSquares(RECORDED)
    assert hd.identify(model, vehicle, log, method).status is hd.Status.TOO_FEW_SAMPLES
    problem = hd.prepare(vehicle, log, model)
    absurd = replace(method.equations.triangle(problem), r=np.full((42, 42), np.nan))
    assert method.solve(absurd, problem, model).status is hd.Status.FAILED
    rolling = replace(vehicle, axes=("K",))
    rolled = hd.Log.from_arrays(
        np.arange(9) / 10, {"p": np.zeros(9)}, attitude=np.zeros((9, 3)), wrench=np.zeros((9, 6))
    )
    empty = hd.identify(hd.catalog["pitch-yaw"], rolling, rolled, method)
    assert empty.status is hd.Status.EMPTY


def test_a_weighting_that_is_none_is_a_sentence():
    skew = np.eye(6)
    skew[0, 1] = 0.5
    for wrong, message in (
        (np.eye(3), r"must have shape \(6, 6\)"),
        (np.full((6, 6), np.nan), "must be finite"),
        (skew, "must be symmetric; XY is 0.5 and YX is 0"),
    ):
        with pytest.raises(MethodError, match=message):
            GeneralisedLeastSquares(weighting=wrong)
    with pytest.raises(MethodError, match="`rounds` must be at least 1"):
        GeneralisedLeastSquares(rounds=0)


def test_a_singular_weighting_is_a_sentence(vehicle, prestero):
    truth, log = prestero
    for wrong, message in (
        (np.ones((6, 6)), "singular on X Y Z K M N"),
        (np.diag([1.0, 1.0, 0.0, 1.0, 1.0, 1.0]), "positive variances on X Y Z K M N; that of Z"),
    ):
        with pytest.raises(MethodError, match=message):
            hd.identify(
                truth.model, vehicle, log, GeneralisedLeastSquares(RECORDED, weighting=wrong)
            )

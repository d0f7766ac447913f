"""Covariance of coefficients: the estimators' own influence, noise apart from misfit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import hydrodamp as hd
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression.covariance import (
    least_squares_uncertainty,
    reference_rows,
    rows_covariance,
)
from hydrodamp.identification.regression.influence import (
    least_squares_influence,
    ridge_influence,
)
from hydrodamp.identification.regression.ridge import solve_ridge
from hydrodamp.identification.rows.equations import Differenced, Rows
from hydrodamp.identification.rows.rank import solve_axis
from hydrodamp.identification.uncertainty.intervals import Uncertainty

MODEL = hd.DampingModel.from_table({"X": "u u|u|", "Y N": "v r v|v|"}, key="mine")


def motion(n: int, seed: int):
    """Slow random columns, and the basis they stand for."""
    basis = Basis(tuple(Term.parse(name) for name in ("u", "v", "r", "u|u|", "v|v|")))
    drive = np.random.default_rng(seed).normal(size=(n + 200, len(basis)))
    return basis, lfilter([1.0], [1.0, -0.9], drive, axis=0)[200:]


def rows_of(n: int = 600, seed: int = 0, a: float = 0.7, design=None):
    """Rows of two segments with coloured noise on a known damping."""
    basis, columns = motion(n, seed=99) if design is None else design
    drive = np.random.default_rng(seed).normal(size=(n + 200, 6))
    noise = lfilter([1.0], [1.0, -a], drive, axis=0)[200:]
    noise[:, 5] += noise[:, 1]
    segment = (np.arange(n) >= n // 3).astype(int)
    return Rows(basis, columns, noise, segment, 0.1 * np.arange(n))


def least_squares(rows, model=MODEL):
    triangle = rows.triangle()
    return np.concatenate(
        [solve_axis(triangle, terms, axis).coefficients for axis, terms in enumerate(model.terms)]
    )


def test_influence_is_least_squares():
    rows = rows_of()
    found = least_squares_influence(rows, MODEL).coefficients(rows.target)
    np.testing.assert_allclose(found, least_squares(rows), rtol=1e-9)


def test_influence_is_ridge():
    rows = rows_of()
    strength = np.array([1e-2, 1.0, 0, 0, 0, 0.1])
    found = ridge_influence(rows, MODEL, strength).coefficients(rows.target)
    triangle = rows.triangle()
    wanted = [
        solve_ridge(triangle, terms, axis, strength[axis])[0].coefficients
        for axis, terms in enumerate(MODEL.terms)
    ]
    np.testing.assert_allclose(found, np.concatenate(wanted), rtol=1e-9)


def test_scores_add_up_to_the_change_of_the_estimate():
    rows = rows_of()
    influence = least_squares_influence(rows, MODEL)
    errors = np.random.default_rng(1).normal(size=rows.target.shape)
    np.testing.assert_allclose(
        influence.scores(errors).sum(axis=0), influence.coefficients(errors), rtol=1e-9
    )


def test_coloured_noise_has_the_spread_it_is_said_to_have():
    """Over 200 draws of the noise, variances agree within 3 standard errors of both."""
    design, found, said = motion(600, seed=99), [], []
    for seed in range(200):
        rows = rows_of(seed=seed, design=design)
        found.append(least_squares(rows))
        if seed < 40:
            influence = least_squares_influence(rows, MODEL)
            said.append(rows_covariance(rows, influence, MODEL).covariance)
    spread, mean = np.cov(np.array(found).T), np.mean(said, axis=0)
    ratio = np.diag(mean) / np.diag(spread)
    assert np.all(np.abs(np.log(ratio)) < 3.0 * np.sqrt(2.0 / 200 + 2.0 / 300) + 0.1)
    correlation = [
        np.corrcoef(np.array(found).T)[3, 6],
        mean[3, 6] / np.sqrt(mean[3, 3] * mean[6, 6]),
    ]
    assert correlation[1] == pytest.approx(correlation[0], abs=0.2)


def test_white_noise_gives_the_white_formula():
    """OLS theory: the covariance is sigma^2 (X'X)^-1."""
    rows = rows_of(n=4000, a=0.0, seed=3)
    found = rows_covariance(rows, least_squares_influence(rows, MODEL), MODEL, block=1.0)
    white = np.linalg.inv(rows.design[:, [0, 3]].T @ rows.design[:, [0, 3]])
    ratio = np.diag(found.covariance)[:2] / np.diag(white)
    np.testing.assert_allclose(ratio, 1.0, atol=4.0 * np.sqrt(2.0 / found.degrees_of_freedom))


def test_misfit_is_no_noise():
    """A missing term enters the covariance, not the part of noise."""
    rows = rows_of(seed=5)
    small = hd.DampingModel.from_table({"X": "u"}, key="small")
    missing = replace(rows, target=rows.target + 20.0 * rows.design[:, [3]] * np.eye(6)[0])
    influence = least_squares_influence(rows, small)
    clean = rows_covariance(rows, influence, small, MODEL, block=5.0)
    wrong = rows_covariance(missing, influence, small, MODEL, block=5.0)
    np.testing.assert_allclose(wrong.noise, clean.noise, rtol=1e-9)
    assert wrong.covariance[0, 0] > 20.0 * wrong.noise[0, 0]
    assert "other manoeuvres would give other coefficients" in str(wrong)


def test_a_reference_that_lacks_a_term_is_given_it():
    rows = rows_of(seed=6)
    other = hd.DampingModel.from_table({"X": "v r"}, key="other")
    both = hd.DampingModel.from_table({"X": "u u|u| v r"}, key="both")
    model = hd.DampingModel.from_table({"X": "u u|u|"}, key="two")
    influence = least_squares_influence(rows, model)
    found = [rows_covariance(rows, influence, model, one, block=5.0) for one in (other, both)]
    np.testing.assert_allclose(found[0].noise, found[1].noise, rtol=1e-9)


def test_columns_that_cannot_be_told_apart_share_one_variance():
    rows = rows_of(seed=7)
    double = replace(rows, design=rows.design[:, [0, 1, 2, 0, 4]] * [1, 1, 1, 1, 0])
    found = rows_covariance(double, least_squares_influence(double, MODEL), MODEL)
    variances = np.diag(found.covariance)
    assert np.all(np.isfinite(found.covariance))
    assert variances[0] == pytest.approx(variances[1], rel=1e-9)  # u and u|u|, one and the same
    assert variances[4] == variances[7] == 0.0  # v|v| is zero throughout: not moved by noise


def test_a_model_without_terms_has_no_covariance():
    rows = rows_of()
    empty = hd.DampingModel.from_table({}, key="empty")
    found = rows_covariance(rows, least_squares_influence(rows, empty), empty)
    assert found.covariance.shape == (0, 0)


def test_too_few_rows_are_a_sentence():
    rows = rows_of().taken(np.arange(5))
    wide = hd.DampingModel.from_table({"X": "u v r u|u| v|v|"}, key="wide")
    model = hd.DampingModel.from_table({"X": "u"}, key="one")
    with pytest.raises(MethodError, match="5 rows are too few for a reference regression of 5"):
        rows_covariance(rows, least_squares_influence(rows, model), model, wide)


def test_fewer_axes_and_a_command_with_unknown_gain(vehicle, exact_log):
    planar = replace(vehicle, axes=("X", "Y", "N"))
    model = hd.DampingModel.from_table({"X": "u|u|", "N": "r", "K": "p"}, key="mine")
    gained = model.with_terms({"N": "u|u|*rudder"})
    log = exact_log(hd.Damping.from_dict(None, {"X_u|u|": -3.0, "N_r": -2.0}))
    rudder = np.sin(np.arange(log.n))[:, None]
    log = replace(log, command_names=("rudder",), commands=rudder)
    problem = hd.prepare(planar, log, gained)
    found = least_squares_uncertainty(problem, Differenced(), gained, block=2.0)
    assert found.covariance.shape == (3, 3)
    assert found.block == 2.0
    rows, reference = reference_rows(problem, Differenced(), gained.restricted_to(planar.axes))
    assert set(reference.basis) <= set(rows.basis)


def test_an_uncertainty_speaks():
    known = Uncertainty(np.diag([1.0, 4.0]), 5.0, "scores", block=10.0, n_blocks=4)
    assert known.reach() == pytest.approx(2.5706, abs=1e-4)  # Student's t, 5 degrees of freedom
    np.testing.assert_allclose(
        known.interval([0.0, 1.0], 0.5)[1], 1.0 + 0.72669 * np.array([-2, 2]), atol=1e-4
    )
    assert str(known).endswith("4 blocks of 10 s; intervals have 5 degrees of freedom.")
    assert str(Uncertainty(np.eye(1), 5.0, "a prior")) == "Standard errors are from a prior."


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Uncertainty(np.zeros((2, 3)), 5.0, ""), r"must have shape \(2, 2\)"),
        (lambda: Uncertainty(np.eye(2), 5.0, "", np.eye(3)), "`noise` must have"),
        (lambda: Uncertainty(np.eye(2), 0.0, ""), "must be positive; got 0.0"),
        (lambda: Uncertainty(np.eye(2), 5.0, "").reach(1.0), "`level` must lie between 0 and 1"),
    ],
)
def test_bad_values_are_a_sentence(make, message):
    with pytest.raises(MethodError, match=message):
        make()

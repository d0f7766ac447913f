"""HAR covariance: against theory, within segments, noise separate from misfit."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import hydrodamp as hd
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import Term
from hydrodamp.identification.har_covariance import Bins, HarCovariance, long_run_covariance
from hydrodamp.identification.regression import Rows, solve_axis

MODEL = hd.DampingModel.from_table({"X": "u u|u|", "Y N": "v r v|v|"}, key="mine")
NONE = hd.DampingModel.from_table({}, key="none")
DRAG = hd.DampingModel.from_table({"X": "u"}, key="drag")


def clock(*lengths, step=0.1):
    """Segments and times of rows; every segment's clock starts anew."""
    segment = np.repeat(np.arange(len(lengths)), lengths)
    return segment, np.concatenate([np.arange(n) * step for n in lengths])


def first_order(n, a, seed, columns=1):
    """Noise with ``x_k = a x_{k-1} + e_k`` and unit e."""
    drive = np.random.default_rng(seed).normal(size=(n + 500, columns))
    return lfilter([1.0], [1.0, -a], drive, axis=0)[500:]


def rows_of(n=600, seed=0, a=0.7, columns_seed=99):
    """Rows of two segments with coloured noise, on slow random columns."""
    basis = Basis(tuple(Term.parse(name) for name in ("u", "v", "r", "u|u|", "v|v|")))
    noise = first_order(n, a, seed, 6)
    noise[:, 5] += noise[:, 1]
    segment = (np.arange(n) >= n // 3).astype(int)
    columns = first_order(n, 0.9, columns_seed, len(basis))
    return Rows(basis, columns, noise, segment, 0.1 * np.arange(n), time_scale=3.0)


def covariance_of_sum(scores, segment, time):
    bins = Bins.of(segment, time)
    return long_run_covariance(bins, bins.sums(scores))


def solutions(rows, model=MODEL, strength=0.0):
    triangle = rows.triangle()
    solved = [solve_axis(triangle, row, axis, strength) for axis, row in enumerate(model.terms)]
    return triangle, solved


def uncertainty(rows, model=MODEL, rich=NONE, strength=0.0, **more):
    triangle, solved = solutions(rows, model, strength)
    return HarCovariance.of(rows, triangle).uncertainty(solved, rich, **more)


def coefficients(rows, model=MODEL):
    return np.concatenate([solution.coefficients for solution in solutions(rows, model)[1]])


@pytest.mark.parametrize("a", [0.0, 0.6, 0.9])
def test_first_order_noise_has_the_variance_of_theory(a):
    """Var of a sum of n is n / (1 - a)^2 for long sums: Hamilton (1994), equation 7.2.8."""
    result = covariance_of_sum(first_order(4000, a, seed=4, columns=40), *clock(4000))
    ratio = np.diag(result.covariance) / 4000.0 * (1.0 - a) ** 2
    chance = np.sqrt(2.0 / result.degrees_of_freedom / 40)
    assert abs(ratio.mean() - 1.0) < 3.0 * chance + 0.05
    spread = 2.0 / ratio.var(ddof=1) * ratio.mean() ** 2
    assert 0.5 < spread / result.degrees_of_freedom < 2.0


def test_the_correlation_time_is_that_of_theory():
    """The integral of the autocorrelation a^|k| is (1 + a) / (1 - a) steps."""
    noise = first_order(2000, 0.9, seed=7, columns=60)
    bins = Bins.of(*clock(1000, 1000, step=0.2), max_bins=2048)
    result = bins.correlation_time(bins.sums(noise))
    assert result == pytest.approx(0.2 * 1.9 / 0.1, rel=0.1)


def test_differenced_noise_cancels_within_a_block():
    """White noise e differenced, times a slow x: the sum is that of e times the slope of x."""
    segment, time = clock(4000)
    slow = np.sin(time)[:, None]
    noise = np.random.default_rng(5).normal(size=(4001, 200))
    result = np.diag(covariance_of_sum(slow * np.diff(noise, axis=0), segment, time).covariance)
    truth = np.sum(np.diff(slow[:, 0]) ** 2) + slow[0, 0] ** 2 + slow[-1, 0] ** 2
    assert 2.0 * np.sum(slow**2) > 100.0 * truth  # what white noise would have
    assert 0.8 < result.mean() / truth < 1.8


@pytest.mark.parametrize("scores", [np.zeros((100, 2)), np.ones((1, 2))])
def test_zero_residuals_and_a_single_row(scores):
    result = covariance_of_sum(scores, *clock(len(scores)))
    assert result.block > 0.0
    assert result.n_blocks >= 1
    assert np.all(np.diag(result.covariance) == scores[0] ** 2)


@pytest.mark.slow
def test_covariance_of_coloured_noise_is_that_of_repetitions():
    """Over 200 draws of the noise, variances agree within 3 standard errors of both."""
    result = np.array([coefficients(rows_of(seed=seed)) for seed in range(200)])
    mean = np.mean([uncertainty(rows_of(seed=seed)).covariance for seed in range(40)], axis=0)
    ratio = np.diag(mean) / np.diag(np.cov(result.T))
    assert np.all(np.abs(np.log(ratio)) < 3.0 * np.sqrt(2.0 / 200 + 2.0 / 300) + 0.1)
    across = mean[3, 6] / np.sqrt(mean[3, 3] * mean[6, 6])  # r on Y and on N
    assert across == pytest.approx(np.corrcoef(result.T)[3, 6], abs=0.2)


def test_white_noise_gives_the_white_formula():
    """OLS theory: the covariance is sigma^2 (X'X)^-1."""
    rows = rows_of(n=4000, a=0.0, seed=3)
    result = uncertainty(rows)
    white = np.linalg.inv(rows.design[:, [0, 3]].T @ rows.design[:, [0, 3]])
    ratio = np.diag(result.covariance)[:2] / np.diag(white)
    np.testing.assert_allclose(ratio, 1.0, atol=4.0 * np.sqrt(2.0 / result.degrees_of_freedom))


def test_misfit_is_separate_from_noise():
    """A missing term enters the covariance, not the part of noise."""
    rows = rows_of(seed=5)
    missing = replace(rows, target=rows.target + 20.0 * rows.design[:, [3]] * np.eye(6)[0])
    clean, wrong = (uncertainty(each, DRAG, MODEL) for each in (rows, missing))
    np.testing.assert_allclose(wrong.noise, clean.noise, rtol=0.5)  # blocks are of other lengths
    assert wrong.covariance[0, 0] > 20.0 * wrong.noise[0, 0]


def test_the_reference_is_augmented_by_the_terms_of_the_model():
    rows = rows_of(seed=6)
    model = hd.DampingModel.from_table({"X": "u u|u|"}, key="two")
    rich = [hd.DampingModel.from_table({"X": x}, key="rich") for x in ("v r", "u u|u| v r")]
    result = [uncertainty(rows, model, each) for each in rich]
    np.testing.assert_allclose(result[0].noise, result[1].noise, rtol=1e-9)


def test_aliased_columns_have_the_same_variance():
    rows = rows_of(seed=7)
    double = replace(rows, design=rows.design[:, [0, 1, 2, 0, 4]] * [1, 1, 1, 1, 0])
    result = uncertainty(double, errors_in_variables=True)
    variances = np.diag(result.covariance)
    assert np.all(np.isfinite(result.covariance))
    assert variances[0] == pytest.approx(variances[1], rel=1e-9)  # u and u|u|, one and the same
    assert variances[4] == variances[7] == 0.0  # v|v| is zero throughout: not moved by noise


def test_too_few_rows_have_no_covariance():
    wide = hd.DampingModel.from_table({"X": "u v r u|u| v|v|"}, key="wide")
    assert uncertainty(rows_of().select(np.arange(5)), DRAG, wide) is None


def drag_rows(noise, n=20000):
    """Rows of a linear drag of -10, the wrench exact and the velocity noisy."""
    true = np.sin(0.05 * np.arange(n))
    noisy = true + noise * np.random.default_rng(1).normal(size=n)
    target = np.outer(-10.0 * true, np.eye(6)[0])
    segment, time = np.zeros(n, dtype=int), clock(n)[1]
    rows = Rows(Basis(DRAG.terms[0]), noisy[:, None], target, segment, time, time_scale=3.0)
    return rows, np.var(true)


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0])
def test_noisy_regressors_widen_intervals_by_their_bias(noise):
    """Fuller (1987), section 1.1: the estimate is the truth times s^2 / (s^2 + noise^2)."""
    rows, variance = drag_rows(noise)
    attenuation = variance / (variance + noise**2)
    scatter = 10.0 * noise / np.sqrt(rows.n * 0.5 * attenuation)  # of two-stage least squares
    result = uncertainty(rows, DRAG, errors_in_variables=True)
    assert result.standard_errors[0] == pytest.approx(10.0 * (1.0 - attenuation), abs=3.0 * scatter)
    assert "1.5 s" in str(result)


@pytest.mark.parametrize("n", [4000, 40])
def test_exact_regressors_and_short_logs_do_not_widen_intervals(n):
    rows, _ = drag_rows(0.0, n)
    assert uncertainty(rows, DRAG, errors_in_variables=True).standard_errors[0] < 1e-9

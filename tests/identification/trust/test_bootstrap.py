"""Block bootstrap: agrees with the sandwich, works for any method, refuses the impossible."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.signal import lfilter

import hydrodamp as hd
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression.covariance import rows_covariance
from hydrodamp.identification.regression.influence import least_squares_influence
from hydrodamp.identification.rows.equations import Differenced, Rows
from hydrodamp.identification.trust.bootstrap import Draws, bootstrap, bootstrap_rows

MODEL = hd.DampingModel.from_table({"X": "u v", "N": "v"}, key="mine")


def rows_of(n: int = 3000):
    """Rows of three segments with noise that is alike for a while."""
    basis = Basis((Term.parse("u"), Term.parse("v"), Term.parse("w")))
    drive = np.random.default_rng(0).normal(size=(n + 200, 9))
    columns = lfilter([1.0], [1.0, -0.8], drive, axis=0)[200:]
    segment = np.arange(n) // (n // 3)
    return Rows(basis, columns[:, :3], columns[:, 3:], segment, 0.1 * np.arange(n))


def test_the_bootstrap_agrees_with_the_sandwich():
    """Both estimate the same covariance; block length and chance leave a quarter."""
    rows = rows_of()
    sandwich = rows_covariance(rows, least_squares_influence(rows, MODEL), MODEL, block=5.0)
    draws = bootstrap_rows(rows, MODEL, block=5.0, n=400, seed=1)
    ratio = np.sqrt(np.diag(draws.covariance)) / sandwich.standard_errors
    # a standard error has the relative error (2 f)^(-1/2), twice that for two of them
    assert np.all(np.abs(ratio - 1.0) < 3.0 / np.sqrt(2.0 * sandwich.degrees_of_freedom))
    assert draws.n_blocks == 60
    inside = (draws.coefficients > draws.interval(0.9)[:, 0]) & (
        draws.coefficients < draws.interval(0.9)[:, 1]
    )
    np.testing.assert_allclose(inside.mean(axis=0), 0.9, atol=0.01)


def test_a_draw_is_least_squares_on_the_drawn_rows():
    rows = rows_of(300)
    draws = bootstrap_rows(rows, MODEL, block=5.0, n=3, seed=5)
    chosen = np.random.default_rng(5).integers(draws.n_blocks, size=(3, draws.n_blocks))
    pieces = np.array_split(np.arange(300), draws.n_blocks)
    place = np.concatenate([pieces[i] for i in chosen[2]])
    wanted = np.linalg.lstsq(rows.design[place, :2], rows.target[place, 0])[0]
    np.testing.assert_allclose(draws.coefficients[2, :2], wanted, rtol=1e-9)


def test_any_method_is_repeated_on_logs(vehicle, exact_log, true_damping):
    model = hd.find_model("fossen")
    truth = true_damping(model)
    log = exact_log(truth)
    problem = hd.prepare(vehicle, log, model)
    exact = bootstrap(problem, model, hd.LeastSquares(), block=2.0, n=2)
    np.testing.assert_allclose(exact.coefficients, np.tile(truth.coefficients, (2, 1)), rtol=1e-6)
    noise = np.random.default_rng(3).normal(size=(log.n, 6))
    noisy = hd.prepare(vehicle, replace(log, wrench=log.wrench + noise), model)
    by_log = bootstrap(noisy, model, hd.LeastSquares(), block=2.0, n=6)
    by_rows = bootstrap_rows(Differenced().rows(noisy), model, block=2.0, n=6)
    np.testing.assert_allclose(by_log.coefficients, by_rows.coefficients, rtol=1e-6, atol=1e-9)


@dataclass(frozen=True)
class Moody:
    """Fails on every log that starts at another time than the first."""

    start: float
    key: str = "moody"

    def identify(self, problem, model):
        fit = hd.LeastSquares().identify(problem, model)
        good = problem.log.time[0] == self.start
        return fit if good else replace(fit, status=hd.Status.FAILED)


def test_draws_that_fail_are_counted(vehicle, exact_log, true_damping):
    model = hd.find_model("fossen")
    problem = hd.prepare(vehicle, exact_log(true_damping(model)), model)
    half = 0.4 * problem.log.duration
    draws = bootstrap(problem, model, Moody(problem.log.time[0]), block=half, n=40)
    assert 0 < draws.n_failed == 40 - len(draws.coefficients)
    with pytest.raises(MethodError, match="got 0, and 5 failed"):
        bootstrap(problem, model, Moody(-1.0), block=half, n=5)


def test_rows_far_apart_make_blocks_of_what_there_is():
    rows = rows_of(30)
    apart = replace(rows, time=100.0 * np.arange(30))
    assert bootstrap_rows(apart, MODEL, block=5.0, n=2).n_blocks == 30


def test_one_coefficient_has_a_covariance():
    single = hd.DampingModel.from_table({"X": "u"}, key="one")
    assert bootstrap_rows(rows_of(300), single, block=5.0, n=5).covariance.shape == (1, 1)


@pytest.mark.parametrize(
    ("block", "n", "message"),
    [
        (0.0, 10, "`block` must be positive"),
        (5.0, 1, "at least 2 draws; got n = 1"),
        (1e4, 10, "a single block of 10000 s"),
    ],
)
def test_impossible_draws_are_a_sentence(block, n, message):
    rows = rows_of(300)
    one = replace(rows, segment=np.zeros(300, dtype=int))
    with pytest.raises(MethodError, match=message):
        bootstrap_rows(one, MODEL, block=block, n=n)


def test_a_level_is_a_share():
    with pytest.raises(MethodError, match="`level` must lie between 0 and 1"):
        Draws(MODEL, np.zeros((2, 3)), 0, 1.0, 2).interval(95.0)

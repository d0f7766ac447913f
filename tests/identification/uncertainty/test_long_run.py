"""Covariance of correlated sums: against theory, on any clock, never across a join."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import t as student

from hydrodamp.errors import MethodError
from hydrodamp.identification.uncertainty.long_run import block_length, correlation_time, long_run
from hydrodamp.identification.uncertainty.tapered_blocks import ROUGHNESS, blocks_of, since_start


def clock(*lengths: int, step: float = 0.1):
    """Segments and times of rows; every segment's clock starts anew."""
    segment = np.repeat(np.arange(len(lengths)), lengths)
    return segment, np.concatenate([np.arange(n) * step for n in lengths])


def first_order(n: int, a: float, seed: int, columns: int = 1):
    """Noise with ``x_k = a x_{k-1} + e_k`` and unit e."""
    drive = np.random.default_rng(seed).normal(size=(n + 500, columns))
    return lfilter([1.0], [1.0, -a], drive, axis=0)[500:]


def direct(scores, segment, time, length):
    """The covariance as a double sum over lags, with the lag window of a half sine."""
    grid = (np.arange(4000) + 0.5) / 4000
    taper = np.sin(np.pi * grid)
    window = np.correlate(taper, taper, "full")[3999:] / (taper @ taper)
    lag = np.abs(time[:, None] - time) / length
    weight = np.interp(lag, np.arange(4000) / 4000, window, right=0.0)
    return scores.T @ (weight * (segment[:, None] == segment)) @ scores


def test_it_is_the_double_sum_over_lags():
    segment, time = clock(150, 90, 7)
    scores = first_order(247, 0.8, seed=1, columns=3)
    found = blocks_of(segment, time, 3.0).covariance(scores)
    np.testing.assert_allclose(found, direct(scores, segment, time, 3.0), rtol=0.02, atol=1.0)


def test_an_irregular_clock_counts_time_not_rows():
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.02, 0.4, 300))
    segment, scores = np.zeros(300, dtype=int), first_order(300, 0.5, seed=3, columns=2)
    found = blocks_of(segment, time, 5.0).covariance(scores)
    np.testing.assert_allclose(found, direct(scores, segment, time, 5.0), rtol=0.02, atol=1.0)


def test_every_row_weighs_the_same():
    blocks = blocks_of(*clock(40, 1, 3), 2.0)
    np.testing.assert_allclose(np.sum(blocks.weights.toarray() ** 2, axis=0), 1.0)
    assert blocks.n == 2


def test_no_block_spans_a_join():
    segment, time = clock(50, 50)
    blocks = blocks_of(segment, time, 4.0).weights.toarray() > 0.0
    assert not np.any(blocks[:, segment == 0].any(axis=1) & blocks[:, segment == 1].any(axis=1))


@pytest.mark.parametrize("a", [0.0, 0.6, 0.9])
def test_first_order_noise_has_the_variance_of_theory(a):
    """Var of a sum of n is n / (1 - a)^2 for long sums: Hamilton (1994), equation 7.2.8."""
    segment, time = clock(4000)
    noise = first_order(4000, a, seed=4, columns=40)
    found = long_run(noise, segment, time)
    ratio = np.diag(found.covariance) / 4000.0 * (1.0 - a) ** 2
    chance = np.sqrt(2.0 / found.degrees_of_freedom / 40)
    assert abs(ratio.mean() - 1.0) < 3.0 * chance + 0.05
    spread = 2.0 / ratio.var(ddof=1) * ratio.mean() ** 2
    assert 0.5 < spread / found.degrees_of_freedom < 2.0


def test_intervals_of_a_mean_hold_it_as_often_as_they_say():
    segment, time = clock(400, 400)
    unit = np.full((800, 1), 800.0**-0.5)
    held = []
    for seed in range(150):
        noise = first_order(800, 0.8, seed=1000 + seed)
        left = noise - noise.mean()
        blocks = blocks_of(segment, time, block_length(left, segment, time))
        deviation = np.sqrt(blocks.covariance(left * blocks.restoring(unit))[0, 0])
        reach = student.ppf(0.975, blocks.degrees_of_freedom)
        held.append(abs(noise.sum()) < reach * deviation)
    assert abs(np.mean(held) - 0.95) < 2.5 * np.sqrt(0.95 * 0.05 / 150)


def test_errors_of_a_derivative_cancel_within_a_block():
    """White noise e differenced, times a slow x: the sum is that of e times the slope of x."""
    segment, time = clock(4000)
    slow = np.sin(time)[:, None]
    noise = np.random.default_rng(5).normal(size=(4001, 200))
    scores = slow * np.diff(noise, axis=0)
    found = np.diag(long_run(scores, segment, time).covariance)
    truth = np.sum(np.diff(slow[:, 0]) ** 2) + slow[0, 0] ** 2 + slow[-1, 0] ** 2
    white = 2.0 * np.sum(slow**2)
    assert white > 100.0 * truth
    assert 0.8 < found.mean() / truth < 1.8


def test_blocks_grow_with_the_correlation_and_the_log():
    segment, time = clock(4000)
    lengths = [block_length(first_order(4000, a, seed=6), segment, time) for a in (0.0, 0.9, 0.98)]
    assert lengths[0] < lengths[1] < lengths[2]
    longer = clock(16000)
    assert block_length(first_order(16000, 0.9, seed=6), *longer) > lengths[1]


def test_the_correlation_time_is_that_of_theory():
    """The integral of the autocorrelation a^|k| is (1 + a) / (1 - a) steps."""
    segment, time = clock(1000, 1000, step=0.2)
    found = correlation_time(first_order(2000, 0.9, seed=7, columns=60), segment, time)
    assert found == pytest.approx(0.2 * 1.9 / 0.1, rel=0.1)


def test_nothing_left_over_has_no_variance():
    segment, time = clock(100)
    found = long_run(np.zeros((100, 2)), segment, time)
    np.testing.assert_array_equal(found.covariance, 0.0)
    assert found.block > 0.0


def test_a_single_row_is_a_block():
    found = long_run(np.array([[2.0]]), np.array([3]), np.array([7.0]))
    assert found.n_blocks == 1
    assert found.covariance[0, 0] > 0.0


def test_segments_without_duration_have_one_all_the_same():
    _, spans = since_start(np.array([0, 1, 2]), np.array([5.0, 5.0, 5.0]))
    np.testing.assert_array_equal(spans, 1.0)


def test_the_degrees_of_freedom_are_the_roughness_of_the_taper():
    blocks = blocks_of(*clock(20000), length=20.0)
    assert blocks.degrees_of_freedom == pytest.approx(2000.0 / 20.0 / ROUGHNESS, rel=0.02)


def test_what_a_fit_takes_is_put_back():
    """With white errors the scores of residuals have covariance I again, on average."""
    segment, time = clock(200)
    unit = np.linalg.qr(np.random.default_rng(8).normal(size=(200, 6)) ** 3)[0]
    blocks = blocks_of(segment, time, 4.0)
    restoring, total = blocks.restoring(unit), np.zeros((6, 6))
    errors = np.random.default_rng(9).normal(size=(2000, 200))
    left = errors - (errors @ unit) @ unit.T
    for row in left:
        total += blocks.covariance((unit * row[:, None]) @ restoring) / 2000
    bare = sum(blocks.covariance(unit * row[:, None]) for row in left) / 2000
    np.testing.assert_allclose(total, np.eye(6), atol=0.1)
    np.testing.assert_allclose(bare, np.eye(6) - blocks.taken(unit), atol=0.1)
    assert np.trace(bare) < 5.5


def test_a_direction_the_fit_took_whole_is_not_blown_up():
    unit = np.eye(50)[:, :1]  # a single row decides alone: its residual is zero
    segment, time = clock(50)
    blocks = blocks_of(segment, time, 100.0)
    assert blocks.restoring(unit)[0, 0] <= np.sqrt(10.0) + 1e-12


@pytest.mark.parametrize(
    ("scores", "rows", "block", "message"),
    [
        (np.zeros(5), 5, None, r"`scores` must have shape \(5, p\); got \(5,\)"),
        (np.zeros((4, 1)), 5, None, r"shape \(5, p\); got \(4, 1\)"),
        (np.array([[0.0], [np.nan]]), 2, None, "row 1 is not"),
        (np.zeros((0, 1)), 0, None, "at least one row; got 0 and 0"),
        (np.zeros((5, 1)), 5, 0.0, "`block` must be positive"),
        (np.zeros((5, 1)), 5, float("nan"), "`block` must be positive"),
    ],
)
def test_bad_input_is_a_sentence(scores, rows, block, message):
    with pytest.raises(MethodError, match=message):
        long_run(scores, *clock(rows), block)

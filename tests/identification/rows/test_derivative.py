"""Acceleration from velocity: exact on polynomials, never across a join."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.identification.rows.derivative import default_derivative

LINEAR = hd.catalog["linear"]


def problem_of(vehicle, time, velocity, segment=None):
    log = hd.Log.from_arrays(
        time,
        velocity,
        wrench=np.zeros((len(time), 6)),
        segment=segment,
        attitude=np.zeros((len(time), 3)),
    )
    return hd.prepare(vehicle, log, LINEAR)


@pytest.fixture
def irregular():
    rng = np.random.default_rng(11)
    return np.cumsum(rng.uniform(0.05, 0.25, 120))


def cubic(time):
    coefficients = np.array(
        [
            [1, 2, 3, 4, 5, 6],
            [1, -1, 2, 0, 1, 3],
            [0.1, 0.2, 0, 0.3, 0, 0.1],
            [0.01, 0, 0.02, 0, 0.03, 0],
        ]
    )
    powers = time[:, None] ** np.arange(4)
    slopes = np.arange(1, 4) * time[:, None] ** np.arange(3)
    return powers @ coefficients, slopes @ coefficients[1:]


def test_savitzky_golay_is_exact_on_its_own_polynomials_on_any_clock(vehicle, irregular):
    velocity, slope = (values / 100 for values in cubic(irregular))
    estimate = hd.SavitzkyGolay(window=1.5, order=3).acceleration(
        problem_of(vehicle, irregular, velocity)
    )
    np.testing.assert_allclose(estimate, slope, rtol=1e-9, atol=1e-8)


def test_central_differences_are_exact_on_parabolas_on_any_clock(vehicle, irregular):
    velocity = np.outer(irregular**2 / 10, np.ones(6))
    estimate = hd.FiniteDifference().acceleration(problem_of(vehicle, irregular, velocity))
    np.testing.assert_allclose(estimate, np.outer(irregular / 5, np.ones(6)), rtol=1e-9)


def test_finite_differences_by_hand(vehicle):
    """Inside: slope of the parabola through three samples; two samples: their slope."""
    velocity = np.outer([0.0, 1.0, 4.0], np.ones(6))
    inside = hd.FiniteDifference().acceleration(problem_of(vehicle, [0.0, 1.0, 2.0], velocity))
    np.testing.assert_allclose(inside[:, 0], [0.0, 2.0, 4.0])
    pair = hd.FiniteDifference().acceleration(problem_of(vehicle, [0.0, 0.5], velocity[:2]))
    np.testing.assert_allclose(pair[:, 0], [2.0, 2.0])


@pytest.mark.parametrize("derivative", [hd.FiniteDifference(), hd.SavitzkyGolay(0.5)])
def test_nothing_crosses_a_join(vehicle, derivative):
    time = np.arange(40) / 10
    velocity = np.where(time[:, None] < 2.0, 0.0, 40.0) * np.ones(6)
    joined = problem_of(vehicle, time, velocity, segment=np.repeat(["a", "b"], 20))
    np.testing.assert_allclose(derivative.acceleration(joined), 0.0, atol=1e-9)


@pytest.mark.parametrize("length", [2, 3, 4])
def test_short_segments_take_what_there_is(vehicle, length):
    time = np.arange(length) / 10
    velocity = np.outer(3.0 * time, np.ones(6))
    estimate = hd.SavitzkyGolay(window=2.0).acceleration(problem_of(vehicle, time, velocity))
    np.testing.assert_allclose(estimate, 3.0, rtol=1e-9)


def test_savitzky_golay_beats_differences_on_noise(vehicle):
    rng = np.random.default_rng(5)
    time = np.arange(2000) / 10
    velocity = np.outer(np.sin(0.5 * time), np.ones(6)) + rng.normal(0, 0.0133, (2000, 6))
    truth = 0.5 * np.cos(0.5 * time)[:, None]
    problem = problem_of(vehicle, time, velocity)
    differences = hd.FiniteDifference().acceleration(problem) - truth
    filtered = hd.SavitzkyGolay(window=2.0).acceleration(problem) - truth
    assert filtered.std() < 0.3 * differences.std()


def test_blocks_of_an_irregular_clock_join_without_a_seam(vehicle):
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.uniform(0.08, 0.12, 5000))
    velocity, slope = cubic(time / 100)
    estimate = hd.SavitzkyGolay(window=1.0).acceleration(problem_of(vehicle, time, velocity))
    np.testing.assert_allclose(estimate, slope / 100, rtol=1e-6, atol=1e-8)


def test_the_record_is_preferred_where_there_is_one(vehicle, exact_log, true_damping):
    log = exact_log(true_damping(LINEAR), n=300)
    recorded = hd.prepare(vehicle, log, LINEAR)
    assert default_derivative(recorded) == hd.RecordedAcceleration()
    bare = hd.prepare(vehicle, replace(log, acceleration=None), LINEAR)
    assert default_derivative(bare) == hd.FiniteDifference()
    with pytest.raises(hd.MethodError, match="no acceleration columns"):
        hd.RecordedAcceleration().acceleration(bare)


@pytest.mark.parametrize(("window", "order"), [(0.0, 3), (-1.0, 3), (1.0, 0), (1.0, 6)])
def test_impossible_filters_are_refused(window, order):
    with pytest.raises(hd.MethodError, match="must be"):
        hd.SavitzkyGolay(window=window, order=order)

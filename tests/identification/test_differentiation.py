"""Numerical differentiation: exact on polynomials, within segments; sample-and-hold inputs."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import polynomial

import hydrodamp as hd
from hydrodamp.errors import MethodError
from hydrodamp.identification.differentiation import default_derivative
from hydrodamp.identification.regression import PointwiseRegression, accumulate

LINEAR = hd.catalog["linear"]
PUSHED = hd.DampingModel.from_table({"X": "u push"}, key="pushed")


def problem_of(vehicle, time, velocity, segment=None):
    still = {"wrench": np.zeros((len(time), 6)), "attitude": np.zeros((len(time), 3))}
    log = hd.Log.from_arrays(time, velocity, segment=segment, **still)
    return hd.prepare(vehicle, log, LINEAR)


@pytest.fixture
def irregular():
    return np.cumsum(np.random.default_rng(11).uniform(0.05, 0.25, 120))


def cubic(time):
    """A cubic on every axis, and its slope."""
    rows = np.random.default_rng(2).normal(size=(4, 6)) / [[1], [1], [10], [100]]
    return polynomial.polyval(time, rows).T, polynomial.polyval(time, polynomial.polyder(rows)).T


def test_savitzky_golay_is_exact_on_its_own_polynomials_on_any_clock(vehicle, irregular):
    velocity, slope = (values / 100 for values in cubic(irregular))
    problem = problem_of(vehicle, irregular, velocity)
    estimate = hd.SavitzkyGolay(window=1.5, order=3).acceleration(problem)
    np.testing.assert_allclose(estimate, slope, rtol=1e-9, atol=1e-8)


def test_finite_differences_by_hand(vehicle):
    """Inside: slope of the parabola through three samples; two samples: their slope."""
    velocity = np.outer([0.0, 1.0, 4.0], np.ones(6))
    central = hd.FiniteDifference().acceleration(problem_of(vehicle, [0.0, 1.0, 2.0], velocity))
    np.testing.assert_allclose(central[:, 0], [0.0, 2.0, 4.0])
    pair = hd.FiniteDifference().acceleration(problem_of(vehicle, [0.0, 0.5], velocity[:2]))
    np.testing.assert_allclose(pair[:, 0], [2.0, 2.0])


@pytest.mark.parametrize("derivative", [hd.FiniteDifference(), hd.SavitzkyGolay(0.5)])
def test_no_segment_boundary_is_crossed(vehicle, derivative):
    time = np.arange(40) / 10
    velocity = np.where(time[:, None] < 2.0, 0.0, 40.0) * np.ones(6)
    joined = problem_of(vehicle, time, velocity, segment=np.repeat(["a", "b"], 20))
    np.testing.assert_allclose(derivative.acceleration(joined), 0.0, atol=1e-9)


@pytest.mark.parametrize("length", [2, 3, 4])
def test_short_segments_use_all_their_samples(vehicle, length):
    time = np.arange(length) / 10
    velocity = np.outer(3.0 * time, np.ones(6))
    estimate = hd.SavitzkyGolay(window=2.0).acceleration(problem_of(vehicle, time, velocity))
    np.testing.assert_allclose(estimate, 3.0, rtol=1e-9)


def test_recorded_accelerations_are_preferred(vehicle, exact_log, true_damping):
    log = exact_log(true_damping(LINEAR), n=300)
    recorded = hd.prepare(vehicle, log, LINEAR)
    assert default_derivative(recorded) == hd.RecordedAcceleration()
    bare = hd.prepare(vehicle, replace(log, acceleration=None), LINEAR)
    assert default_derivative(bare) == hd.FiniteDifference()
    with pytest.raises(MethodError, match="no acceleration columns"):
        hd.RecordedAcceleration().acceleration(bare)


def test_absent_accelerations_are_differenced(bare):
    """Axes that are not coupled: forces as by the record, moments as by differences."""
    table = replace(bare, actuators=(hd.Matrix(("push",), [[1.0] * 6]),))
    log, rng = pushed_log(bare, n=60), np.random.default_rng(4)
    log = replace(log, velocity=rng.normal(size=(60, 6)), acceleration=rng.normal(size=(60, 6)))
    absent = np.array([0, 0, 0, 1, 1, 1], dtype=bool)
    partial = replace(log, acceleration=np.where(absent, np.nan, log.acceleration))
    rows = [PointwiseRegression().rows(hd.prepare(table, each, LINEAR)) for each in (partial, log)]
    differences = PointwiseRegression(hd.FiniteDifference()).rows(hd.prepare(table, log, LINEAR))
    expected = np.where(absent, differences.target, rows[1].target)
    np.testing.assert_allclose(rows[0].target, expected, atol=1e-9)
    triangle = accumulate(hd.prepare(table, partial, LINEAR)).r
    np.testing.assert_allclose(triangle.T @ triangle, rows[0].triangle().r.T @ rows[0].triangle().r)


def pushed_log(vehicle, seed=3, n=1200):
    """Surge under a push held from sample to sample, solved exactly step by step."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.05, 0.25, n))
    push = np.repeat(rng.uniform(-20, 20, n // 4 + 1), 4)[:n]
    mass, drag = vehicle.mass_matrix[0, 0], 30.0
    velocity = np.zeros((n, 6))
    for k, step in enumerate(np.diff(time)):
        decay = np.exp(-drag / mass * step)
        velocity[k + 1, 0] = velocity[k, 0] * decay + push[k] / drag * (1 - decay)
    return hd.Log.from_arrays(time, velocity, attitude=np.zeros((n, 3)), commands={"push": push})


@pytest.mark.parametrize("derivative", [hd.FiniteDifference(), hd.SavitzkyGolay(0.5, order=2)])
def test_held_commands_leave_no_half_sample_bias(bare, derivative):
    """M du/dt = -30 u + push, on an irregular clock: both coefficients within 2 %."""
    fit = hd.identify(PUSHED, bare, pushed_log(bare), hd.LeastSquares(derivative))
    assert fit.damping["X_u"] == pytest.approx(-30.0, rel=0.02)
    assert fit.damping["X_push"] == pytest.approx(1.0, rel=0.01)


def test_a_central_difference_weights_the_commands_of_both_steps(bare):
    """Weights h+ / (h- + h+) of the step before and h- / (h- + h+) of the step after."""
    log = pushed_log(bare, n=40)
    problem = hd.prepare(bare, log, PUSHED)
    filtered = hd.FiniteDifference().filter_held_inputs(problem).inputs.channels[:, 0]
    before, after = np.diff(log.time)[:-1], np.diff(log.time)[1:]
    push = log.command("push")
    expected = (after * push[:-2] + before * push[1:-1]) / (before + after)
    np.testing.assert_allclose(filtered[1:-1], expected, rtol=1e-12)

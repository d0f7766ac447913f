"""Held inputs as a derivative sees them: the command that really acted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd

MODEL = hd.DampingModel.from_table({"X": "u push"}, key="pushed")


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


@pytest.fixture
def bare(vehicle):
    return replace(vehicle, mass_matrix=np.diag(np.diag(vehicle.mass_matrix)))


@pytest.mark.parametrize("derivative", [hd.FiniteDifference(), hd.SavitzkyGolay(0.5, order=2)])
def test_held_commands_leave_no_half_sample_bias(bare, derivative):
    """M du/dt = -30 u + push, on an irregular clock: both coefficients within 2 %."""
    fit = hd.identify(MODEL, bare, pushed_log(bare), hd.LeastSquares(derivative))
    assert fit.damping["X_u"] == pytest.approx(-30.0, rel=0.02)
    assert fit.damping["X_push"] == pytest.approx(1.0, rel=0.01)


def test_a_central_difference_sees_both_commands_by_their_share(bare):
    """Weights h+ / (h- + h+) of the step before and h- / (h- + h+) of the step after."""
    log = pushed_log(bare, n=40)
    problem = hd.prepare(bare, log, MODEL)
    seen = hd.FiniteDifference().seen(problem).inputs.channels[:, 0]
    before, after = np.diff(log.time)[:-1], np.diff(log.time)[1:]
    push = log.command("push")
    expected = (after * push[:-2] + before * push[1:-1]) / (before + after)
    np.testing.assert_allclose(seen[1:-1], expected, rtol=1e-12)


def test_constant_inputs_are_seen_as_they_are():
    vehicle = hd.fleet["vt690"]
    n = 60
    log = hd.Log.from_arrays(
        np.arange(n) / 10,
        np.tile([1.5, 0, 0, 0, 0, 0], (n, 1)),
        attitude=np.zeros((n, 3)),
        commands={"rudder": np.full(n, 0.1), "elevator": np.zeros(n), "rpm": np.full(n, 1800.0)},
        segment=np.repeat(["a", "b"], n // 2),
    )
    problem = hd.prepare(vehicle, log, hd.catalog["gertler-hagen"])
    seen = hd.SavitzkyGolay().seen(problem).inputs
    np.testing.assert_allclose(seen.channels, problem.inputs.channels, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(seen.propulsion, problem.inputs.propulsion, rtol=1e-10)


def test_nothing_held_leaves_the_problem_itself(vehicle, exact_log, true_damping):
    log = exact_log(true_damping(hd.catalog["linear"]), n=30)
    problem = hd.prepare(vehicle, log, hd.catalog["linear"])
    assert hd.FiniteDifference().seen(problem) is problem
    assert hd.RecordedAcceleration().seen(problem) is problem


def test_a_segment_that_is_not_there_is_named(vehicle, exact_log, true_damping):
    log = exact_log(true_damping(hd.catalog["linear"]), n=30)
    problem = hd.prepare(vehicle, log, hd.catalog["linear"])
    with pytest.raises(hd.ProblemError, match="there are 3 segments"):
        hd.accumulate(problem, segments=[5])

"""Closed-loop simulation of an ensemble: equation 1 as in a replay, guidance, constraints."""

from dataclasses import replace

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.autopilot_design import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator
from hydrodamp.experiment_design.ensemble import extended_model, prior_damping, sample_ensemble
from hydrodamp.experiment_design.guidance import CourseGuidance, Manoeuvre
from hydrodamp.experiment_design.optimise import ensemble_information
from hydrodamp.identification.continuation import make_objective
from hydrodamp.simulation.problem import build_problem


@pytest.fixture(scope="module")
def closed_loop():
    vehicle, model = hd.fleet["vt690"], hd.catalog["fossen"]
    envelope = hd.Envelope(depth=(3, 20))
    known = prior_damping(vehicle, model, None)
    sizes = np.zeros(extended_model(vehicle, model, known).n_coefficients)
    ensemble = sample_ensemble(vehicle, model, known, sizes, 3, seed=1)
    autopilot = design_autopilot(vehicle, known, envelope)
    return ClosedLoopSimulator.of(vehicle, autopilot, envelope, ensemble)


@pytest.fixture(scope="module")
def trajectories(closed_loop):
    move = Manoeuvre("steps", 0.5, 0.5, (0.0, 0.3, 0.3, 0.1, 0.1))
    setpoints, overlays = move.setpoints(closed_loop.autopilot, closed_loop.envelope, 300)
    setpoints[:, 2] += closed_loop.envelope.mid_depth
    return closed_loop.simulate((setpoints[:, None], overlays[:, None]))


def member_log(closed_loop, trajectories, index):
    """Return the exact log of a member."""
    names = closed_loop.autopilot.names
    return trajectories.select([index]).log(closed_loop.vehicle, names, exact=True)


@pytest.mark.slow
def test_each_member_moves_as_a_replay_of_its_commands(closed_loop, trajectories):
    for index, damping in enumerate(closed_loop.ensemble.dampings):
        log = member_log(closed_loop, trajectories, index)
        replay = hd.simulate(closed_loop.vehicle, damping, log, attitude="simulated", max_step=0.02)
        assert np.abs(replay.velocity - log.velocity).max() < 1e-4


@pytest.mark.slow
def test_the_autopilot_follows_setpoints(closed_loop, trajectories):
    calm, overlays = Manoeuvre("steps", 0.5, 0.5, (0.0,) * 5).setpoints(
        closed_loop.autopilot, closed_loop.envelope, 400
    )
    calm += (0.0, np.pi - 0.2, 14.0)
    calm[:200, 1:] = (0.2 - np.pi, 11.0)  # the shorter turn is through south
    result = closed_loop.with_members([0]).simulate((calm[:, None], overlays[:, None]))
    turn = np.angle(np.exp(1j * (result.states[-1, 0, 8] - calm[-1, 1])))
    assert abs(turn) < 0.02
    assert result.states[-1, 0, 11] == pytest.approx(14.0, abs=0.3)
    assert result.states[200:, 0, 8].min() < -np.pi + 0.2


@pytest.mark.slow
def test_course_setpoints_turn_slowly_so_that_all_members_turn_to_one_side(closed_loop):
    """A step of half a turn, less a degree: the shorter turn differs between members."""
    setpoints, overlays = Manoeuvre("steps", 0.5, 0.5, (0.0,) * 5).setpoints(
        closed_loop.autopilot, closed_loop.envelope, 600
    )
    setpoints += (0.0, 0.0, closed_loop.envelope.mid_depth)
    excitation = setpoints[:, None], overlays[:, None]
    result = closed_loop.simulate(
        excitation, 1, lambda index, _: np.radians(179.0) if index > 99 else 0.0
    )
    rate = np.diff(result.setpoints[:, :, 1], axis=0) / result.period
    assert np.degrees(np.abs(rate).max()) == pytest.approx(5.0)
    assert np.degrees(result.states[-1, :, 8]) == pytest.approx([179.0] * 3, abs=5.0)


def test_courses_depend_on_the_positions_of_the_members():
    """Segments of 100 m by dead reckoning, of 110 m for one member, in a square of 300 m."""
    area = hd.Envelope(area={"north": (-150, 150), "east": (-150, 150)}).area
    setpoints = np.tile([2.0, 0.0, 10.0], (12, 500, 1))
    guidance = CourseGuidance(area, setpoints, 0.1, np.zeros((12, 1, 1, 2)))
    position, distances = np.zeros((2, 2)), []
    for segment in range(12):
        course = guidance(500 * segment, position)
        assert guidance(500 * segment + 5, position + 1.0) == course
        position = position + np.array([[100.0], [110.0]]) * [np.cos(course), np.sin(course)]
        distances.append(np.abs(position).max())
    assert max(distances) < 150.0


def test_violations_are_relative_to_the_limits(closed_loop, trajectories):
    narrow = closed_loop.envelope.model_copy(update={"depth": (9.0, 13.0), "pitch": 5.0})
    violations = trajectories.limit_violations(narrow)
    depth = trajectories.states[:, :, 11]
    excess = max(depth.max() - 13.0, 9.0 - depth.min())
    assert violations["depth"].max() == pytest.approx(excess / 4.0)
    wide = trajectories.limit_violations(closed_loop.envelope)
    assert violations["pitch"].max() > 0.0 > wide["pitch"].max()


def test_information_is_that_of_output_error_at_each_members_coefficients(
    closed_loop, trajectories
):
    """Windows of the engine, from the same states, with the terms of all members free."""
    information = ensemble_information(closed_loop, trajectories, 2.0)
    extended = closed_loop.ensemble.extended_model
    indices = [extended.index(label) for label in closed_loop.ensemble.model.labels]
    for number, damping in enumerate(closed_loop.ensemble.dampings):
        log = member_log(closed_loop, trajectories, number)
        problem = build_problem(closed_loop.vehicle, log, (extended,))
        noise = closed_loop.envelope.noise_std[:6]
        objective = replace(
            make_objective(problem, extended),
            velocity=problem.inputs.velocity,
            initial_state_std=2.0 * noise,
            time_scale=2.0,
        )
        normal = objective.windows(12.0).linearise(damping.coefficients, noise)[0]
        n_residuals = problem.n_samples * 6  # overlapping windows count once
        expected = normal[np.ix_(indices, indices)] * n_residuals
        assert information[number] == pytest.approx(expected, rel=1e-6)

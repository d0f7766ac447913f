"""Sailing: equation 1 as a replay has it, side by side and in closed loop."""

import numpy as np
import pytest

import hydrodamp as hd
from hydrodamp.experiment_design.autopilot import design_autopilot
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, limit_violations
from hydrodamp.experiment_design.ensemble import prior_damping, sample_ensemble, wide_model
from hydrodamp.experiment_design.excitation import Manoeuvre
from hydrodamp.experiment_design.fisher_information import ErrorModel, fisher_information
from hydrodamp.experiment_design.guidance import CourseGuidance


@pytest.fixture(scope="module")
def closed_loop():
    vehicle, model = hd.fleet["vt690"], hd.catalog["fossen"]
    envelope = hd.Envelope(depth=(3, 20))
    known = prior_damping(vehicle, model, None)
    sizes = np.zeros(wide_model(vehicle, model, known).n_coefficients)
    ensemble = sample_ensemble(vehicle, model, known, sizes, 3, seed=1)
    return ClosedLoopSimulator.of(
        vehicle, design_autopilot(vehicle, known, envelope), envelope, ensemble
    )


@pytest.fixture(scope="module")
def trajectories(closed_loop):
    move = Manoeuvre("steps", 0.5, 0.5, (0.0, 0.3, 0.3, 0.1, 0.1))
    setpoints, overlays = move.setpoints(closed_loop.autopilot, closed_loop.envelope, 300)
    setpoints[:, 2] += closed_loop.envelope.mid_depth
    return closed_loop.simulate(
        (np.repeat(setpoints[:, None], 3, axis=1), np.repeat(overlays[:, None], 3, axis=1))
    )


def test_each_vehicle_sails_as_a_replay_of_its_commands_in_its_own_water(closed_loop, trajectories):
    for place, water in enumerate(closed_loop.ensemble.dampings):
        log = trajectories.select([place]).log(
            closed_loop.vehicle, closed_loop.autopilot.names, exact=True
        )
        again = hd.simulate(closed_loop.vehicle, water, log, attitude="simulated", max_step=0.02)
        assert np.abs(again.velocity - log.velocity).max() < 1e-4


def test_the_autopilot_follows_what_it_is_told(closed_loop, trajectories):
    calm, overlays = Manoeuvre("steps", 0.5, 0.5, (0.0,) * 5).setpoints(
        closed_loop.autopilot, closed_loop.envelope, 400
    )
    calm += (0.0, np.pi - 0.2, 14.0)
    calm[:200, 1:] = (0.2 - np.pi, 11.0)  # the short way is over south
    simulate_candidates = closed_loop.with_members([0]).simulate((calm[:, None], overlays[:, None]))
    turn = np.angle(np.exp(1j * (simulate_candidates.states[-1, 0, 8] - calm[-1, 1])))
    assert abs(turn) < 0.02
    assert simulate_candidates.states[-1, 0, 11] == pytest.approx(14.0, abs=0.3)
    assert simulate_candidates.states[200:, 0, 8].min() < -np.pi + 0.2


def test_course_setpoints_turn_slowly_so_that_all_members_turn_to_one_side(closed_loop):
    """A step of half a turn, less a degree: the way that is shorter for one is not for another."""
    setpoints, overlays = Manoeuvre("steps", 0.5, 0.5, (0.0,) * 5).setpoints(
        closed_loop.autopilot, closed_loop.envelope, 600
    )
    setpoints += (0.0, 0.0, closed_loop.envelope.mid_depth)
    orders = tuple(np.repeat(one[:, None], 3, axis=1) for one in (setpoints, overlays))
    simulate_candidates = closed_loop.simulate(
        orders, 1, lambda place, _: np.radians(179.0) if place > 99 else 0.0
    )
    rate = np.diff(simulate_candidates.setpoints[:, :, 1], axis=0) / simulate_candidates.period
    assert np.degrees(np.abs(rate).max()) == pytest.approx(5.0)
    assert np.degrees(simulate_candidates.states[-1, :, 8]) == pytest.approx([179.0] * 3, abs=5.0)


def test_courses_are_chosen_from_where_the_vehicles_are():
    """Stretches of 100 m, and of 110 m where 100 were thought, in a square of 300 m."""
    area = hd.Envelope(area={"north": (-150, 150), "east": (-150, 150)}).area
    setpoints = np.tile([2.0, 0.0, 10.0], (12, 500, 1))
    pilot, here, seen = (
        CourseGuidance(area, setpoints, 0.1, np.zeros((12, 1, 1, 2))),
        np.zeros((2, 2)),
        [],
    )
    for stretch in range(12):
        course = pilot(500 * stretch, here)
        assert pilot(500 * stretch + 5, here + 1.0) == course
        here = here + np.array([[100.0], [110.0]]) * [np.cos(course), np.sin(course)]
        seen.append(np.abs(here).max())
    assert max(seen) < 150.0


def test_limits_are_told_by_how_much_they_are_passed(closed_loop, trajectories):
    narrow = closed_loop.envelope.model_copy(update={"depth": (9.0, 13.0), "pitch": 5.0})
    far = limit_violations(narrow, trajectories)
    depth = trajectories.states[:, :, 11]
    assert far["depth"].max() == pytest.approx(max(depth.max() - 13.0, 9.0 - depth.min()) / 4.0)
    assert (
        far["pitch"].max()
        > 0.0
        > limit_violations(closed_loop.envelope, trajectories)["pitch"].max()
    )


def test_information_adds_up_and_falls_with_the_square_of_noise(closed_loop, trajectories):
    noise = closed_loop.envelope.noise_std[:6]
    one, two = (
        fisher_information(closed_loop, trajectories, ErrorModel.of(k * noise)) for k in (1.0, 2.0)
    )
    assert two == pytest.approx(one / 4.0)
    assert np.linalg.eigvalsh(one).min() > 0.0
    longer = trajectories.until(160), trajectories
    parts = [
        np.trace(fisher_information(closed_loop, some, ErrorModel.of(noise))[0]) for some in longer
    ]
    assert parts[0] < parts[1]

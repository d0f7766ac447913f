"""The autopilot: signs, limits and anti-windup; the runs are those of section V-B."""

from dataclasses import astuple

import numpy as np
import pytest

from hydrodamp.simulation.campaign.conditions import (
    COMMAND_PERIOD,
    PUBLISHED_AUTOPILOT,
    TEST_RUNS,
    TRAINING_RUNS,
    StepSequence,
    fin_autopilot,
)
from hydrodamp.simulation.closed_loop import FIN_LIMIT, INTEGRAL_LIMIT, AutopilotState, Pid


def control(autopilot, measured, setpoints, state, period=COMMAND_PERIOD):
    return autopilot.control(measured, setpoints, np.zeros((len(measured), 2)), state, period)


def level(n=1):
    """Measurements of a vehicle at 2 m/s, level, heading north, 10 m deep."""
    measured = np.zeros((n, 10))
    measured[:, 0], measured[:, 9] = 2.0, 10.0
    return measured


def test_gains_are_the_published_ones():
    """vehicles-and-methods, section 1."""
    assert astuple(PUBLISHED_AUTOPILOT.pitch.pid)[:3] == (4.5, 0.2, 7.0)
    assert astuple(PUBLISHED_AUTOPILOT.heading.pid)[:3] == (3.0, 0.005, 3.0)
    assert astuple(PUBLISHED_AUTOPILOT.depth.pid)[:3] == (-0.07, -0.001, 0.095)
    assert np.degrees([INTEGRAL_LIMIT, FIN_LIMIT]) == pytest.approx([5.0, 20.0])


def test_signs():
    """On course nothing; to starboard rudder negative; to go deeper elevator negative."""
    setpoints = np.array([[2.0, 0.0, 10.0], [2.0, 0.05, 10.0], [2.0, 0.0, 10.1]])
    initial = AutopilotState.initial(3)
    commands, state = control(PUBLISHED_AUTOPILOT, level(3), setpoints, initial)
    np.testing.assert_array_equal(np.sign(commands), [[0, 0], [-1, 0], [0, -1]])
    np.testing.assert_array_equal(state.integrals[0], 0.0)


def test_the_integral_of_the_error_does_not_wind_up():
    """It stops at its own limit, and while the output is at its limit."""
    integral = np.zeros(1)
    for count in range(1, 200):
        output, integral = Pid(0.0, 1.0, 0.0).step(np.array([0.02]), np.zeros(1), integral, 0.1)
        assert output[0] == pytest.approx(min(count * 0.02 * COMMAND_PERIOD, INTEGRAL_LIMIT))
    assert integral[0] <= INTEGRAL_LIMIT
    _, integral = Pid(3.0, 0.005, 0.0).step(np.array([1.0]), np.zeros(1), np.zeros(1), 0.1)
    assert integral[0] == 0.0


@pytest.mark.parametrize("period", [0.02, COMMAND_PERIOD, 0.2])
def test_depth_rate_is_the_mean_over_five_seconds(period):
    """A descent of 0.2 m/s is measured from the second sample on, at any period."""
    autopilot = fin_autopilot(Pid(0.0, 0.0, 1.0), Pid(1.0, 0.0, 0.0), Pid(0.0, 0.0, 0.0))
    state, measured = AutopilotState.initial(1), level()
    for count in range(300):
        (command,), state = control(autopilot, measured, np.zeros((1, 3)), state, period)
        assert command[1] == pytest.approx(-0.2 if count else 0.0)
        measured[0, 9] += 0.2 * period
    assert len(state.depths) == round(5.0 / period) + 1


def test_runs_are_those_of_section_5b():
    """Depth steps at 2600, yaw steps at 1800, 2133, 2600; test 2133 and 2350; one plane a run."""
    assert " ".join(run.name for run in TRAINING_RUNS) == "depth-2600 yaw-1800 yaw-2133 yaw-2600"
    assert " ".join(run.name for run in TEST_RUNS) == "depth-2133 yaw-2350"
    time = np.arange(0.0, 400.0, 0.1)
    for run in TRAINING_RUNS + TEST_RUNS:
        kind, rpm = run.name.split("-")
        assert run.rpm == float(rpm)
        moving = [np.ptp(sequence.values(time)) > 0.0 for sequence in (run.depth, run.heading)]
        assert moving == [kind == "depth", kind == "yaw"]


def test_steps_come_at_their_times():
    """A step acts from its own instant on, and the lists repeat separately."""
    steps = StepSequence((1.0, 2.0, -3.0), holds=(10.0, 20.0), first=5.0)
    time = np.array([4.9, 5.0, 14.9, 15.0, 34.9, 35.0, 44.9, 45.0])
    np.testing.assert_array_equal(steps.values(time), [0, 1, 1, 3, 3, 0, 0, 1])

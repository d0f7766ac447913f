"""The autopilot steers the right way and keeps its limits; its runs are those of section V-B."""

from __future__ import annotations

import numpy as np
import pytest

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.autopilot import (
    DEPTH_LOOP,
    DEPTH_STEPS,
    HEADING_STEPS,
    PERIOD,
    PITCH_LOOP,
    PUBLISHED,
    STEADY,
    TESTING,
    TRAINING,
    YAW_LOOP,
    Memory,
    Pid,
    Steps,
)

LIMIT = np.radians(20.0)


def level(n: int = 1) -> FloatArray:
    """Measurements of a vehicle at 2 m/s, level, heading north, 10 m deep."""
    measured = np.zeros((n, 10))
    measured[:, 0], measured[:, 9] = 2.0, 10.0
    return measured


def test_gains_are_the_published_ones() -> None:
    """vehicles-and-methods, section 1."""
    published = [(4.5, 0.2, 7.0), (3.0, 0.005, 3.0), (-0.07, -0.001, 0.095)]
    loops = (PITCH_LOOP, YAW_LOOP, DEPTH_LOOP)
    assert [(one.proportional, one.integral, one.derivative) for one in loops] == published
    assert DEPTH_LOOP.integral_limit == pytest.approx(np.radians(5.0))
    assert all(one.output_limit == pytest.approx(LIMIT) for one in loops)


def test_on_course_nothing_moves() -> None:
    """No error, no rate: both fins stay at zero."""
    commands, memory = PUBLISHED.steer(level(), np.zeros(1), np.full(1, 10.0), Memory.blank(1))
    np.testing.assert_array_equal(commands, [[0.0, 0.0]])
    np.testing.assert_array_equal(memory.totals, np.zeros((3, 1)))


def test_signs() -> None:
    """To starboard: rudder negative. To go deeper: elevator negative, nose down."""
    heading, depth = np.array([0.05, 0.0]), np.array([10.0, 10.1])
    commands, _ = PUBLISHED.steer(level(2), heading, depth, Memory.blank(2))
    assert commands[0, 0] < 0.0
    assert commands[0, 1] == 0.0
    assert commands[1, 0] == 0.0
    assert commands[1, 1] < 0.0


def test_measured_rates_are_opposed() -> None:
    """A bow that rises gets nose-down elevator, one that turns to starboard port rudder."""
    measured = level()
    measured[0, 4:6] = 0.01
    (commands,), _ = PUBLISHED.steer(measured, np.zeros(1), np.full(1, 10.0), Memory.blank(1))
    np.testing.assert_allclose(commands, [3.0 * 0.01, -7.0 * 0.01])


def test_fins_stay_within_twenty_degrees() -> None:
    """However large the errors."""
    rng = np.random.default_rng(1)
    measured = rng.normal(scale=5.0, size=(500, 10))
    goals = rng.normal(scale=50.0, size=(2, 500))
    commands, _ = PUBLISHED.steer(measured, goals[0], goals[1], Memory.blank(500))
    assert np.max(np.abs(commands)) <= LIMIT
    assert np.any(np.abs(commands) == LIMIT)


def test_integral_grows_by_error_times_period_and_stops_at_its_limit() -> None:
    """No wind-up: the integral term never leaves its own limit."""
    pid, total = Pid(0.0, 1.0, 0.0), np.zeros(1)
    for count in range(1, 200):
        output, total = pid.step(np.array([0.02]), np.zeros(1), total)
        expected = min(count * 0.02 * PERIOD, float(np.radians(5.0)))
        assert output[0] == pytest.approx(expected)
    assert total[0] <= np.radians(5.0)


def test_integral_stands_still_while_the_output_is_at_its_limit() -> None:
    """A large error does not fill the integral."""
    _, total = Pid(3.0, 0.005, 0.0).step(np.array([1.0]), np.zeros(1), np.zeros(1))
    assert total[0] == 0.0


def test_depth_rate_is_the_mean_over_five_seconds() -> None:
    """A steady descent of 0.2 m/s is seen as such, from the second sample on."""
    memory = Memory.blank(1)
    for count in range(80):
        measured = level()
        measured[0, 9] = 10.0 + 0.2 * PERIOD * count
        _, memory = PUBLISHED.steer(measured, np.zeros(1), np.full(1, 10.0), memory)
        assert memory.depth_rate[0] == pytest.approx(0.2 if count else 0.0)
    assert len(memory.depths) == 51


def test_speeds_and_order_are_those_of_section_5b() -> None:
    """Depth steps at 2600, yaw steps at 1800, 2133, 2600; test 2133 and 2350."""
    assert [(run.name, run.rpm) for run in TRAINING] == [
        ("depth-2600", 2600.0),
        ("yaw-1800", 1800.0),
        ("yaw-2133", 2133.0),
        ("yaw-2600", 2600.0),
    ]
    assert [(run.name, run.rpm) for run in TESTING] == [
        ("depth-2133", 2133.0),
        ("yaw-2350", 2350.0),
    ]


def test_a_run_steps_in_depth_or_in_heading_but_not_in_both() -> None:
    """The other reference stands still."""
    time = np.arange(0.0, 400.0, 0.1)
    for run in TRAINING + TESTING:
        moving = tuple(bool(np.ptp(one.at(time)) > 0.0) for one in (run.depth, run.heading))
        assert moving == (run.name.startswith("depth"), run.name.startswith("yaw"))


def test_references_start_from_zero_and_stay_near_it() -> None:
    """The steps add up to zero, so a long run does not wander off."""
    assert sum(HEADING_STEPS) == 0.0
    assert sum(DEPTH_STEPS) == 0.0
    long = np.arange(0.0, 5000.0)
    for run in TRAINING + TESTING:
        assert run.heading.at(long)[0] == run.depth.at(long)[0] == 0.0
        assert np.max(np.abs(run.heading.at(long))) <= 150.0
        assert np.max(np.abs(run.depth.at(long))) < 10.0


def test_steps_come_at_their_times() -> None:
    """A step acts from its own instant on, and the lists repeat separately."""
    steps = Steps((1.0, 2.0, -3.0), holds=(10.0, 20.0), first=5.0)
    time = np.array([4.9, 5.0, 14.9, 15.0, 34.9, 35.0, 44.9, 45.0])
    np.testing.assert_array_equal(steps.at(time), [0, 1, 1, 3, 3, 0, 0, 1])


def test_nothing_is_asked_of_no_time() -> None:
    """An empty clock gives an empty reference."""
    assert STEADY.at(np.empty(0)).shape == (0,)


@pytest.mark.parametrize("period", [0.02, 0.2])
def test_another_rate_steers_alike(period: float) -> None:
    """Integrals and the depth rate are those of time, not of the count of samples."""
    measured, slow = level(), PUBLISHED.every(period)
    measured[0, 9] = 10.02
    memories = []
    for autopilot in (PUBLISHED, slow):
        memory = Memory.blank(1)
        for _ in range(round(6.0 / autopilot.period)):
            measured[0, 9] += 0.001 * autopilot.period
            _, memory = autopilot.steer(measured, np.zeros(1), np.full(1, 10.0), memory)
        measured[0, 9] = 10.02
        memories.append(memory)
    assert slow.period == period
    np.testing.assert_allclose(memories[1].totals, memories[0].totals, rtol=0.05)
    np.testing.assert_allclose(memories[1].depth_rate, 0.001)
    assert len(memories[1].depths) == round(5.0 / period) + 1

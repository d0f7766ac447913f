"""The plan is the one of section V-B of the paper."""

from __future__ import annotations

import numpy as np

from hydrodamp.simulation.campaign.autopilot import (
    DEPTH_STEPS,
    HEADING_STEPS,
    STEADY,
    TESTING,
    TRAINING,
    Steps,
)


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

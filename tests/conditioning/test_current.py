import dataclasses
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from hydrodamp.conditioning.current import Current, estimate_current, subtract_current
from hydrodamp.data.attitude import euler_from_quaternion, quaternion_from_euler, rotation_matrices
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError
from value_changes import set_values

SPEEDS = {1500.0: 1.5, 1000.0: 1.0}


@cache
def survey(seed=0, legs=8):
    """Legs up and down with turns between, two propeller speeds, as seen through the water."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 200.0 * legs, 0.5)
    leg, phase = np.divmod(time, 200.0)
    rpm = np.where(leg % 4 < 2, 1500.0, 1000.0)
    turn = np.clip((phase - 160) / 40, 0, 1)
    yaw = np.pi * (leg + turn) + 0.4
    rate = np.where(phase > 160, np.pi / 40, 0.0)
    surge = np.where(rpm > 1200, 1.5, 1.0) - 8 * rate**2
    drift = -1.2 * rate
    noise = np.cumsum(rng.normal(size=(2, len(time))), axis=1)
    noise -= np.apply_along_axis(lambda row: np.convolve(row, np.ones(40) / 40, "same"), 1, noise)
    noise *= 0.02 / noise.std()
    velocity = np.zeros((len(time), 6))
    velocity[:, 0], velocity[:, 1], velocity[:, 5] = surge + noise[0], drift + noise[1], rate
    return Log.from_arrays(
        time,
        velocity,
        attitude=np.column_stack((0 * yaw, 0.05 + 0 * yaw, yaw)),
        commands={"rpm": rpm},
    )


def in_current(log, current):
    """Add a current, north and east at each sample, to what is seen through the water."""
    flow = np.column_stack((current, np.zeros(log.n)))
    added = np.einsum("nji,nj->ni", rotation_matrices(log.attitude), flow)
    return set_values(log, "velocity", (np.s_[:, :3], lambda velocity: velocity + added))


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.integers(0, 3))
def test_a_known_constant_current_comes_back(north, east, seed):
    log = survey(seed)
    found = estimate_current(in_current(log, np.tile((north, east), (log.n, 1))), drift=0.0)
    assert found.velocity.shape == (1, 2)
    np.testing.assert_allclose(found.velocity[0], (north, east), atol=0.02)
    assert found.determined


def test_a_tide_that_turns_comes_back():
    log = survey()
    true = np.column_stack((0.1 + 0 * log.elapsed, 0.25 * np.sin(2 * np.pi * log.elapsed / 3600)))
    found = estimate_current(in_current(log, true), spacing=300.0, drift=0.1)
    np.testing.assert_allclose(found.at(log.elapsed), true, atol=0.05)
    assert found.standard_error.max() < 0.03


def test_what_is_removed_is_what_was_added():
    log = survey()
    flow = np.tile((0.2, 0.3), (log.n, 1))
    current = Current([0.0], [[0.2, 0.3]], [[0.0, 0.0]])
    known = subtract_current(in_current(log, flow), current)
    np.testing.assert_allclose(known.velocity, log.velocity, atol=1e-12)
    back = subtract_current(in_current(log, flow))
    np.testing.assert_allclose(back.velocity[:, :2], log.velocity[:, :2], atol=0.02)
    assert "less a current estimated of" in back.notes[-1]


def test_recorded_accelerations_follow():
    """The derivative of the velocity through the water is that of its difference."""
    time = np.arange(0.0, 100.0, 0.01)
    yaw = 0.1 * time
    velocity = np.zeros((len(time), 6))
    velocity[:, 0], velocity[:, 5] = 1.5, 0.1
    log = Log(
        time=time,
        velocity=velocity,
        attitude=quaternion_from_euler(np.outer(yaw, (0, 0, 1))),
        acceleration=np.zeros_like(velocity),
    )
    tide = Current([0.0, 100.0], [[0.2, 0.0], [0.0, 0.3]], np.zeros((2, 2)))
    made = subtract_current(log, tide)
    slopes = np.gradient(made.velocity, time, axis=0)
    np.testing.assert_allclose(made.acceleration[1:-1], slopes[1:-1], atol=1e-6)
    assert subtract_current(made, Current([0.0], [[0, 0]], [[0, 0]])).acceleration is not None


def test_runs_months_apart_have_knots_of_their_own():
    log = in_current(survey(), np.tile((0.2, -0.1), (survey().n, 1)))
    later = dataclasses.replace(log, time=log.time + 1e7)
    both = estimate_current(concatenate([log, later]), spacing=400.0)
    assert len(both.time) < 16
    np.testing.assert_allclose(both.velocity, np.tile((0.2, -0.1), (len(both.time), 1)), atol=0.04)


def test_one_heading_tells_nothing(refused):
    log = survey().between(0, 150)
    assert not estimate_current(log).determined
    refused(LogError, subtract_current, log)


def test_lacking_and_impossible_are_named_at_once(refused):
    log = Log.from_arrays([0, 1], {"r": [0, 0]})
    refused(LogError, estimate_current, log, spacing=0.0)
    refused(LogError, lambda: subtract_current(log, Current([0.0], [[0, 0]], [[0, 0]])))
    still = dataclasses.replace(survey(), velocity=np.zeros((survey().n, 6)))
    refused(LogError, estimate_current, still)


@pytest.mark.slow
def test_the_field_log_of_the_690(measured_logs):
    """Oracle: its documentation, a current that grows from 0.11 to 0.28 m/s towards east."""
    path = measured_logs("vt690_field") / "derived_10hz.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    log = Log.from_arrays(
        table[:, 0],
        dict(zip("uvwpqr", (*table[:, 1:4].T, *table[:, 7:10].T), strict=True)),
        attitude=table[:, 4:7],
        commands={"elevator": table[:, 10], "rudder": table[:, 11]},
    )
    found = estimate_current(log, spacing=1e4)
    (north, east) = found.velocity.T
    assert found.determined
    assert np.abs(north).max() < 0.06
    assert east[0] == pytest.approx(0.11, abs=0.05)
    assert east[1] == pytest.approx(0.28, abs=0.05)
    through = subtract_current(log, found)
    apart = [_difference_of_headings(log, one.velocity) for one in (log, through)]
    assert apart[1] < 0.15 * apart[0]


def _difference_of_headings(log, velocity):
    """Return how much faster the vehicle seems on one heading than on the other [m/s]."""
    yaw = np.degrees(euler_from_quaternion(log.attitude)[:, 2]) % 360
    steady = np.abs(velocity[:, 5]) < 0.01
    means = [velocity[steady & (np.abs(yaw - at) < 15), 0].mean() for at in (48, 228)]
    return float(abs(means[0] - means[1]))

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

DEGREE = 180 / np.pi


def tumble(rate, seed, n=300):
    """Return an irregular clock, the attitude and the rates of a steady tumble."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.05, 0.2, n))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    half = rate * time[:, np.newaxis] / 2
    attitude = np.concatenate((np.cos(half), np.sin(half) * axis), axis=1)
    return time, attitude, np.tile(rate * axis, (n, 1))


@pytest.mark.slow
@given(st.floats(0.05, 0.8), st.integers(0, 99))
def test_a_log_in_degrees_names_its_rates(rate, seed):
    time, attitude, rates = tumble(rate, seed)
    velocity = np.concatenate((np.ones((300, 3)), DEGREE * rates), axis=1)
    with pytest.raises(LogError, match=r"rates `p q r` must be in rad/s; they are 57.3 times"):
        Log.from_arrays(time, velocity, attitude=attitude)
    velocity[:, 3:5] /= DEGREE
    with pytest.raises(LogError, match="rates `r` must be in rad/s"):
        Log.from_arrays(time, velocity, attitude=attitude)


def test_a_few_stray_attitudes_do_not_hide_it(refused):
    time = np.arange(0.0, 60.0, 0.1)
    yaw = np.outer(np.sin(0.5 * time), (0, 0, 1))
    yaw[::100, 2] += 3.0
    refused(LogError, Log.from_arrays, time, {"r": DEGREE * 0.5 * np.cos(0.5 * time)}, attitude=yaw)


def test_infinite_values_and_bad_quaternions_are_faults(refused):
    velocity = np.zeros((3, 6))
    velocity[1, 2] = np.inf
    refused(
        LogError,
        Log.from_arrays,
        [0, 1, 2],
        velocity,
        attitude=[[2, 0, 0, 0]] * 3,
        commands={"rudder": [0, 0, -np.inf]},
    )


def test_a_speed_beyond_any_vehicle_names_column_value_and_row(refused):
    velocity = np.zeros((5, 6))
    velocity[2:4, 0] = -51.5
    velocity[1, 5] = 200.0
    refused(LogError, Log.from_arrays, np.arange(5.0), velocity)
    refused(LogError, Log, time=np.arange(5.0), velocity=velocity)


def test_no_motion_unrelated_motion_and_few_samples_say_nothing():
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.1)
    still = np.tile([1.0, 0, 0, 0], (200, 1))
    unrelated = quaternion_from_euler(rng.normal(size=(200, 3)))
    fast = DEGREE * rng.normal(size=(200, 3))
    few = tumble(0.5, 1, n=5)
    for clock, attitude, rates in ((time, still, fast), (time, unrelated, fast), few):
        velocity = np.column_stack((0 * rates, np.clip(rates, -50, 50)))
        assert Log.from_arrays(clock, velocity, attitude=attitude).n == len(clock)

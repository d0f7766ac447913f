from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hydrodamp.data.agreement import agreement, turned
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

DEGREE = 180 / np.pi


def tumble(rate: float, seed: int, n: int = 300) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an irregular clock, the attitude and the rates of a steady tumble."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.05, 0.2, n))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    half = rate * time[:, np.newaxis] / 2
    attitude = np.concatenate((np.cos(half), np.sin(half) * axis), axis=1)
    return time, attitude, np.tile(rate * axis, (n, 1))


def in_degrees(time: np.ndarray, attitude: np.ndarray, rates: np.ndarray) -> bool:
    """Return whether a log with these rates is refused for their unit."""
    velocity = np.column_stack((np.zeros_like(rates), np.clip(rates, -400, 400)))
    try:
        Log.from_arrays(time, velocity, attitude=attitude)
    except LogError as error:
        return "in deg/s" in error.faults[0]
    return False


@given(st.floats(0.05, 3.0), st.integers(0, 99))
def test_the_same_in_degrees_is_caught(rate: float, seed: int) -> None:
    time, attitude, rates = tumble(rate, seed)
    assert in_degrees(time, attitude, DEGREE * rates)


def test_a_log_in_degrees_names_its_rates() -> None:
    time, attitude, rates = tumble(0.5, 7)
    velocity = np.concatenate((np.ones((300, 3)), DEGREE * rates), axis=1)
    with pytest.raises(LogError, match=r"rates `p q r` must be in rad/s; they are 57.3 times"):
        Log.from_arrays(time, velocity, attitude=attitude)
    velocity[:, 3:5] /= DEGREE
    with pytest.raises(LogError, match="rates `r` must be in rad/s"):
        Log.from_arrays(time, velocity, attitude=attitude)


def test_infinite_values_and_bad_quaternions_are_faults() -> None:
    velocity = np.zeros((3, 6))
    velocity[1, 2] = np.inf
    with pytest.raises(LogError) as caught:
        Log.from_arrays(
            [0, 1, 2],
            velocity,
            attitude=[[2, 0, 0, 0]] * 3,
            commands={"rudder": [0, 0, -np.inf]},
        )
    message = str(caught.value)
    assert "`w` must be finite; it is infinite in row 2" in message
    assert "`rudder` must be finite; it is infinite in row 3" in message
    assert "must have norm 1; it is 2 in row 1" in message


def test_a_speed_beyond_any_vehicle_names_column_value_and_row() -> None:
    velocity = np.zeros((5, 6))
    velocity[2:4, 0] = -51.5
    velocity[1, 5] = 200.0
    with pytest.raises(LogError) as caught:
        Log.from_arrays(np.arange(5.0), velocity)
    first, second = caught.value.faults
    assert "`u` must be at most 50 m/s in size; it is -51.5 in row 3, the first of 2" in first
    assert "NaN" in first
    assert "deg/s" not in first
    assert "`r` must be at most 50 rad/s in size; it is 200 in row 2" in second
    assert "in deg/s, convert them" in second
    with pytest.raises(
        LogError, match=r"`u` must be at most 50 m/s in size; it is -51\.5 in row 3"
    ):
        Log(time=np.arange(5.0), velocity=velocity)


def slopes_of(time: np.ndarray, attitude: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return the slopes over one segment."""
    bounds = np.array([[0, len(time)]])
    turns = turned(attitude, bounds)
    each = [agreement(time, bounds, rates[:, [k]], turns[:, [k]]) for k in range(3)]
    return np.array([one.ratio if one.agrees() else np.nan for one in each])


def test_a_few_stray_attitudes_do_not_hide_it() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    yaw = np.column_stack((0 * time, 0 * time, np.sin(0.5 * time)))
    yaw[::100, 2] += 3.0
    rates = np.column_stack((0 * time, 0 * time, 0.5 * np.cos(0.5 * time)))
    slope = slopes_of(time, quaternion_from_euler(yaw), rates)[2]
    assert slope == pytest.approx(1, rel=0.01)


def test_no_motion_unrelated_motion_and_few_samples_say_nothing() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.1)
    still = np.tile([1.0, 0, 0, 0], (200, 1))
    unrelated = quaternion_from_euler(rng.normal(size=(200, 3)))
    for attitude in (still, unrelated):
        assert np.isnan(slopes_of(time, attitude, rng.normal(size=(200, 3)))).all()
    few = tumble(1.0, 1, n=5)
    assert np.isnan(slopes_of(*few)).all()
    assert np.isnan(slopes_of(*(part[:1] for part in few))).all()

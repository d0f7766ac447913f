from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from hydrodamp.data.attitude import (
    angle_ratio,
    path_ratios,
    quaternion_from_euler,
    rate_slopes,
    rotation,
)


def tumble(rate: float, seed: int, n: int = 300) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an irregular clock, the attitude and the rates of a steady tumble."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.05, 0.2, n))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    half = rate * time[:, np.newaxis] / 2
    attitude = np.concatenate((np.cos(half), np.sin(half) * axis), axis=1)
    return time, attitude, np.tile(rate * axis, (n, 1))


def slopes_of(time: np.ndarray, attitude: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Return the slopes over one segment."""
    return rate_slopes(time, attitude, rates, np.array([[0, len(time)]]))


@given(st.floats(0.05, 3.0), st.integers(0, 99))
def test_a_tumbling_vehicle_has_slope_one(rate: float, seed: int) -> None:
    time, attitude, rates = tumble(rate, seed)
    slopes = slopes_of(time, attitude, rates)
    np.testing.assert_allclose(slopes[np.isfinite(slopes)], 1, rtol=1e-6)


def test_a_few_stray_attitudes_do_not_hide_it() -> None:
    time = np.arange(0.0, 60.0, 0.1)
    yaw = np.column_stack((0 * time, 0 * time, np.sin(0.5 * time)))
    yaw[::100, 2] += 3.0
    rates = np.column_stack((0 * time, 0 * time, 0.5 * np.cos(0.5 * time)))
    slope = slopes_of(time, quaternion_from_euler(yaw), rates)[2]
    assert slope == pytest.approx(1, rel=0.01)


def test_a_flipped_sign_shows() -> None:
    time, attitude, rates = tumble(0.5, 7)
    np.testing.assert_allclose(slopes_of(time, attitude, -rates), -1, rtol=1e-6)


def test_rates_without_motion_say_nothing() -> None:
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 20.0, 0.1)
    still = np.tile([1.0, 0, 0, 0], (200, 1))
    assert np.isnan(slopes_of(time, still, rng.normal(size=(200, 3)))).all()
    unrelated = quaternion_from_euler(rng.normal(size=(200, 3)))
    assert np.isnan(slopes_of(time, unrelated, rng.normal(size=(200, 3)))).all()


def test_too_few_samples_say_nothing() -> None:
    time, attitude, rates = tumble(1.0, 1, n=5)
    assert np.isnan(slopes_of(time, attitude, rates)).all()
    assert np.isnan(slopes_of(time[:1], attitude[:1], rates[:1])).all()


def test_attitude_is_not_differenced_across_a_break() -> None:
    time, attitude, rates = tumble(0.5, 7)
    joined = np.concatenate((time[:150], time[:150])), attitude.copy()
    joined[1][150:] = joined[1][:150]
    slopes = rate_slopes(joined[0], joined[1], rates, np.array([[0, 150], [150, 300]]))
    np.testing.assert_allclose(slopes, 1, rtol=1e-6)


def circling(n: int = 1200) -> tuple[np.ndarray, ...]:
    """Return the time, velocity, attitude and position of a vehicle that circles without drift."""
    time = np.arange(n) / 10
    yaw = 0.2 * time + 0.3 * np.sin(0.5 * time)
    attitude = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    velocity = np.zeros((n, 6))
    velocity[:, 0] = 1.5 + 0.1 * np.sin(time)
    world = np.einsum("nij,nj->ni", rotation(attitude), velocity[:, :3])
    return time, velocity, attitude, np.cumsum(world, axis=0) / 10


def test_angles_that_are_unrelated_to_rates_have_no_ratio() -> None:
    rng, time, whole = np.random.default_rng(0), np.arange(1200) / 10, np.array([[0, 1200]])
    assert np.isnan(angle_ratio(time, rng.normal(size=1200), rng.normal(size=1200), whole))
    assert np.isnan(angle_ratio(time, 0 * time, 0 * time, whole))
    angle = np.sin(time)
    assert angle_ratio(time, 3 * angle, np.cos(time), whole) == pytest.approx(3.0, rel=1e-3)


def test_a_velocity_that_is_zero_has_no_ratio_of_its_own() -> None:
    whole, each = path_ratios(*circling(), np.array([[0, 1200]]))
    assert whole == pytest.approx(1.0, abs=0.01)
    assert each[0] == pytest.approx(1.0, abs=0.01)
    assert np.isnan(each[1:]).all()


def test_no_path_is_taken_across_a_join() -> None:
    time, velocity, attitude, position = circling()
    position[600:] += 500.0
    bounds = np.array([[0, 600], [600, 1200]])
    assert path_ratios(time, velocity, attitude, position, bounds)[0] == pytest.approx(1, abs=0.01)

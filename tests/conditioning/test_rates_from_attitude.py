from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hydrodamp.conditioning.derived import rates_from_attitude
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError


def body_rates(euler: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """Oracle: the kinematics of Euler angles (Fossen 2021, equation 2.39)."""
    (roll, pitch, _), (droll, dpitch, dyaw) = euler.T, slopes.T
    return np.column_stack(
        (
            droll - dyaw * np.sin(pitch),
            dpitch * np.cos(roll) + dyaw * np.cos(pitch) * np.sin(roll),
            -dpitch * np.sin(roll) + dyaw * np.cos(pitch) * np.cos(roll),
        )
    )


def motion(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rolling over and over while pitching and yawing."""
    euler = np.column_stack((0.9 * time, 0.6 * np.sin(0.8 * time), 2 * np.sin(0.3 * time)))
    slopes = np.column_stack((0.9 + 0 * time, 0.48 * np.cos(0.8 * time), 0.6 * np.cos(0.3 * time)))
    return quaternion_from_euler(euler), body_rates(euler, slopes)


@pytest.mark.parametrize("irregular", [False, True])
def test_a_tumbling_vehicle(irregular: bool) -> None:
    rng = np.random.default_rng(1)
    steps = rng.uniform(0.02, 0.08, 600) if irregular else np.full(600, 0.05)
    time = np.cumsum(steps)
    attitude, rates = motion(time)
    signs = rng.choice([-1.0, 1.0], size=(600, 1))
    log = Log.from_arrays(time, {"u": np.ones(600)}, attitude=signs * attitude)
    made = rates_from_attitude(log, seconds=0.2)
    assert made.velocity_names == ("u", "p", "q", "r")
    np.testing.assert_allclose(made.velocity[3:-3, 3:], rates[3:-3], atol=5e-3)
    assert made.notes == ("derived: `p q r` from attitude, by local quadratics over 5 samples",)


def test_noise_is_smoothed_away() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(0, 60, 0.1)
    yaw = 0.5 * np.sin(0.5 * time) + 5e-3 * rng.normal(size=600)
    log = Log.from_arrays(time, {"u": np.ones(600)}, attitude=np.outer(yaw, (0, 0, 1)))
    made = rates_from_attitude(log)
    true = 0.25 * np.cos(0.5 * time)
    differences = np.gradient(yaw, time)
    error = np.std(made.velocity[:, 5] - true)
    assert made.velocity_names == ("u", "r")
    assert error < 0.35 * np.std(differences - true)


def test_what_is_recorded_stays_unless_named() -> None:
    time = np.arange(0, 10, 0.1)
    attitude, _ = motion(time)
    recorded = {"p": 7 + 0 * time, "q": 0 * time, "r": 0 * time}
    log = Log.from_arrays(time, recorded, attitude=attitude[:, [0, 1, 2, 3]])
    assert rates_from_attitude(log) is log
    made = rates_from_attitude(log, ["q"])
    assert (made.velocity[:, 3] == 7).all()
    assert np.ptp(made.velocity[:, 4]) > 0.1


def test_recorded_accelerations_do_not_outlive_their_velocities() -> None:
    time = np.arange(0, 10, 0.1)
    attitude, _ = motion(time)
    log = Log.from_arrays(time, {"u": time}, attitude=attitude, acceleration=np.ones((100, 6)))
    made = rates_from_attitude(log)
    assert made.acceleration is None
    assert "left out: recorded accelerations, which `p q r` lack" in made.notes


def test_no_attitude_and_no_such_rate() -> None:
    log = Log(time=[0.0, 1.0], velocity=np.ones((2, 6)))
    with pytest.raises(LogError, match="no attitude to derive rates from"):
        rates_from_attitude(log)
    with_attitude = dataclasses.replace(log, attitude=[[1, 0, 0, 0]] * 2)
    with pytest.raises(LogError, match="'u' cannot be derived here; it takes p q r"):
        rates_from_attitude(with_attitude, ["u", "r"])

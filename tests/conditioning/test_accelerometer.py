from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hydrodamp.conditioning.derived import GRAVITY, acceleration_from_accelerometer
from hydrodamp.data.attitude import quaternion_from_euler, rotation
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

STEP = 1e-3


def swinging(arm: tuple[float, float, float]) -> tuple[Log, np.ndarray]:
    """A vehicle that moves on every axis, an accelerometer aside, and the true derivative.

    Oracle: the position of the accelerometer differenced twice, gravity taken off.
    """
    time = np.arange(0.0, 6.0, STEP)
    euler = np.column_stack(
        (0.4 * np.sin(1.1 * time), 0.3 * np.sin(0.7 * time), 0.8 * np.sin(0.5 * time))
    )
    place = np.column_stack((np.sin(0.9 * time), 0.5 * np.cos(time), 0.3 * np.sin(0.6 * time)))
    attitude = quaternion_from_euler(euler)
    turned = rotation(attitude)
    sensor = place + turned @ np.array(arm)
    falling = np.gradient(np.gradient(sensor, STEP, axis=0), STEP, axis=0)
    force = np.einsum("nji,nj->ni", turned, falling - (0, 0, GRAVITY))
    speed = np.einsum("nji,nj->ni", turned, np.gradient(place, STEP, axis=0))
    wheel = np.einsum("nji,njk->nik", turned, np.gradient(turned, STEP, axis=0))
    rates = np.column_stack((wheel[:, 2, 1], wheel[:, 0, 2], wheel[:, 1, 0]))
    velocity = np.column_stack((speed, rates))
    true = np.gradient(velocity, STEP, axis=0)
    rows = slice(10, -10, 20)
    log = Log(
        time=time[rows],
        velocity=velocity[rows],
        attitude=attitude[rows],
        specific_force=force[rows],
        segments=(),
    )
    return log, true[rows]


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (0.6, -0.2, 0.1)])
def test_equation_1_gives_the_derivative_at_the_reference_point(arm) -> None:
    log, true = swinging(arm)
    made = acceleration_from_accelerometer(log, arm, seconds=0.1)
    assert made.acceleration is not None
    np.testing.assert_allclose(made.acceleration[5:-5], true[5:-5], atol=2e-3)


def test_a_lever_arm_left_out_shows() -> None:
    arm = (0.6, -0.2, 0.1)
    log, true = swinging(arm)
    without = acceleration_from_accelerometer(log, seconds=0.1).acceleration
    assert np.abs(without[5:-5, :3] - true[5:-5, :3]).max() > 0.05


def test_velocities_that_were_not_recorded_get_none() -> None:
    log, _ = swinging((0.0, 0.0, 0.0))
    planar = Log.from_arrays(
        log.time,
        {name: log.velocity[:, "uvwpqr".index(name)] for name in "uvr"},
        attitude=log.attitude,
        specific_force=log.specific_force,
    )
    made = acceleration_from_accelerometer(planar)
    assert (made.acceleration[:, 2:5] == 0).all()
    assert made.acceleration[:, [0, 1, 5]].any()
    assert made.notes[0].startswith("derived: accelerations from an accelerometer at (0, 0, 0) m")


def test_what_is_lacking_or_wrong_is_named() -> None:
    log, _ = swinging((0.0, 0.0, 0.0))
    with pytest.raises(LogError, match="there is no specific force"):
        acceleration_from_accelerometer(dataclasses.replace(log, specific_force=None))
    with pytest.raises(LogError, match="there is no attitude"):
        acceleration_from_accelerometer(dataclasses.replace(log, attitude=None))
    for arm in ((1, 2), "abc", (1, 2, np.nan)):
        with pytest.raises(LogError, match="`lever_arm` must be three numbers"):
            acceleration_from_accelerometer(log, arm)

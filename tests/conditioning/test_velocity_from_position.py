from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from hydrodamp.conditioning.derived import velocity_from_position
from hydrodamp.data.attitude import quaternion_from_euler, rotation
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError


def helix(seed: int | None = None) -> tuple[Log, np.ndarray]:
    """A climbing turn; returns what a sensor would have measured too."""
    steps = (
        np.full(500, 0.1) if seed is None else np.random.default_rng(seed).uniform(0.05, 0.15, 500)
    )
    time = np.cumsum(steps)
    euler = np.column_stack((0.2 * np.sin(time), -0.3 + 0 * time, 0.25 * time))
    attitude = quaternion_from_euler(euler)
    place = np.column_stack((4 * np.sin(0.25 * time), -4 * np.cos(0.25 * time), -0.2 * time))
    speed = np.column_stack((np.cos(0.25 * time), np.sin(0.25 * time), -0.2 + 0 * time))
    body = np.einsum("nji,nj->ni", rotation(attitude), speed)
    log = Log.from_arrays(time, {"r": 0 * time}, attitude=attitude, position=place)
    return log, body


@pytest.mark.parametrize("seed", [None, 1])
def test_the_way_made_is_found_in_body_axes(seed: int | None) -> None:
    log, body = helix(seed)
    made = velocity_from_position(log, seconds=0.5)
    assert made.velocity_names == ("u", "v", "w", "r")
    np.testing.assert_allclose(made.velocity[:, :3], body, atol=3e-3)
    np.testing.assert_array_equal(made.velocity[:, 3:], log.velocity[:, 3:])
    assert made.notes[-1].startswith("derived: `u v w` over ground from position")


def test_speed_does_not_depend_on_where_the_vehicle_points() -> None:
    log, body = helix()
    other = quaternion_from_euler(np.random.default_rng(2).uniform(-3, 3, (500, 3)))
    turned = velocity_from_position(dataclasses.replace(log, attitude=other), seconds=0.5)
    speed = np.linalg.norm(turned.velocity[:, :3], axis=1)
    np.testing.assert_allclose(speed, np.linalg.norm(body, axis=1), atol=3e-3)


def test_a_planar_log_gets_no_heave() -> None:
    log, _ = helix()
    flat = dataclasses.replace(log, position=log.position * (1, 1, 0))
    made = velocity_from_position(flat)
    assert made.velocity_names == ("u", "v", "r")
    assert velocity_from_position(made) is made


def test_what_is_lacking_is_named() -> None:
    log, _ = helix()
    with pytest.raises(LogError, match="there is no position"):
        velocity_from_position(dataclasses.replace(log, position=None))
    with pytest.raises(LogError, match="there is no attitude"):
        velocity_from_position(dataclasses.replace(log, attitude=None))
    with pytest.raises(LogError, match="'p' cannot be derived"):
        velocity_from_position(log, ["p"])

"""Axes of a log turned into ours: body forward-starboard-down, world north-east-down."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.attitude import quaternion_from_euler, rotation

_ROOT = math.sqrt(0.5)


class Mounting(NamedTuple):
    """How a sensor sits in the vehicle: its axes, roll pitch yaw [rad], its position [m]."""

    axes: str = "FRD"
    angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def quaternion(self) -> FloatArray:
        """What turns sensor components into body components, shape (4,)."""
        turned: FloatArray = quaternion_from_euler(np.array([self.angles]))[0]
        return turned

    @property
    def rotation(self) -> FloatArray:
        """The same as a matrix, shape (3, 3)."""
        turned: FloatArray = rotation(self.quaternion[np.newaxis])[0]
        return turned


def vector_sign(index: int, axes: str) -> float:
    """Return the sign that turns a component along or about an axis into ours."""
    return -1.0 if axes == "FLU" and index else 1.0


def euler_angle(name: str, angle: FloatArray, world: str) -> FloatArray:
    """Return an Euler angle against north-east-down."""
    if world == "NED" or name in ("roll", "heading"):
        return angle
    if name == "yaw" and world == "ENU":
        return math.pi / 2 - angle
    return -angle


def quaternion_in_ned(quaternion: FloatArray, world: str) -> FloatArray:
    """Return attitudes as rotations from forward-starboard-down to north-east-down."""
    if world == "NED":
        return quaternion
    flipped = quaternion * (1.0, 1.0, -1.0, -1.0)
    # North-west-up is east-north-up turned by a quarter about the vertical, which points down now.
    return product(np.array([_ROOT, 0.0, 0.0, _ROOT]), flipped) if world == "ENU" else flipped


def product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the rotation by the second quaternion, then by the first."""
    a, b, c, d = np.moveaxis(first, -1, 0)
    w, x, y, z = np.moveaxis(second, -1, 0)
    return np.stack(
        (
            a * w - b * x - c * y - d * z,
            a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x,
            a * z + b * y - c * x + d * w,
        ),
        axis=-1,
    )


def unmounted(attitude: FloatArray, mounting: Mounting) -> FloatArray:
    """Return the attitude of the body from that of a sensor turned in it."""
    return product(attitude, mounting.quaternion * (1.0, -1.0, -1.0, -1.0))


def into_body(attitude: FloatArray, world: Sequence[FloatArray]) -> FloatArray:
    """Return vectors of the world in body components."""
    body: FloatArray = np.einsum("nji,jn->ni", rotation(attitude), np.array(world))
    return body


def at_reference(velocity: FloatArray, rates: FloatArray, position: Sequence[float]) -> FloatArray:
    """Return the velocity of the reference point from that of a sensor elsewhere."""
    moved: FloatArray = velocity - np.cross(rates, np.asarray(position))
    return moved

"""Attitude as unit quaternions and Euler angles, and the turn from one to another."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray

_UNIT = 1e-12  # how far the norm of a unit quaternion may be off one


def quaternion_from_euler(euler: FloatArray) -> FloatArray:
    """Return the unit quaternions of roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(euler.T / 2), np.sin(euler.T / 2)
    parts = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return np.stack(parts, axis=-1)


def euler_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw of unit quaternions."""
    w, x, y, z = quaternion.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack((roll, pitch, yaw), axis=-1)


def normalised(quaternion: FloatArray) -> FloatArray:
    """Return quaternions with norm 1; those that have it already are kept to the bit."""
    norm = np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.where(np.abs(norm - 1) > _UNIT, quaternion / norm, quaternion)


def rotation(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices of unit quaternions."""
    w, x, y, z = quaternion.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def down(quaternion: FloatArray) -> FloatArray:
    """Return the world's downward direction in body components, R^T e3."""
    w, x, y, z = quaternion.T
    return np.stack(
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        axis=-1,
    )


def turn(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the rotation vectors that carry one attitude into another."""
    w1, v1 = first[:, :1], first[:, 1:]
    w2, v2 = second[:, :1], second[:, 1:]
    scalar = w1 * w2 + np.sum(v1 * v2, axis=1, keepdims=True)
    vector = w1 * v2 - w2 * v1 - np.cross(v1, v2)
    vector = np.where(scalar < 0, -vector, vector)
    sine = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, np.abs(scalar))
    scale = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0)
    turned: FloatArray = vector * scale
    return turned

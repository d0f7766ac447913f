"""Attitude: unit quaternions, Euler angles, rotation matrices and vectors."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray


def quaternion_from_euler(euler: FloatArray) -> FloatArray:
    """Return the unit quaternions of roll, pitch and yaw."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(euler.T / 2), np.sin(euler.T / 2)
    components = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return np.stack(components, axis=-1)


def euler_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw of unit quaternions."""
    matrices = rotation_matrices(quaternion)
    (north, _, _), (east, _, _), (down_x, down_y, down_z) = np.moveaxis(matrices, 0, -1)
    pitch = np.arcsin(np.clip(-down_x, -1, 1))
    return np.stack((np.arctan2(down_y, down_z), pitch, np.arctan2(east, north)), axis=-1)


def rotation_matrices(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices of unit quaternions."""
    w, x, y, z = quaternion.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def rotate_to_body(quaternion: FloatArray, world: FloatArray) -> FloatArray:
    """Rotate world vectors to body axes; vectors of two components are horizontal."""
    rows = rotation_matrices(quaternion)[:, : world.shape[1]]
    return np.asarray(np.einsum("nij,ni->nj", rows, world))


def quaternion_product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the Hamilton product: the rotation by the second quaternion, then by the first."""
    w, v = first[..., :1], first[..., 1:]
    scalar, vector = second[..., :1], second[..., 1:]
    real = w * scalar - np.sum(v * vector, axis=-1, keepdims=True)
    return np.concatenate((real, w * vector + scalar * v + np.cross(v, vector)), axis=-1)


def down_vectors(quaternion: FloatArray) -> FloatArray:
    """Return the down vector in body axes, R^T e3."""
    w, x, y, z = quaternion.T
    return np.array((2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))).T


def rotation_vectors(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the rotation vectors from one attitude to another [rad]."""
    difference = quaternion_product(first * (1.0, -1.0, -1.0, -1.0), second)
    scalar, vector = difference[:, :1], difference[:, 1:]
    vector = np.where(scalar < 0, -vector, vector)
    sine = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, np.abs(scalar))
    scale = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return np.asarray(vector * scale)


MIN_SINE = 1e-6  # rad; below it sin(x) = x to double precision


def slerp(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """Return attitudes interpolated along the shorter rotation (spherical linear interpolation)."""
    cosine = np.einsum("ni,ni->n", first, second)
    angle = np.arccos(np.minimum(np.abs(cosine), 1.0))
    sine = np.sin(angle)
    close = sine < MIN_SINE  # nearly equal: linear interpolation
    sine[close] = 1.0
    near = np.where(close, 1 - share, np.sin((1 - share) * angle) / sine)
    far = np.where(close, share, np.sin(share * angle) / sine) * np.where(cosine < 0, -1.0, 1.0)
    return np.asarray(first * near[:, np.newaxis] + second * far[:, np.newaxis])


def find_slopes(values: FloatArray, time: FloatArray, bounds: IntArray) -> FloatArray:
    """Return the slopes of columns by parabolas through three samples of a segment."""
    slopes = np.zeros_like(values)
    for start, stop in bounds.tolist():
        if (length := stop - start) > 1:
            series = values[start:stop], time[start:stop]
            slopes[start:stop] = np.gradient(*series, axis=0, edge_order=min(length - 1, 2))
    return slopes

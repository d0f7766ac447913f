"""Attitude as unit quaternions and Euler angles, and the body rates between two attitudes.

A quaternion is ``(w, x, y, z)`` and rotates body components (x forward, y
starboard, z down) into the world (north, east, down). Euler angles are roll,
pitch, yaw in the order yaw, pitch, roll (z, y', x'').
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray


def quaternion_from_euler(euler: FloatArray) -> FloatArray:
    """Return the unit quaternions of roll, pitch and yaw.

    Parameters
    ----------
    euler : ndarray, shape (n, 3)
        Roll, pitch, yaw [rad]; angles may wrap or run on.

    Returns
    -------
    quaternion : ndarray, shape (n, 4)
        ``(w, x, y, z)``, body to north-east-down.

    Examples
    --------
    >>> quaternion_from_euler(np.array([[0.0, 0.0, np.pi]])).round(12).tolist()
    [[0.0, 0.0, 0.0, 1.0]]
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(euler.T / 2), np.sin(euler.T / 2)
    parts = (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
    return np.stack(parts, axis=-1)


def euler_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return roll, pitch and yaw of unit quaternions.

    Parameters
    ----------
    quaternion : ndarray, shape (n, 4)
        ``(w, x, y, z)``, body to north-east-down.

    Returns
    -------
    euler : ndarray, shape (n, 3)
        Roll and yaw in -pi..pi, pitch in -pi/2..pi/2 [rad].

    Examples
    --------
    >>> euler_from_quaternion(np.array([[0.0, 1.0, 0.0, 0.0]])).round(6).tolist()
    [[3.141593, 0.0, 0.0]]
    """
    w, x, y, z = quaternion.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1, 1))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return np.stack((roll, pitch, yaw), axis=-1)


def rotation(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices of unit quaternions.

    Parameters
    ----------
    quaternion : ndarray, shape (n, 4)
        ``(w, x, y, z)``, body to north-east-down.

    Returns
    -------
    rotation : ndarray, shape (n, 3, 3)
        R of the paper: world components are ``R @ body``.

    Examples
    --------
    >>> rotation(np.array([[1.0, 0.0, 0.0, 0.0]]))[0].tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    """
    w, x, y, z = quaternion.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def down(quaternion: FloatArray) -> FloatArray:
    """Return the world's downward direction in body components, R^T e3.

    Parameters
    ----------
    quaternion : ndarray, shape (n, 4)
        ``(w, x, y, z)``, body to north-east-down.

    Returns
    -------
    down : ndarray, shape (n, 3)
        Unit vectors; (0, 0, 1) when level.

    Examples
    --------
    >>> down(np.array([[1.0, 0.0, 0.0, 0.0]])).tolist()
    [[0.0, 0.0, 1.0]]
    """
    w, x, y, z = quaternion.T
    return np.stack(
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        axis=-1,
    )


def turn(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the rotation vectors that carry one attitude into another.

    Parameters
    ----------
    first, second : ndarray, shape (n, 4)
        Unit quaternions, body to north-east-down.

    Returns
    -------
    turn : ndarray, shape (n, 3)
        The shorter turn from first to second about body axes [rad], whatever
        the signs of the quaternions and wherever angles wrapped.

    Examples
    --------
    >>> q = quaternion_from_euler(np.array([[0.0, 0.0, 3.1], [0.0, 0.0, -3.1]]))
    >>> turn(q[:1], q[1:])[0, 2].round(6).item()
    0.083185
    """
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


def body_rates(time: FloatArray, attitude: FloatArray) -> FloatArray:
    """Return the mean body rate of every step, from attitude alone.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Sample times, increasing [s].
    attitude : ndarray, shape (n, 4)
        Unit quaternions, body to north-east-down.

    Returns
    -------
    rates : ndarray, shape (n - 1, 3)
        Roll, pitch and yaw rate p q r of each step [rad/s], exact where the
        rate is constant over the step and turns it by less than pi.

    Examples
    --------
    >>> q = quaternion_from_euler(np.array([[0.0, 0.1, 0.0], [0.0, 0.3, 0.0]]))
    >>> body_rates(np.array([0.0, 0.5]), q).round(12).tolist()
    [[0.0, 0.4, 0.0]]
    """
    return turn(attitude[:-1], attitude[1:]) / np.diff(time)[:, np.newaxis]

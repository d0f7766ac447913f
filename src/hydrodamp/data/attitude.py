"""Attitude as quaternions and Euler angles, and how well other channels agree with it."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray


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
    turned = rotation(quaternion)
    (north, _, _), (east, _, _), (down_x, down_y, down_z) = np.moveaxis(turned, 0, -1)
    pitch = np.arcsin(np.clip(-down_x, -1, 1))
    return np.stack((np.arctan2(down_y, down_z), pitch, np.arctan2(east, north)), axis=-1)


def rotation(quaternion: FloatArray) -> FloatArray:
    """Return the rotation matrices of unit quaternions."""
    w, x, y, z = quaternion.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def in_body(quaternion: FloatArray, world: FloatArray) -> FloatArray:
    """Return vectors of the world in body components; those of two components are horizontal."""
    rows = rotation(quaternion)[:, : world.shape[1]]
    return np.asarray(np.einsum("nij,ni->nj", rows, world))


def product(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the rotation by the second quaternion, then by the first."""
    w, v = first[..., :1], first[..., 1:]
    scalar, vector = second[..., :1], second[..., 1:]
    real = w * scalar - np.sum(v * vector, axis=-1, keepdims=True)
    return np.concatenate((real, w * vector + scalar * v + np.cross(v, vector)), axis=-1)


def down(quaternion: FloatArray) -> FloatArray:
    """Return the world's downward direction in body components, R^T e3."""
    return rotation(quaternion)[:, 2]


def turn(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the rotation vectors that carry one attitude into another."""
    apart = product(first * (1.0, -1.0, -1.0, -1.0), second)
    scalar, vector = apart[:, :1], apart[:, 1:]
    vector = np.where(scalar < 0, -vector, vector)
    sine = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2 * np.arctan2(sine, np.abs(scalar))
    scale = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=sine > 0)
    return np.asarray(vector * scale)


_CLOSE = 1e-6  # rad; below it sines are angles to all digits
_RATE_WINDOW = 0.5  # s, over which attitude is differenced: longer than its noise
_PATH_WINDOW = 5.0  # s, over which paths are compared: long against the noise of a position
_LEAST_PAIRS = 8
_LEAST_RATE = 1e-3  # rad/s; below it an axis says nothing
_LEAST_SHARE = 0.7  # of the motion that has one sign in both; 0.5 is what unrelated signs reach
_LEAST_CORRELATION = 0.8  # below it two channels do not measure the same motion
_LEAST_PART = 1e-4  # of the path, that a velocity must have; one in km/s beside others in m/s has
_TINY = 1e-9  # of any unit; less is no motion


def between(first: FloatArray, second: FloatArray, share: FloatArray) -> FloatArray:
    """Return attitudes a share of the shorter turn from one to another."""
    cosine = np.einsum("ni,ni->n", first, second)
    angle = np.arccos(np.minimum(np.abs(cosine), 1.0))
    sine = np.sin(angle)
    close = sine < _CLOSE  # both are nearly the same: the turn is a straight line
    sine[close] = 1.0
    near = np.where(close, 1 - share, np.sin((1 - share) * angle) / sine)
    far = np.where(close, share, np.sin(share * angle) / sine) * np.where(cosine < 0, -1.0, 1.0)
    return np.asarray(first * near[:, np.newaxis] + second * far[:, np.newaxis])


def rate_slopes(
    time: FloatArray, attitude: FloatArray, rates: FloatArray, bounds: IntArray
) -> FloatArray:
    """Return recorded body rates over the rates of the attitude, axis by axis; NaN if unknown."""
    first, last = pairs(time, bounds, _RATE_WINDOW)
    if len(first) < _LEAST_PAIRS:
        return np.full(3, np.nan)
    span = (time[last] - time[first])[:, np.newaxis]
    differenced = turn(attitude[first], attitude[last]) / span
    area = integral(time, rates)
    recorded = (area[last] - area[first]) / span
    return np.array([_slope(x, y) for x, y in zip(differenced.T, recorded.T, strict=True)])


def angle_ratio(time: FloatArray, angle: FloatArray, rate: FloatArray, bounds: IntArray) -> float:
    """Return how many times faster an angle turns than a recorded rate says."""
    inner = np.ones(len(time) - 1, dtype=np.bool_)
    inner[bounds[1:, 0] - 1] = False
    steps = np.diff(angle)[inner]
    wrapped = steps - 2 * np.pi * np.round(steps / (2 * np.pi))
    return _ratio(wrapped / np.diff(time)[inner], ((rate[1:] + rate[:-1]) / 2)[inner])


def path_ratios(
    time: FloatArray,
    velocity: FloatArray,
    attitude: FloatArray,
    position: FloatArray,
    bounds: IntArray,
) -> FloatArray:
    """Return how many times longer the path of each of u v w is than its part of the position's."""
    first, last = pairs(time, bounds, _PATH_WINDOW)
    area = integral(time, (rotation(attitude) * velocity[:, np.newaxis, :3]).reshape(-1, 9))
    made = (area[last] - area[first]).reshape(-1, 3, 3)  # world axes, then u v w
    gone = (position[last] - position[first]).ravel()
    parts = made.reshape(-1, 3)
    sizes = np.linalg.norm(parts, axis=0)
    there = np.flatnonzero(sizes > _LEAST_PART * np.linalg.norm(sizes))
    shares = np.zeros(3)
    shares[there] = np.linalg.lstsq(parts[:, there] / sizes[there], gone)[0] / sizes[there]
    each = np.full(3, np.nan)
    for axis in there.tolist():
        rest = gone - parts @ shares + parts[:, axis] * shares[axis]
        each[axis] = _ratio(parts[:, axis], rest)
    return each


def pairs(time: FloatArray, bounds: IntArray, seconds: float) -> tuple[IntArray, IntArray]:
    """Return pairs of samples about some seconds apart, both in one segment."""
    firsts, lasts = [bounds[:0, 0]], [bounds[:0, 0]]
    for start, stop in bounds.tolist():
        part = time[start:stop]
        first = np.arange(stop - start)
        last = np.minimum(np.searchsorted(part, part + seconds), stop - start - 1)
        far = part[last] - part >= seconds / 2  # the end of a segment leaves less
        firsts.append(first[far] + start)
        lasts.append(last[far] + start)
    return np.concatenate(firsts), np.concatenate(lasts)


def integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the running trapezoidal integral of columns."""
    strips = np.diff(time)[:, np.newaxis] * (values[1:] + values[:-1]) / 2
    return np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(strips, axis=0)))


def _slope(differenced: FloatArray, recorded: FloatArray) -> float:
    """Return the slope that least absolute deviations give."""
    weight = np.abs(differenced)
    if weight.mean() < _LEAST_RATE:
        return float("nan")
    along = np.sign(differenced * recorded)
    if max(weight[along > 0].sum(), weight[along < 0].sum()) < _LEAST_SHARE * weight.sum():
        return float("nan")
    turning = weight > 0
    with np.errstate(over="ignore"):  # beside hardly any rate
        ratio, weight = recorded[turning] / differenced[turning], weight[turning]
    order = np.argsort(ratio)
    middle = np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)
    return float(ratio[order[middle]])


def _ratio(first: FloatArray, second: FloatArray) -> float:
    """Return the size of one against another, with the sign of their correlation."""
    one, other = float(np.linalg.norm(first)), float(np.linalg.norm(second))
    if len(first) < _LEAST_PAIRS or min(one, other) < _TINY:
        return float("nan")
    correlation = float((first / one) @ (second / other))
    far = abs(correlation) <= _LEAST_CORRELATION
    return float("nan") if far else float(np.sign(correlation)) * one / other

"""Regression of an integrated rate channel on the increments of the channel it is the rate of.

Over windows of length T: ∫ rate dt = scale (x(t+T) - x(t)). The scale is the ratio of RMS values
with the sign of the correlation; the 3 % worst pairs are trimmed (outliers, wraps).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import rotation_matrices, rotation_vectors
from hydrodamp.data.time_scale import motion_time_scale

_RELATIVE_WINDOW, _MIN_WINDOW_STEPS = 0.2, 10  # correlation times, median steps: shortest window
_WINDOW_FACTORS = (1, 4, 16)
_MIN_WINDOWS = 8  # windows in a log; fewer agree by chance
_MIN_PAIRS = 20
_MIN_CORRELATION = 0.8
_MAX_RESIDUAL_SHARE = 0.25  # of the unexplained variance of the alternative
_MAX_PAIRS = 50_000  # pairs; more are decimated
_INLIER_SHARE = 0.97  # of the pairs
_MIN_MOTION = 1e-9  # of any unit; less is no motion


class ChannelRegression(NamedTuple):
    """Scale and correlation of an integrated rate on increments of its reference channel."""

    scale: float  # RMS of integrals over RMS of increments, with the sign of the correlation
    correlation: float
    rms_increment: float = 0.0  # RMS of the increments
    window_s: float = 0.0  # length of the windows [s]

    def is_consistent(self) -> bool:
        """Return whether both channels measure the same motion, of either sign."""
        return abs(self.correlation) >= _MIN_CORRELATION

    def explains_more_than(self, other: ChannelRegression) -> bool:
        """Return whether this regression explains far more variance than another."""
        correlation, alternative = np.nan_to_num((self.correlation, other.correlation)).tolist()
        is_better = self.correlation > max(_MIN_CORRELATION, alternative)
        unexplained = _MAX_RESIDUAL_SHARE * (1.0 - alternative**2)
        return bool(is_better and (1.0 - correlation**2 < unexplained or alternative < 0.0))


#: Result for channels that cannot be compared.
NO_REGRESSION = ChannelRegression(float("nan"), float("nan"))


def integrate_rotation(attitude: FloatArray, bounds: IntArray) -> FloatArray:
    """Return cumulative rotations about body axes [rad], from the start of each segment."""
    return _cumulate(rotation_vectors(attitude[:-1], attitude[1:]), bounds)


def integrate_displacement(
    attitude: FloatArray, position: FloatArray, bounds: IntArray
) -> FloatArray:
    """Return cumulative displacements along body axes [m], from the start of each segment."""
    axes, moves = rotation_matrices(attitude), np.diff(position, axis=0)
    return _cumulate(np.einsum("nij,ni->nj", (axes[1:] + axes[:-1]) / 2, moves), bounds)


def _cumulate(steps: FloatArray, bounds: IntArray) -> FloatArray:
    increments = np.concatenate((np.zeros((1, 3)), steps))
    increments[bounds[:, 0]] = 0.0
    increments[~np.isfinite(increments).all(axis=1)] = 0.0
    return np.asarray(np.cumsum(increments, axis=0))


def cumulative_integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the cumulative trapezoidal integral of columns."""
    strips = np.diff(time)[:, np.newaxis] * (values[1:] + values[:-1]) / 2
    return np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(strips, axis=0)))


def regress_channel(
    time: FloatArray, bounds: IntArray, rate: FloatArray, value: FloatArray
) -> ChannelRegression:
    """Regress over the window length of highest correlation; if none is consistent, the longest."""
    steps = np.concatenate([np.diff(time[:0]), *(np.diff(time[a:b]) for a, b in bounds.tolist())])
    if not len(steps):
        return NO_REGRESSION
    time_scale = motion_time_scale(time, rate, bounds)
    shortest = max(_RELATIVE_WINDOW * time_scale, _MIN_WINDOW_STEPS * float(np.median(steps)))
    spans = [factor * shortest for factor in _WINDOW_FACTORS]
    moving = []
    for span in [span for span in spans if span * _MIN_WINDOWS < steps.sum()] or [shortest]:
        result = regress_increments(*window_increments(time, bounds, rate, value, span))
        if result.rms_increment > 0.0:
            moving.append(result._replace(window_s=span))
    best = max(moving, key=lambda result: abs(result.correlation), default=NO_REGRESSION)
    return best if best.is_consistent() else (moving or [NO_REGRESSION])[-1]


def window_increments(
    time: FloatArray, bounds: IntArray, rate: FloatArray, value: FloatArray, seconds: float
) -> tuple[FloatArray, FloatArray]:
    """Return integrals of rates and increments of values over windows of given length."""
    values = np.column_stack((cumulative_integral(time, rate), value))
    increments = [values[:0]]
    for start, stop in bounds.tolist():
        segment_time = time[start:stop]
        first = np.arange(0, stop - start, 1 + len(time) // _MAX_PAIRS)
        last = np.searchsorted(segment_time, segment_time[first] + seconds)
        last = np.minimum(last, stop - start - 1)  # shorter at the end of a segment
        valid = segment_time[last] - segment_time[first] >= seconds / 2
        increments.append(values[start + last[valid]] - values[start + first[valid]])
    stacked = np.concatenate(increments)
    return stacked[:, : rate.shape[1]], stacked[:, rate.shape[1] :]


def regress_increments(integrals: FloatArray, increments: FloatArray) -> ChannelRegression:
    """Return scale and correlation of integrals and increments."""
    n = len(integrals)
    if n < _MIN_PAIRS:
        return NO_REGRESSION
    inliers = _inliers(integrals.reshape(n, -1), increments.reshape(n, -1))
    integrals, increments = integrals[inliers], increments[inliers]
    if not len(integrals):  # no finite pair
        return NO_REGRESSION
    norm, reference = float(np.linalg.norm(integrals)), float(np.linalg.norm(increments))
    rms = reference / len(integrals) ** 0.5
    if min(norm, reference) < _MIN_MOTION:
        return ChannelRegression(0.0, 0.0, rms)
    correlation = float(np.sum((integrals / norm) * (increments / reference)))
    return ChannelRegression(float(np.sign(correlation)) * norm / reference, correlation, rms)


def _inliers(integrals: FloatArray, increments: FloatArray) -> BoolArray:
    """Return the 97 % of pairs that agree best."""
    sizes = [float(np.median(np.linalg.norm(values, axis=1))) for values in (integrals, increments)]
    if min(sizes) < _MIN_MOTION:
        return np.ones(len(integrals), dtype=np.bool_)
    first, second = integrals / sizes[0], increments / sizes[1]
    sign = np.sign(np.sum(np.clip(first, -3, 3) * np.clip(second, -3, 3)))
    size = 1.0 + np.linalg.norm(first, axis=1) + np.linalg.norm(second, axis=1)
    distance = np.linalg.norm(second - sign * first, axis=1) / size
    return np.asarray(distance <= np.quantile(distance, _INLIER_SHARE))


def noise_std(values: FloatArray, bounds: IntArray) -> float:
    """Return the noise standard deviation of a channel, from its second differences."""
    curvatures = [np.abs(np.diff(values[a:b], 2, axis=0)).ravel() for a, b in bounds.tolist()]
    sizes = np.concatenate(curvatures)
    if not len(sizes):
        return 0.0
    inliers = sizes[sizes <= np.quantile(sizes, _INLIER_SHARE)]
    return float(np.sqrt(np.mean(inliers**2) / 6.0))

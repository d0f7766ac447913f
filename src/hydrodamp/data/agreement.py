"""How well two channels that measure one motion go together, over windows longer than noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import rotation_matrices, rotation_vectors

_MIN_WINDOW_S, _MIN_WINDOW_STEPS = 1.0, 10  # s, and steps: the shortest window
_WINDOW_FACTORS = (1, 4, 16)
_MIN_WINDOWS = 8  # in a log; fewer agree by chance
_MIN_PAIRS = 20
_MIN_CORRELATION = 0.8
_MAX_RESIDUAL_SHARE = 0.25  # of what others leave
_MAX_PAIRS = 50_000  # pairs; more are thinned
_INLIER_SHARE = 0.97  # of the pairs
_MIN_MOTION = 1e-9  # of any unit; less is no motion


class ChannelRegression(NamedTuple):
    """How the sum of a rate goes with the moves of what it is the rate of."""

    scale: float  # of the sums over the moves, with the sign of the correlation
    correlation: float
    rms_increment: float = 0.0  # usual size of the moves
    window_s: float = 0.0  # time that both are taken over [s]

    def is_consistent(self) -> bool:
        """Return whether they measure one motion, of either sign."""
        return abs(self.correlation) >= _MIN_CORRELATION

    def explains_more_than(self, other: ChannelRegression) -> bool:
        """Return whether they agree and leave far less unexplained than others do."""
        left, usual = (1.0 - np.nan_to_num(one.correlation) ** 2 for one in (self, other))
        likely = self.correlation > max(_MIN_CORRELATION, np.nan_to_num(other.correlation))
        return bool(likely and (left < _MAX_RESIDUAL_SHARE * usual or other.correlation < 0.0))


#: Of channels that cannot be compared.
NO_REGRESSION = ChannelRegression(float("nan"), float("nan"))


def integrate_rotation(attitude: FloatArray, bounds: IntArray) -> FloatArray:
    """Return the turns about body axes, added up from the first sample of each segment."""
    return _cumulate(rotation_vectors(attitude[:-1], attitude[1:]), bounds)


def integrate_displacement(
    attitude: FloatArray, position: FloatArray, bounds: IntArray
) -> FloatArray:
    """Return the ways along body axes, added up from the first sample of each segment."""
    axes, moves = rotation_matrices(attitude), np.diff(position, axis=0)
    return _cumulate(np.einsum("nij,ni->nj", (axes[1:] + axes[:-1]) / 2, moves), bounds)


def _cumulate(steps: FloatArray, bounds: IntArray) -> FloatArray:
    added = np.concatenate((np.zeros((1, 3)), steps))
    added[bounds[:, 0]] = 0.0
    added[~np.isfinite(added).all(axis=1)] = 0.0
    return np.asarray(np.cumsum(added, axis=0))


def cumulative_integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the running trapezoidal integral of columns."""
    strips = np.diff(time)[:, np.newaxis] * (values[1:] + values[:-1]) / 2
    return np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(strips, axis=0)))


def regress_channel(
    time: FloatArray, bounds: IntArray, rate: FloatArray, value: FloatArray
) -> ChannelRegression:
    """Compare over the windows that two channels agree best in; if in none, over the longest."""
    steps = np.concatenate([np.diff(time[:0]), *(np.diff(time[a:b]) for a, b in bounds.tolist())])
    if not len(steps):
        return NO_REGRESSION
    shortest = max(_MIN_WINDOW_S, _MIN_WINDOW_STEPS * float(np.median(steps)))
    spans = [
        times * shortest
        for times in _WINDOW_FACTORS
        if times * shortest * _MIN_WINDOWS < steps.sum()
    ]
    found = [
        regress_increments(*window_increments(time, bounds, rate, value, span))._replace(
            window_s=span
        )
        for span in spans or [shortest]
    ]
    known = [one for one in found if one.rms_increment > 0.0]
    best = max(known, key=lambda one: abs(one.correlation), default=NO_REGRESSION)
    return best if best.is_consistent() else (known or [NO_REGRESSION])[-1]


def window_increments(
    time: FloatArray, bounds: IntArray, rate: FloatArray, value: FloatArray, seconds: float
) -> tuple[FloatArray, FloatArray]:
    """Return what rates add up to over some seconds, and how far values move meanwhile."""
    way = np.column_stack((cumulative_integral(time, rate), value))
    moved = [way[:0]]
    for start, stop in bounds.tolist():
        part = time[start:stop]
        first = np.arange(0, stop - start, 1 + len(time) // _MAX_PAIRS)
        last = np.minimum(np.searchsorted(part, part[first] + seconds), stop - start - 1)
        far = part[last] - part[first] >= seconds / 2  # the end of a segment leaves less
        moved.append(way[start + last[far]] - way[start + first[far]])
    both = np.concatenate(moved)
    return both[:, : rate.shape[1]], both[:, rate.shape[1] :]


def regress_increments(added: FloatArray, moved: FloatArray) -> ChannelRegression:
    """Return how sums and moves go together."""
    if len(added) < _MIN_PAIRS:
        return NO_REGRESSION
    kept = _inliers(added.reshape(len(added), -1), moved.reshape(len(moved), -1))
    added, moved = added[kept], moved[kept]
    if not len(added):  # no pair is a number
        return NO_REGRESSION
    one, other = float(np.linalg.norm(added)), float(np.linalg.norm(moved))
    usual = other / len(added) ** 0.5
    if min(one, other) < _MIN_MOTION:
        return ChannelRegression(0.0, 0.0, usual)
    correlation = float(np.sum((added / one) * (moved / other)))
    return ChannelRegression(float(np.sign(correlation)) * one / other, correlation, usual)


def _inliers(added: FloatArray, moved: FloatArray) -> BoolArray:
    """Leave out the few that agree least: spikes, and averages across a wrap."""
    sizes = [float(np.median(np.linalg.norm(one, axis=1))) for one in (added, moved)]
    if min(sizes) < _MIN_MOTION:
        return np.ones(len(added), dtype=np.bool_)
    one, other = added / sizes[0], moved / sizes[1]
    sign = np.sign(np.sum(np.clip(one, -3, 3) * np.clip(other, -3, 3)))
    size = 1.0 + np.linalg.norm(one, axis=1) + np.linalg.norm(other, axis=1)
    apart = np.linalg.norm(other - sign * one, axis=1) / size
    return np.asarray(apart <= np.quantile(apart, _INLIER_SHARE))


def noise_std(values: FloatArray, bounds: IntArray) -> float:
    """Return the noise of a channel, as its bends from sample to sample have it."""
    bends = [np.abs(np.diff(values[a:b], 2, axis=0)).ravel() for a, b in bounds.tolist()]
    every = np.concatenate(bends)
    few = every[every <= np.quantile(every, _INLIER_SHARE)] if len(every) else np.zeros(1)
    return float(np.sqrt(np.mean(few**2) / 6.0))

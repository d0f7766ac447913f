"""Do two channels measure the same motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray

SHORTEST = 1.0
"""Least length of a window [s]."""

_LEAST_WINDOWS = 12
_STEPS = 10  # in a window, at least
_KEPT = 0.97  # of the windows
_TINY = 1e-9  # of any unit; less is no motion


class Agreement(NamedTuple):
    """How two channels go together."""

    ratio: float
    correlation: float

    def agrees(self, least: float = 0.8) -> bool:
        """Tell whether they measure one motion, of either sign."""
        return bool(np.isfinite(self.correlation)) and abs(self.correlation) >= least


NONE = Agreement(float("nan"), float("nan"))
"""Of channels that cannot be compared."""


def changes(
    elapsed: FloatArray, rate: FloatArray, value: FloatArray, seconds: float = SHORTEST
) -> tuple[FloatArray, FloatArray]:
    """Return what rates add up to over windows, and how far values move meanwhile."""
    first, last = windows(elapsed, whole_rows(np.column_stack((rate, value))), seconds)
    steps = np.diff(elapsed)[:, np.newaxis] * (rate[1:] + rate[:-1]) / 2
    way = np.concatenate((np.zeros((1, rate.shape[1])), np.cumsum(np.nan_to_num(steps), axis=0)))
    return way[last] - way[first], value[last] - value[first]


def windows(
    elapsed: FloatArray, known: BoolArray, seconds: float = SHORTEST
) -> tuple[IntArray, IntArray]:
    """Return first and last samples of windows without a break."""
    n = len(elapsed)
    if n < _STEPS:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    length = max(_STEPS * float(np.median(np.diff(elapsed))), seconds)
    starts = np.searchsorted(elapsed, np.arange(elapsed[0], elapsed[-1], length / 2))
    ends = np.searchsorted(elapsed, elapsed[np.minimum(starts, n - 1)] + length)
    inside = ends < n
    first, last = starts[inside], ends[inside]
    breaks = np.cumsum(~known)
    whole = (breaks[last] == breaks[first]) & known[first]
    return first[whole], last[whole]


def whole_rows(values: FloatArray) -> BoolArray:
    """Tell the rows without NaN."""
    whole: BoolArray = np.asarray(np.isfinite(values).all(axis=1))
    return whole


def compared(added: FloatArray, moved: FloatArray) -> Agreement:
    """Return how sums and moves go together."""
    if len(added) < _LEAST_WINDOWS:
        return NONE
    kept = _usual(added.reshape(len(added), -1), moved.reshape(len(moved), -1))
    added, moved = added[kept], moved[kept]
    one, other = float(np.linalg.norm(added)), float(np.linalg.norm(moved))
    if min(one, other) < _TINY:
        return NONE
    correlation = float(np.sum((added / one) * (moved / other)))
    return Agreement(float(np.sign(correlation)) * other / one, correlation)


def _usual(added: FloatArray, moved: FloatArray) -> BoolArray:
    """Leave out the few windows that agree least: spikes, and averages across a wrap."""
    sizes = [float(np.median(np.linalg.norm(one, axis=1))) for one in (added, moved)]
    if min(sizes) < _TINY:
        return np.ones(len(added), dtype=np.bool_)
    one, other = added / sizes[0], moved / sizes[1]
    sign = np.sign(np.sum(np.clip(one, -3, 3) * np.clip(other, -3, 3)))
    size = 1.0 + np.linalg.norm(one, axis=1) + np.linalg.norm(other, axis=1)
    apart = np.linalg.norm(other - sign * one, axis=1) / size
    usual: BoolArray = apart <= np.quantile(apart, _KEPT)
    return usual


def straightened(angle: FloatArray) -> FloatArray:
    """Return an angle without its wraps, be they of 2 pi or of 360."""
    known = np.isfinite(angle)
    values = angle[known]
    if len(values) < 2:
        return angle
    reach, leap = float(np.ptp(values)), float(np.abs(np.diff(values)).max())
    for period in (2 * np.pi, 360.0):
        if leap > 0.75 * period and reach <= 1.02 * period:
            straight = angle.copy()
            straight[known] = np.unwrap(values, period=period)
            return straight
    return angle

"""Minimum and maximum of a series in intervals of time, for plots of any number of samples.

Blocks of 64 samples have their extremes computed once; an interval that spans many blocks takes
those of its blocks, any other its samples. NaN values are left out; an interval without values is
NaN.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

#: Samples in a block.
BLOCK = 64


@dataclass(frozen=True, eq=False)
class DecimatedSeries:
    """A series with non-decreasing times, and the extremes (m, 2) of its blocks."""

    time: FloatArray
    values: FloatArray
    extremes: FloatArray

    @classmethod
    def of(cls, time: FloatArray, values: FloatArray) -> DecimatedSeries:
        """Compute the extremes of all blocks."""
        starts = np.arange(0, len(values), BLOCK)
        if not len(starts):
            return cls(time, values, np.empty((0, 2)))
        return cls(time, values, _extremes(values, values, starts))

    def between(self, start: float, end: float, n: int) -> tuple[FloatArray, FloatArray]:
        """Return at most 2 n points of an interval of time, one more on either side."""
        first = max(int(np.searchsorted(self.time, start, side="right")) - 1, 0)
        last = min(int(np.searchsorted(self.time, end)) + 1, len(self.time))
        if last - first <= 2 * n:
            return self.time[first:last], self.values[first:last]
        edges = np.linspace(self.time[first], self.time[last - 1], n + 1)
        if last - first <= 4 * BLOCK * n:
            time, low, high = (each[first:last] for each in (self.time, self.values, self.values))
        else:
            blocks = slice(first // BLOCK, -(-last // BLOCK))
            time, (low, high) = self.time[::BLOCK][blocks], self.extremes[blocks].T
        starts = _starts(time, edges)
        pairs = _extremes(low, high, starts)
        pairs[np.diff(np.append(starts, len(time))) == 0] = np.nan
        middle = 0.5 * (edges[1:] + edges[:-1])
        return np.repeat(middle, 2), pairs.ravel()


def _starts(time: FloatArray, edges: FloatArray) -> IntArray:
    """Return the first sample of each interval; the first interval begins with the first sample."""
    starts = np.minimum(np.searchsorted(time, edges[:-1]), len(time) - 1)
    starts[0] = 0
    return np.asarray(starts)


def _extremes(low: FloatArray, high: FloatArray, starts: IntArray) -> FloatArray:
    return np.column_stack([np.fmin.reduceat(low, starts), np.fmax.reduceat(high, starts)])

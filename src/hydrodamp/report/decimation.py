"""Series of plots: time of a log, extremes in intervals of time, and their encoding for a page.

Blocks of 64 samples have their extremes computed once; an interval that spans many blocks takes
those of its blocks, any other its samples. NaN values are left out; an interval without values is
NaN.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.log import Log

#: Samples in a block.
BLOCK = 64

QUANTISATION_STEPS = 65_000  # steps of the range of a series, as uint16
MISSING_STEP = 65_535  # step of a missing value


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


def clock(log: Log) -> FloatArray:
    """Return recorded time with segments end to end."""
    steps = np.diff(log.time, prepend=log.time[0])
    steps[[segment.start for segment in log.segments]] = 0.0
    return np.cumsum(steps)


def trace(log: Log, values: FloatArray, n_points: int) -> tuple[FloatArray, FloatArray]:
    """Return time and values in about this many points, with a gap between segments."""
    time = clock(log)
    segments: list[FloatArray] = []
    for segment in log.segments:
        inside = slice(segment.start, segment.stop)
        n = max(-(-n_points * len(segment) // (2 * log.n)), 1)
        points = DecimatedSeries.of(time[inside], values[inside]).between(-np.inf, np.inf, n)
        segments += [np.array(points), np.array([[time[segment.stop - 1]], [np.nan]])]
    moments, plotted = np.concatenate(segments[:-1], axis=1)
    return moments, plotted


def encode_times(time: FloatArray) -> str:
    """Return times (float64) in base 64."""
    return base64.b64encode(time.astype("<f8").tobytes()).decode("ascii")


def encode_values(values: FloatArray) -> dict[str, object]:
    """Return a series in steps of its range (uint16) in base 64."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high / QUANTISATION_STEPS - low / QUANTISATION_STEPS) or 1.0
    with np.errstate(invalid="ignore", over="ignore"):
        counts = np.rint(values / step - low / step)
    steps = np.where(np.isfinite(values), counts, MISSING_STEP).astype("<u2")
    return {"low": low, "step": step, "steps": base64.b64encode(steps.tobytes()).decode("ascii")}

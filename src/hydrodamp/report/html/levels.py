"""Series at a few points: the lowest and the highest value of each stretch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class Level:
    """Which samples share a stretch, at one zoom of a plot."""

    starts: IntArray
    stops: IntArray
    breaks: IntArray

    @property
    def exact(self) -> bool:
        """Whether no stretch has more than two samples: nothing is left out."""
        return bool(np.all(self.stops - self.starts <= 2))

    def times(self, time: FloatArray) -> FloatArray:
        """Return the two times of each stretch, with one between segments."""
        pairs = np.column_stack([time[self.starts], time[self.stops - 1]])
        ends = 0.5 * (time[self.starts[self.breaks]] + time[self.stops[self.breaks - 1] - 1])
        return self._laid_out(pairs, ends)

    def values(self, series: FloatArray) -> FloatArray:
        """Return lowest and highest value of each stretch, in the sense in which it runs."""
        low, high = self._each(np.fmin, series), self._each(np.fmax, series)
        falling = series[self.starts] > series[self.stops - 1]
        return self._broken(np.where(falling, high, low), np.where(falling, low, high))

    def lowest(self, series: FloatArray) -> FloatArray:
        """Return the lowest value of each stretch: the lower edge of a band, never too high."""
        low = self._each(np.fmin, series)
        return self._broken(low, low)

    def highest(self, series: FloatArray) -> FloatArray:
        """Return the highest value of each stretch: the upper edge of a band, never too low."""
        high = self._each(np.fmax, series)
        return self._broken(high, high)

    def _each(self, extreme: np.ufunc, series: FloatArray) -> FloatArray:
        """Return the extreme of each stretch."""
        inside = np.zeros(len(self.starts) * 2, dtype=np.intp)
        inside[0::2], inside[1::2] = self.starts, self.stops
        joined = np.append(series, np.nan)  # an index one past the end must be there
        found: FloatArray = extreme.reduceat(joined, inside)[0::2]
        return found

    def _broken(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return pairs in a row, with nothing between segments."""
        return self._laid_out(np.column_stack([first, second]), np.full(len(self.breaks), np.nan))

    def _laid_out(self, pairs: FloatArray, ends: FloatArray) -> FloatArray:
        """Return pairs in a row, single ones once, with something at each break."""
        once = self.stops - self.starts == 1
        keep = np.column_stack([np.ones(len(once), dtype=bool), ~once]).ravel()
        before = np.cumsum(np.where(once, 1, 2))[self.breaks - 1]
        laid: FloatArray = np.insert(pairs.ravel()[keep], before, ends)
        return laid


def level(bounds: Sequence[tuple[int, int]], points: int) -> Level:
    """Return a level of about so many points."""
    n = sum(stop - start for start, stop in bounds)
    edges = [_edges(start, stop, n, points) for start, stop in bounds]
    counts = [len(each) - 1 for each in edges]
    return Level(
        starts=np.concatenate([each[:-1] for each in edges]),
        stops=np.concatenate([each[1:] for each in edges]),
        breaks=np.cumsum(counts)[:-1].astype(np.intp),
    )


def _edges(start: int, stop: int, n: int, points: int) -> IntArray:
    length = stop - start
    if n <= points:
        return np.arange(start, stop + 1)
    stretches = min(max(round(points / 2 * length / n), 1), length)
    return np.linspace(start, stop, stretches + 1).round().astype(np.intp)

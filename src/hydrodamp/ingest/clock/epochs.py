"""Epochs of a clock that learns the date while it records, put side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

EPOCH = 1e6
"""Stamps further apart than this, 11 days, belong to two epochs [s]."""

_PAUSE = 1.0  # s, between two epochs put side by side


@dataclass(frozen=True, eq=False)
class Epochs:
    """The epochs that the stamps of a recording fall into."""

    starts: FloatArray
    shifts: FloatArray

    def of(self, time: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the epoch of each stamp and the stamps put side by side."""
        if len(self.starts) < 2:
            return np.zeros(len(time), np.int64), time
        era = np.searchsorted(self.starts, time, side="right") - 1
        return era, time + self.shifts[era]


def epochs(times: Sequence[FloatArray]) -> Epochs:
    """Return the epochs of stamps."""
    spans = np.array(sorted(span for time in times for span in _spans(time))).reshape(-1, 2)
    reached = np.maximum.accumulate(spans[:, 1])
    new = np.append(True, spans[1:, 0] - reached[:-1] > EPOCH)[: len(spans)]
    starts = spans[new, 0]
    ends = reached[np.append(np.flatnonzero(new)[1:] - 1, len(spans) - 1)] if len(spans) else starts
    closing = np.append(starts[1:] - ends[:-1] - _PAUSE, 0.0)[: len(starts)]
    return Epochs(starts, np.cumsum(closing[::-1])[::-1])


def _spans(time: FloatArray) -> list[tuple[float, float]]:
    """Return first and last of each stretch of stamps without a leap."""
    if len(time) == 0:
        return []
    if time.max() - time.min() <= EPOCH:
        return [(float(time.min()), float(time.max()))]
    ordered = np.sort(time)
    cuts = np.flatnonzero(np.diff(ordered) > EPOCH)
    firsts, lasts = np.append(0, cuts + 1), np.append(cuts, len(ordered) - 1)
    return list(zip(ordered[firsts].tolist(), ordered[lasts].tolist(), strict=True))

"""One time for all segments: they stand one after another, since a clock may restart."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log

_APART = 0.01
"""Room between segments, as a share of the recorded time."""


def staged_time(log: Log) -> FloatArray:
    """Return the time at which each sample stands in a plot."""
    spans = [float(log.time[s.stop - 1] - log.time[s.start]) for s in log.segments]
    room = max(_APART * sum(spans), 1e-3)
    time = np.empty(log.n)
    origin = 0.0
    for segment, span in zip(log.segments, spans, strict=True):
        part = slice(segment.start, segment.stop)
        time[part] = origin + (log.time[part] - log.time[segment.start])
        origin += span + room
    return time


def worst_window(time: FloatArray, bounds: FloatArray, errors: FloatArray, most: int) -> slice:
    """Return the samples of the minute with the largest mean square error."""
    power = np.nan_to_num(np.square(errors).sum(axis=1))
    total = np.concatenate([[0.0], np.cumsum(power)])
    best, found = -1.0, slice(0, 0)
    for start, stop in bounds.astype(int).tolist():
        first = np.arange(start, stop)
        last = start + np.searchsorted(time[start:stop], time[start:stop] + MINUTE, side="right")
        last = np.minimum(last, first + most)
        whole = (last < stop) | (first == start) | (time[first] + MINUTE <= time[stop - 1])
        first, last = first[whole], last[whole]
        mean = (total[last] - total[first]) / (last - first)
        k = int(np.argmax(mean))
        if mean[k] > best:
            best, found = float(mean[k]), slice(int(first[k]), int(last[k]))
    return found


MINUTE = 60.0
"""Length of the worst window [s]."""

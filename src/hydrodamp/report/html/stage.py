"""One time for all segments: they stand one after another, since a clock may restart."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log

_APART = 0.01
"""Room between segments, as a share of the recorded time."""


def staged_time(log: Log) -> FloatArray:
    """Return the time at which each sample stands in a plot.

    Parameters
    ----------
    log : Log
        Whose clock may restart at a segment.

    Returns
    -------
    time : ndarray, shape (n,)
        Zero at the first sample [s]; increasing, with a little room between segments.

    Examples
    --------
    >>> log = Log.from_arrays([5.0, 6.0, 0.0, 1.0], {"u": [1.0] * 4}, segment=[1, 1, 2, 2])
    >>> staged_time(log).round(2).tolist()
    [0.0, 1.0, 1.02, 2.02]
    """
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
    """Return the samples of the minute with the largest mean square error.

    Parameters
    ----------
    time : ndarray, shape (n,)
        As of :func:`staged_time` [s].
    bounds : ndarray, shape (m, 2)
        First sample and one past the last of each segment.
    errors : ndarray, shape (n, k)
        Replay less measured, in the units of equation 24; NaN counts as nothing.
    most : int
        The window has no more samples than that, whatever their rate.

    Returns
    -------
    window : slice
        Within one segment: a minute, or all of a shorter one.

    Examples
    --------
    >>> time, errors = np.arange(300.0), np.zeros((300, 1))
    >>> errors[200] = 1.0
    >>> worst_window(time, np.array([[0, 300]]), errors, 1000)
    slice(140, 201, None)
    """
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

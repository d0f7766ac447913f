"""Lines of long series: the extremes of every bin, and never a stroke across a join.

A line of a million samples in a column of a journal has a thousand times more samples than
dots. One in a thousand of them would lose every spike; the least and the greatest of each
bin, in the order they came, look like all of them.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.log import Log

PAIRS = 800
"""Bins of a line: more than twice as many as fit beside each other, a line wide, across a
column."""


def min_max_pairs(values: FloatArray, most: int = PAIRS) -> IntArray:
    """Return which samples to draw so that a line looks like all of them.

    Parameters
    ----------
    values : ndarray, shape (n,)
        In the order of time; NaN where there is nothing.
    most : int
        Bins, of equally many samples; at least one.

    Returns
    -------
    kept : ndarray of int, shape (m,)
        Rising; all samples where they are no more than two a bin, else the first, the
        last, and of every bin its least and its greatest. A bin of NaN alone keeps its
        first, so that the line breaks.

    Examples
    --------
    >>> min_max_pairs(np.array([0.0, 5.0, 1.0, 1.0, -7.0, 1.0, 0.0, 0.0, 2.0]), 3).tolist()
    [0, 1, 3, 4, 6, 8]
    """
    n = len(values)
    if n <= 2 * most:
        return np.arange(n)
    length = -(-n // most)
    padded = np.append(values, np.full(-n % length, np.nan)).reshape(-1, length)
    starts = np.arange(0, n, length)
    low = np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1)
    high = np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1)
    return np.unique(np.concatenate([[0, n - 1], starts + low, starts + high]))


def clock(log: Log) -> FloatArray:
    """Return the time that figures show: recorded time, segments end to end.

    Parameters
    ----------
    log : Log
        Whose clock may restart or leap at a join.

    Returns
    -------
    time : ndarray, shape (n,)
        [s], from zero.

    Examples
    --------
    >>> log = Log.from_arrays([5, 6, 90, 92], {"u": [1, 1, 2, 2]}, segment="aabb")
    >>> clock(log).tolist()
    [0.0, 1.0, 1.0, 3.0]
    """
    steps = np.diff(log.time, prepend=log.time[0])
    steps[[segment.start for segment in log.segments]] = 0.0
    return np.cumsum(steps)


def trace(log: Log, values: FloatArray, most: int = PAIRS) -> tuple[FloatArray, FloatArray]:
    """Return the line of a channel, broken at joins.

    Parameters
    ----------
    log : Log
        Clock and segments.
    values : ndarray, shape (n,)
        One a sample.
    most : int
        Bins, shared among the segments by their samples.

    Returns
    -------
    time, line : ndarray, shape (m,)
        Of :func:`clock` [s]; NaN between segments.
    """
    time = clock(log)
    times: list[FloatArray] = []
    lines: list[FloatArray] = []
    for segment in log.segments:
        share = max(round(most * len(segment) / log.n), 1)
        kept = segment.start + min_max_pairs(values[segment.start : segment.stop], share)
        times += [time[kept], time[kept[-1:]]]
        lines += [values[kept], np.array([np.nan])]
    return np.concatenate(times), np.concatenate(lines)


def ribbon(
    log: Log, lower: FloatArray, upper: FloatArray, most: int = PAIRS
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the outline of a band: never narrower than the band itself.

    Parameters
    ----------
    log : Log
        Clock and segments.
    lower, upper : ndarray, shape (n,)
        Its ends; NaN where there is none.
    most : int
        Bins, shared among the segments by their samples.

    Returns
    -------
    time, low, high : ndarray, shape (m,)
        Least lower and greatest upper end of every bin at its first sample, and again at
        its last; NaN between segments.
    """
    time = clock(log)
    parts: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for segment in log.segments:
        share = max(round(most * len(segment) / log.n), 1)
        starts = segment.start + np.arange(0, len(segment), -(-len(segment) // share))
        ends = np.append(starts[1:], segment.stop) - 1
        part = slice(0, segment.stop)
        low = np.fmin.reduceat(lower[part], starts)
        high = np.fmax.reduceat(upper[part], starts)
        parts.append((_both(time[starts], time[ends]), _both(low, low), _both(high, high)))
        parts.append((time[ends[-1:]], np.array([np.nan]), np.array([np.nan])))
    outline = tuple(np.concatenate(column) for column in zip(*parts, strict=True))
    return outline[0], outline[1], outline[2]


def _both(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.column_stack([first, second]).ravel()

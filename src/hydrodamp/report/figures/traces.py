"""Lines of long series: the extremes of every bin, and never a stroke across a join."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.log import Log

PAIRS = 800
"""Bins of a line: more than twice as many as fit beside each other, a line wide, across a
column."""


def min_max_pairs(values: FloatArray, most: int = PAIRS) -> IntArray:
    """Return which samples to draw so that a line looks like all of them."""
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
    """Return the time that figures show: recorded time, segments end to end."""
    steps = np.diff(log.time, prepend=log.time[0])
    steps[[segment.start for segment in log.segments]] = 0.0
    return np.cumsum(steps)


def trace(log: Log, values: FloatArray, most: int = PAIRS) -> tuple[FloatArray, FloatArray]:
    """Return the line of a channel, broken at joins."""
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
    """Return the outline of a band: never narrower than the band itself."""
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

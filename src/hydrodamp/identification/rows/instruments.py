"""Instruments: what rows before and after foretell of the regressors of a row."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.rank import spanned

ROUNDING = 1e-6
"""What the clock of the rows may be off [s]."""


def around(rows: Rows, columns: FloatArray, lag: float) -> tuple[FloatArray, BoolArray]:
    """Return means of columns a lag and two lags before and after, and where there are all."""
    near = np.zeros((rows.n, 2 * columns.shape[1]))
    known = np.zeros(rows.n, dtype=bool)
    for segment in np.unique(rows.segment):
        here = np.flatnonzero(rows.segment == segment)
        time, reach = rows.time[here], 2.0 * lag - ROUNDING
        inner = (time - reach >= time[0]) & (time + reach <= time[-1])
        means = [_mean(time[inner], far, time, columns[here]) for far in (lag, 2.0 * lag)]
        near[here[inner]] = np.hstack(means)
        known[here[inner]] = True
    return near, known


def _mean(instants: FloatArray, far: float, time: FloatArray, columns: FloatArray) -> FloatArray:
    """Return the mean of columns before and after some instants."""
    before, after = (_at(instants + way, time, columns) for way in (-far, far))
    mean: FloatArray = 0.5 * (before + after)
    return mean


def _at(instants: FloatArray, time: FloatArray, columns: FloatArray) -> FloatArray:
    """Return columns at some instants, interpolated between rows."""
    place = np.interp(instants, time, np.arange(len(time)))
    low = np.floor(place).astype(np.int64)
    share = (place - low)[:, None]
    between: FloatArray = (1.0 - share) * columns[low]
    between += share * columns[np.minimum(low + 1, len(time) - 1)]
    return between


def without(values: FloatArray, columns: FloatArray) -> FloatArray:
    """Take the part in the span of some columns away."""
    directions = spanned(columns, range(columns.shape[1])).directions
    rest: FloatArray = values - directions @ (directions.T @ values)
    return rest

"""Series along simulated windows: values at measurements, integrals, differences, averages."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.velocity_smoother import Interpolation
from hydrodamp.identification.multiple_shooting import AVERAGES_PER_WINDOW, Windows


class WindowRows(NamedTuple):
    """Measurements of a sensor in windows: rows of the windows, their window, and index."""

    lower: IntArray
    upper: IntArray
    share: FloatArray
    window: IntArray
    number: IntArray


def rows_in_windows(windows: Windows, rows: Interpolation) -> WindowRows:
    """Return the measurements of a sensor in each window."""
    lower, share, last = rows.lower, rows.share, rows.upper
    first = np.searchsorted(lower, windows.bounds[:, 0])
    stop = np.maximum(np.searchsorted(last, windows.bounds[:, 1]), first)
    counts = stop - first
    window = np.repeat(np.arange(len(counts)), counts)
    begin = np.repeat(first - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    index = np.arange(counts.sum()) + begin
    shift = (windows.spans[:, 0] - windows.bounds[:, 0])[window]
    return WindowRows(lower[index] + shift, last[index] + shift, share[index], window, index)


def fill_gaps(simulated: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return simulated velocities with zeros after a divergence, and where that is."""
    diverged = ~np.all(np.isfinite(simulated), axis=1)
    return np.where(diverged[:, None], 0.0, simulated), diverged


def integrate(rates: FloatArray, time: FloatArray, spans: IntArray) -> FloatArray:
    """Return trapezoidal integrals (n, ...) from the start of each window."""
    step = np.diff(time).reshape(-1, *(1,) * (rates.ndim - 1))
    increments = np.zeros_like(rates)
    increments[1:] = 0.5 * step * (rates[1:] + rates[:-1])
    increments[spans[:, 0]] = 0.0
    total = np.cumsum(increments, axis=0)
    sizes = np.diff(spans, axis=1).ravel()
    return np.asarray(total - np.repeat(total[spans[:, 0]], sizes, axis=0))


def differentiate(series: FloatArray, time: FloatArray, spans: IntArray) -> FloatArray:
    """Return central differences (n, ...) in each window, one-sided at its ends."""
    n = len(series)
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[spans[:, 0]] = spans[:, 0]
    after[spans[:, 1] - 1] = spans[:, 1] - 1
    step = (time[after] - time[before]).reshape(-1, *(1,) * (series.ndim - 1))
    return np.asarray((series[after] - series[before]) / np.where(step > 0.0, step, 1.0))


def average_rows(
    columns: FloatArray, window: IntArray, per_window: float
) -> tuple[FloatArray, IntArray]:
    """Return averages of successive rows of each window, times the root of their number."""
    block = max(int(per_window) // AVERAGES_PER_WINDOW, 1)
    if block == 1:
        return columns, window
    starts = np.flatnonzero(np.diff(window, prepend=-1))
    position = np.arange(len(window)) - np.repeat(starts, np.diff(np.append(starts, len(window))))
    first = np.flatnonzero(position % block == 0)
    size = np.diff(np.append(first, len(window)))
    return np.add.reduceat(columns, first, axis=0) / np.sqrt(size)[:, None], window[first]

"""Slopes by local polynomials, on any clock and within segments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

#: Numbers of samples to choose from.
WINDOWS = (5, 7, 9, 13, 17, 25, 35)

_CHUNK = 8192
_EVEN = 1e-9  # of a window, by which an even clock may differ
_TRIED = 20000  # samples at which windows are compared, no more


class Local(NamedTuple):
    """Local polynomials at m samples."""

    value: FloatArray
    slope: FloatArray
    own: FloatArray


#: Samples (m,) and their neighbours (m, w) -> the values there, shape (m, w, k).
Around = Callable[[IntArray, IntArray], FloatArray]


def slopes(
    time: FloatArray, bounds: IntArray, around: Around, seconds: float | None
) -> tuple[Local, int]:
    """Return local quadratics over some seconds, or over the best window; and its samples."""
    if seconds is None:
        window = best_window(time, bounds, around)
    else:
        steps = np.concatenate([np.diff(time[a:b]) for a, b in bounds])
        window = max(5, 2 * round(seconds / float(np.median(steps)) / 2) + 1)
    return fitted(time, bounds, around, window), window


def relative(values: FloatArray) -> Around:
    """Return columns of numbers as differences from each sample."""

    def around(at: IntArray, near: IntArray) -> FloatArray:
        return np.asarray(values[near] - values[at][:, np.newaxis])

    return around


def local_polynomials(span: FloatArray, around: FloatArray, degree: int = 2) -> Local:
    """Fit a polynomial to each window and evaluate it at the sample."""
    if np.ptp(span, axis=0).max() <= _EVEN * np.abs(span).max():
        span = span[:1]  # an even clock: one polynomial's weights serve all
    size = np.abs(span).max(axis=1)
    scale = np.where(size > 0, size, 1.0)[:, np.newaxis]
    powers = np.stack([(span / scale) ** k for k in range(min(degree + 1, span.shape[1]))], axis=1)
    inverse = np.linalg.inv(powers @ powers.transpose(0, 2, 1))
    parts = (inverse @ powers) @ around
    slope = parts[:, 1] / scale if parts.shape[1] > 1 else 0.0 * parts[:, 0]
    return Local(parts[:, 0], slope, np.broadcast_to(inverse[:, 0, 0], len(around)))


def fitted(
    time: FloatArray,
    bounds: IntArray,
    around: Around,
    window: int,
    rows: IntArray | None = None,
    degree: int = 2,
) -> Local:
    """Return local polynomials at samples of a log."""
    wanted = np.arange(len(time)) if rows is None else rows
    parts = []
    for start, stop in bounds.tolist():
        first, last = np.searchsorted(wanted, (start, stop)).tolist()
        width = min(window, stop - start)
        for low in range(first, last, _CHUNK):
            at = wanted[low : min(low + _CHUNK, last)]
            begin = np.clip(at - width // 2, start, stop - width)
            near = begin[:, np.newaxis] + np.arange(width)
            span = time[near] - time[at, np.newaxis]
            parts.append(local_polynomials(span, around(at, near), degree))
    return Local(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def best_window(
    time: FloatArray, bounds: IntArray, around: Around, windows: Sequence[int] = WINDOWS
) -> int:
    """Return the window whose parabolas best predict the sample they leave out."""
    rows = np.arange(0, len(time), -(-len(time) // _TRIED))
    longest = int(np.max(bounds[:, 1] - bounds[:, 0]))
    usable = [window for window in windows if window < longest] or [windows[0]]
    errors = []
    for window in usable:
        fit = fitted(time, bounds, around, window, rows)
        free = np.maximum(1.0 - fit.own, 1e-6)[:, np.newaxis]
        errors.append(float(np.mean((fit.value / free) ** 2)))
    return usable[int(np.argmin(errors))]

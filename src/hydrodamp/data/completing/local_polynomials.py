"""Values and slopes by local quadratics, on any clock and within segments.

At each sample a parabola is fitted to the nearest samples by least squares in time; its
value and slope there are the estimate (A. Savitzky, M. J. E. Golay, "Smoothing and
differentiation of data by simplified least squares procedures", Analytical Chemistry 36
(1964), here without their even clock).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

WINDOWS = (5, 7, 9, 13, 17, 25, 35)
"""Numbers of samples to choose from."""

_CHUNK = 8192
_EVEN = 1e-9  # of a window, by which an even clock may differ
_TRIED = 20000  # samples at which windows are compared, no more


class Local(NamedTuple):
    """Local quadratics at m samples.

    Attributes
    ----------
    value : ndarray, shape (m, k)
        Of the parabola at the sample.
    slope : ndarray, shape (m, k)
        Per second.
    own : ndarray, shape (m,)
        Weight of the sample itself in its value, from 0 to 1.
    """

    value: FloatArray
    slope: FloatArray
    own: FloatArray


Around = Callable[[IntArray, IntArray], FloatArray]
"""Samples (m,) and their neighbours (m, w) -> the values there, shape (m, w, k)."""


def local_quadratics(span: FloatArray, around: FloatArray) -> Local:
    """Fit a parabola to each window and evaluate it at the sample.

    Parameters
    ----------
    span : ndarray, shape (m, w)
        Time of the neighbours less that of the sample [s].
    around : ndarray, shape (m, w, k)
        Values of the neighbours.

    Returns
    -------
    local : Local
        With fewer than three neighbours a line, with one a constant.

    Examples
    --------
    >>> span = np.array([[-1.0, 0.0, 0.5, 2.0]])
    >>> fit = local_quadratics(span, (3 + 2 * span + span**2)[..., np.newaxis])
    >>> fit.value.round(9).item(), fit.slope.round(9).item()
    (3.0, 2.0)
    """
    if np.ptp(span, axis=0).max() <= _EVEN * np.abs(span).max():
        span = span[:1]  # an even clock: one parabola's weights serve all
    size = np.abs(span).max(axis=1)
    scale = np.where(size > 0, size, 1.0)[:, np.newaxis]
    powers = np.stack([(span / scale) ** k for k in range(min(3, span.shape[1]))], axis=1)
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
) -> Local:
    """Return local quadratics at samples of a log.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Sample times [s].
    bounds : ndarray of int, shape (s, 2)
        First and one-past-last sample of each segment.
    around : callable
        Gives the values of neighbours, relative to the sample if it likes.
    window : int
        Samples under each parabola; the nearest whole window at an edge, all of a segment
        that is shorter.
    rows : ndarray of int, shape (m,), optional
        The samples wanted, in order; all where not given.

    Returns
    -------
    local : Local
        One row a sample wanted.

    Examples
    --------
    >>> time = np.array([0.0, 1, 3, 4, 6])
    >>> fit = fitted(time, np.array([[0, 5]]), lambda at, near: time[near, np.newaxis] ** 2, 5)
    >>> fit.slope[1:].ravel().round(9).tolist()
    [2.0, 6.0, 8.0, 12.0]
    """
    wanted = np.arange(len(time)) if rows is None else rows
    parts = []
    for start, stop in bounds.tolist():
        first, last = np.searchsorted(wanted, (start, stop)).tolist()
        width = min(window, stop - start)
        for low in range(first, last, _CHUNK):
            at = wanted[low : min(low + _CHUNK, last)]
            begin = np.clip(at - width // 2, start, stop - width)
            near = begin[:, np.newaxis] + np.arange(width)
            parts.append(local_quadratics(time[near] - time[at, np.newaxis], around(at, near)))
    return Local(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def best_window(
    time: FloatArray, bounds: IntArray, around: Around, windows: Sequence[int] = WINDOWS
) -> int:
    """Return the window whose parabolas best predict the sample they leave out.

    Parameters
    ----------
    time, bounds, around
        As for :func:`fitted`; values are taken as zero at the sample itself.
    windows : sequence of int, optional
        Numbers of samples to choose from.

    Returns
    -------
    window : int
        By leave-one-out cross-validation at twenty thousand samples at most.

    Examples
    --------
    >>> time = np.arange(200.0)
    >>> noise = np.random.default_rng(0).normal(size=200)
    >>> near = lambda at, near: (noise[near] - noise[at, np.newaxis])[..., np.newaxis]
    >>> best_window(time, np.array([[0, 200]]), near)
    25
    """
    rows = np.arange(0, len(time), -(-len(time) // _TRIED))
    longest = int(np.max(bounds[:, 1] - bounds[:, 0]))
    usable = [window for window in windows if window < longest] or [windows[0]]
    errors = []
    for window in usable:
        fit = fitted(time, bounds, around, window, rows)
        free = np.maximum(1.0 - fit.own, 1e-6)[:, np.newaxis]
        errors.append(float(np.mean((fit.value / free) ** 2)))
    return usable[int(np.argmin(errors))]


def window_of(time: FloatArray, bounds: IntArray, seconds: float) -> int:
    """Return how many samples a time spans: odd, five at least.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Sample times [s].
    bounds : ndarray of int, shape (s, 2)
        First and one-past-last sample of each segment.
    seconds : float
        The time [s].

    Returns
    -------
    window : int
        By the median step.

    Examples
    --------
    >>> window_of(np.arange(10) / 10, np.array([[0, 10]]), 1.0)
    11
    """
    steps = np.concatenate([np.diff(time[a:b]) for a, b in bounds])
    return max(5, 2 * round(seconds / float(np.median(steps)) / 2) + 1)

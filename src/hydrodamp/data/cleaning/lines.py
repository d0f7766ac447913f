"""Straight lines through windows that a minority of false samples cannot move.

The slope is the repeated median: over the samples, the median of the medians of the slopes
to all others (A. F. Siegel, "Robust regression using repeated medians", Biometrika 69
(1982), doi:10.1093/biomet/69.1.242). Up to half of the samples may be false.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

NORMAL = 1.482602218505602
"""Standard deviation over median absolute deviation of a normal distribution."""


def windows_about(values: FloatArray, rows: IntArray, window: int) -> FloatArray:
    """Return the neighbours of some samples.

    Parameters
    ----------
    values : ndarray, shape (n, ...)
        One segment.
    rows : ndarray of int, shape (m,)
        The samples.
    window : int
        How many neighbours, the sample itself among them.

    Returns
    -------
    around : ndarray, shape (m, window, ...)
        The nearest whole window at an edge; narrower where the segment is shorter.

    Examples
    --------
    >>> windows_about(np.arange(6.0), np.array([0, 3]), 3).tolist()
    [[0.0, 1.0, 2.0], [2.0, 3.0, 4.0]]
    """
    width = min(window, len(values))
    first = np.clip(rows - width // 2, 0, len(values) - width)
    around: FloatArray = values[first[:, np.newaxis] + np.arange(width)]
    return around


def off_the_line(time: FloatArray, around: FloatArray) -> FloatArray:
    """Return how far samples are off the line through their window.

    Parameters
    ----------
    time : ndarray, shape (m, w)
        Times of the window [s].
    around : ndarray, shape (m, w)
        Values of the window.

    Returns
    -------
    rest : ndarray, shape (m, w)
        In the unit of the values; its median is zero.

    Examples
    --------
    >>> off_the_line(np.arange(5.0)[np.newaxis], np.array([[0.0, 1, 2, 9, 4]])).tolist()
    [[0.0, 0.0, 0.0, 6.0, 0.0]]
    """
    width = around.shape[1]
    others = np.array([[k for k in range(width) if k != own] for own in range(width)])
    rise = around[:, others] - around[:, :, np.newaxis]
    run = time[:, others] - time[:, :, np.newaxis]
    slope = np.median(np.median(rise / run, axis=2), axis=1)
    level = around - slope[:, np.newaxis] * (time - time[:, :1])
    return np.asarray(level - np.median(level, axis=1, keepdims=True))

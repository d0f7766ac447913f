"""Straight lines through windows that a minority of false samples cannot move."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

NORMAL = 1.482602218505602
"""Standard deviation over median absolute deviation of a normal distribution."""


def windows_about(values: FloatArray, rows: IntArray, window: int) -> FloatArray:
    """Return the neighbours of some samples."""
    width = min(window, len(values))
    first = np.clip(rows - width // 2, 0, len(values) - width)
    around: FloatArray = values[first[:, np.newaxis] + np.arange(width)]
    return around


def off_the_line(time: FloatArray, around: FloatArray) -> FloatArray:
    """Return how far samples are off the line through their window."""
    width = around.shape[1]
    others = np.array([[k for k in range(width) if k != own] for own in range(width)])
    rise = around[:, others] - around[:, :, np.newaxis]
    run = time[:, others] - time[:, :, np.newaxis]
    slope = np.median(np.median(rise / run, axis=2), axis=1)
    level = around - slope[:, np.newaxis] * (time - time[:, :1])
    return np.asarray(level - np.median(level, axis=1, keepdims=True))

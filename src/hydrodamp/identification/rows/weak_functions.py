"""Test functions on the clock of a log: where they stand and how much each step weighs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from hydrodamp.arrays import FloatArray

_STEPS = 4096
"""Steps worked on at once: they stay in cache."""

_ROUNDING = 1e-9
"""What a support may be longer than a segment, as a share, and still fit."""


@dataclass(frozen=True, eq=False)
class Bumps:
    """Test functions next to each other, and the samples they reach."""

    centres: FloatArray
    start: int
    stop: int
    weights: csr_array


def bumps(time: FloatArray, support: float, overlap: int) -> Iterator[Bumps]:
    """Go through the test functions of one segment, some at a time."""
    if not covered(time, support):
        return
    step = float(time[-1] - time[0]) / (len(time) - 1)
    stride = max(support / overlap, step)
    centres = _centres(time, support, stride)
    taken = max(int(max(_STEPS * step, 4.0 * support) / stride), 1)
    for first in range(0, len(centres), taken):
        yield _bumps(time, centres[first : first + taken], support)


def covered(time: FloatArray, support: float) -> bool:
    """Return whether a segment is long enough for one test function."""
    return bool(time[-1] - time[0] >= support * (1.0 - _ROUNDING))


def likeness(overlap: int) -> float:
    """Return how many rows count as one: ``Σ_j ∫φ(t)φ(t + jδ)dt / ∫φ²dt``."""
    area, square = 16.0 / 15.0, 256.0 / 315.0
    return max(area**2 / square * overlap / 2.0, 1.0)


def _centres(time: FloatArray, support: float, stride: float) -> FloatArray:
    room = max(float(time[-1] - time[0]) - support, 0.0)
    n = int(room / stride * (1.0 + _ROUNDING)) + 1
    first = time[0] + 0.5 * (support + room - (n - 1) * stride)
    centres: FloatArray = first + stride * np.arange(n)
    return centres


def _bumps(time: FloatArray, centres: FloatArray, support: float) -> Bumps:
    half, latest = 0.5 * support, len(time) - 1
    first = np.maximum(np.searchsorted(time, centres - half, "right") - 1, 0)
    last = np.minimum(np.searchsorted(time, centres + half, "left"), latest)
    width = int((last - first).max())
    # Places past the support, or past the last sample, get no weight: the area there is flat.
    edges = np.minimum(first[:, None] + np.arange(width + 1), latest)
    weights = np.diff(_area((time[edges] - centres[:, None]) / half))
    start, stop = int(first[0]), int(last[-1]) + 1
    columns = np.minimum(edges[:, :-1] - start, stop - start - 2)
    rows = width * np.arange(len(centres) + 1)
    shape = (len(centres), stop - start - 1)
    sparse = csr_array((weights.ravel(), columns.ravel(), rows), shape=shape)
    return Bumps(centres, start, stop, sparse)


def _area(place: FloatArray) -> FloatArray:
    """Return the share of the bump's area left of a place, less a half."""
    s = np.clip(place, -1.0, 1.0)
    square = s * s
    area: FloatArray = s * (15.0 + square * (3.0 * square - 10.0)) / 16.0
    return area

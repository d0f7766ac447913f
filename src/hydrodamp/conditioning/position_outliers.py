"""Isolated outliers of positions: values far from a cubic through the values on either side.

The deviation of an outlier is at least six times the noise and the usual deviation, and larger than
a usual step.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.data.measurement import Measurement

#: Value minus the cubic through the two values on either side.
CUBIC_RESIDUAL = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6.0

#: Share of the values that are far from any outlier, for certain.
USUAL_SHARE = 0.75

#: Deviation of an outlier over the noise and over the usual deviation; it passes a usual step, too.
MAX_DEVIATION = 6.0


def position_outliers(measurement: Measurement, std: FloatArray) -> BoolArray:
    """Return which positions deviate from a cubic through the values on either side, (m, k)."""
    jumps = np.zeros(measurement.values.shape, dtype=bool)
    for column, noise in enumerate(std.tolist()):
        series = measurement.values[:, column]
        for number in np.unique(measurement.segment):
            rows = np.flatnonzero((measurement.segment == number) & np.isfinite(series))
            if len(rows) > len(CUBIC_RESIDUAL):
                jumps[rows[_isolated(series[rows], noise)], column] = True
    return jumps


def _isolated(series: FloatArray, noise: float) -> BoolArray:
    """Return the values of the largest deviation nearby, where it is large."""
    half = len(CUBIC_RESIDUAL) // 2
    padded = np.pad(series, half, mode="reflect", reflect_type="odd")
    deviation = np.abs(np.convolve(padded, CUBIC_RESIDUAL, mode="valid"))
    usual = max(float(np.quantile(deviation, USUAL_SHARE)), noise)
    limit = max(MAX_DEVIATION * usual, float(np.quantile(np.abs(np.diff(series)), USUAL_SHARE)))
    nearby = np.lib.stride_tricks.sliding_window_view(np.pad(deviation, half), 2 * half + 1)
    return np.asarray((deviation > limit) & (deviation >= nearby.max(axis=1)))

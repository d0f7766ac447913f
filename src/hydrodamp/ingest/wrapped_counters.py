"""Clocks whose counter wraps: 32 bits, a day or a GPS week."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import UNITS
from hydrodamp.data.record import MIN_GAP_STEPS

_DAY_SECONDS = UNITS["time"]["d"]
_PERIODS_S = (2**32 * 1e-3, 2**32 * 1e-6, _DAY_SECONDS, 7 * _DAY_SECONDS)  # 32 bits in ms and us


def unwrap_counter(time: FloatArray) -> FloatArray:
    """Return times [s] that continue where the counter wraps."""
    steps = np.diff(time)
    if not (steps < 0.0).any() or not (steps > 0.0).any():
        return time
    limit = MIN_GAP_STEPS * float(np.median(steps[steps > 0.0]))
    carry = np.zeros(len(time))
    for period in _PERIODS_S:
        wraps = (steps < 0.0) & (steps + period > 0.0) & (steps + period <= limit)
        # A sample of before the wrap, out of order after it.
        is_late = (steps < period) & (steps >= period - limit) & (np.cumsum(wraps) > 0)
        carry[1:] += period * (wraps.astype(np.float64) - is_late)
    return time + np.cumsum(carry) if carry.any() else time

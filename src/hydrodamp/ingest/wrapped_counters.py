"""Clocks whose counter wraps: 32 bits, a day or a GPS week."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.record import MIN_GAP_STEPS

_PERIODS_S = (2**32 * 1e-3, 2**32 * 1e-6, 86400.0, 604800.0)  # s; of 32 bits in ms and us


def unwrap_counter(time: FloatArray) -> FloatArray:
    """Return times [s] that continue where the counter wraps."""
    steps = np.diff(time)
    if not (backward := np.flatnonzero(steps < 0.0)).size or not (steps > 0.0).any():
        return time
    limit = MIN_GAP_STEPS * float(np.median(steps[steps > 0.0]))
    carry = np.zeros(len(time))
    for period in _PERIODS_S:
        after = steps[backward] + period
        carry[backward[(after > 0.0) & (after <= limit)] + 1] = period
    return time + np.cumsum(carry) if carry.any() else time

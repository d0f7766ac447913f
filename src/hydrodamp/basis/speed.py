"""The speed that a propulsion ratio divides by."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray

SLOWEST = 1e-6
"""Speed [m/s] below which the propulsion ratio is taken at this speed."""


def guarded_speed(velocity: npt.ArrayLike) -> FloatArray:
    """Return U, or ``SLOWEST`` where the vehicle is slower."""
    u, v, w, *_ = np.moveaxis(np.asarray(velocity, dtype=np.float64), -1, 0)
    return np.asarray(np.maximum(np.sqrt(u * u + v * v + w * w), SLOWEST))

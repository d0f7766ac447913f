"""The speed that a propulsion ratio divides by."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray

SLOWEST = 1e-6
"""Speed [m/s] below which the propulsion ratio is taken at this speed."""


def guarded_speed(velocity: npt.ArrayLike) -> FloatArray:
    """Return U, or ``SLOWEST`` where the vehicle is slower.

    It is summed in the order of the kernels, so that a ratio of one makes the
    atom ``(eta-1)`` exactly zero, sample by sample and in a batch.

    Parameters
    ----------
    velocity : array_like, shape (n, 6) or (6,)
        u v w [m/s], p q r [rad/s], body frame.

    Returns
    -------
    speed : ndarray, shape (n,) or ()
        [m/s]. In the paper U = |nu_1|.

    Examples
    --------
    >>> guarded_speed([[3.0, 4.0, 0, 0, 0, 0], [0, 0, 0, 1.0, 0, 0]]).tolist()
    [5.0, 1e-06]
    """
    u, v, w, *_ = np.moveaxis(np.asarray(velocity, dtype=np.float64), -1, 0)
    return np.asarray(np.maximum(np.sqrt(u * u + v * v + w * w), SLOWEST))

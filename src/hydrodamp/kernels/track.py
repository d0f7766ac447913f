"""How the coefficients of an online method came about."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray


@dataclass(frozen=True, eq=False, slots=True)
class Track:
    """What a run stored on its way.

    Attributes
    ----------
    time : ndarray, shape (k,)
        Of each stored step's end [s].
    by_axis : ndarray, shape (k, 6)
        One number an axis: velocity error or variance, as the method says.
    coefficients : ndarray, shape (k, n)
        After each stored step.
    """

    time: FloatArray
    by_axis: FloatArray
    coefficients: FloatArray

    @classmethod
    def empty(cls, k: int, n: int) -> Track:
        """Return room for ``k`` stored steps of ``n`` coefficients."""
        return cls(np.zeros(k), np.zeros((k, 6)), np.zeros((k, n)))

"""Rows folded into the triangle of their QR factorisation, block by block."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ProblemError

BLOCK = 768
"""Rows folded at once: they stay in cache, where columns of a power of two would collide."""

_PANEL = 8
"""Inner block of the LAPACK factorisation: narrow, so that little runs column by column."""


def fold(r: FloatArray, rows: FloatArray, *, upper: int = 0) -> FloatArray:
    """Return the triangle of one stacked on some rows; both are overwritten."""
    folded: FloatArray
    panel = min(_PANEL, len(r))
    folded, _, _, info = lapack.dtpqrt(upper, panel, r, rows, overwrite_a=True, overwrite_b=True)
    if info != 0:
        raise ProblemError(f"LAPACK dtpqrt refused argument {-info}")
    return folded


def folded_rows(r: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the triangle of one stacked on many rows."""
    r = np.asfortranarray(r)
    for first in range(0, len(rows), BLOCK):
        r = fold(r, np.array(rows[first : first + BLOCK], order="F"))
    return np.triu(r)

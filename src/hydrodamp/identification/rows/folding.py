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
    """Return the triangle of one stacked on some rows; both are overwritten.

    Parameters
    ----------
    r : ndarray, shape (m, m)
        Upper triangular, in Fortran order; what is below the diagonal is not looked at.
    rows : ndarray, shape (k, m)
        In Fortran order.
    upper : int
        The last rows of ``rows`` that are upper triangular; m for another triangle.

    Returns
    -------
    r : ndarray, shape (m, m)
        Only its upper triangle counts.

    Raises
    ------
    ProblemError
        If LAPACK refuses an argument.
    """
    folded: FloatArray
    panel = min(_PANEL, len(r))
    folded, _, _, info = lapack.dtpqrt(upper, panel, r, rows, overwrite_a=True, overwrite_b=True)
    if info != 0:
        raise ProblemError(f"LAPACK dtpqrt refused argument {-info}")
    return folded


def folded_rows(r: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the triangle of one stacked on many rows.

    Parameters
    ----------
    r : ndarray, shape (m, m)
        Upper triangular; overwritten.
    rows : ndarray, shape (k, m)
        Copied block by block.

    Returns
    -------
    r : ndarray, shape (m, m)
        Zero below the diagonal.

    Examples
    --------
    >>> rows = np.random.default_rng(0).normal(size=(2000, 3))
    >>> r = folded_rows(np.zeros((3, 3)), rows)
    >>> bool(np.allclose(r.T @ r, rows.T @ rows))
    True
    """
    r = np.asfortranarray(r)
    for first in range(0, len(rows), BLOCK):
        r = fold(r, np.array(rows[first : first + BLOCK], order="F"))
    return np.triu(r)

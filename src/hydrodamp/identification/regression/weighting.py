"""Weights across axes: what makes the residuals of several axes white together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError

_SINGULAR = 1e-12
"""Eigenvalues of a correlation matrix below this share of the largest are zero."""

_ROUNDING = 1e-9
"""Residuals below this share of the target are rounding, not noise."""

_FLOOR = 1e-5
"""Deviations of the scaled residuals below this share of the largest are raised to it."""


@dataclass(frozen=True)
class Whitening:
    """A matrix that makes residuals white."""

    matrix: FloatArray
    floored: bool = False


def whitening(left_over: FloatArray, freedom: FloatArray, size: FloatArray) -> Whitening:
    """Whiten residuals as they are found."""
    deviation = np.linalg.norm(left_over, axis=0) / np.sqrt(freedom)
    least = _ROUNDING * size / np.sqrt(freedom)
    least[least == 0.0] = 1.0
    scale = np.maximum(deviation, least)
    _, singular, right = np.linalg.svd(left_over / np.sqrt(freedom) / scale, full_matrices=False)
    floor = max(_FLOOR * float(singular.max(initial=0.0)), _FLOOR)
    floored = bool(np.any(singular < floor))
    return Whitening(right / np.maximum(singular, floor)[:, None] / scale, floored)


def checked_covariance(covariance: object) -> FloatArray:
    """Return a covariance of the wrench given by the user, copied."""
    try:
        matrix = frozen(covariance, (6, 6), "weighting")  # type: ignore[arg-type]
    except ValueError as error:
        raise MethodError(f"{error}; give the covariance of X Y Z K M N") from error
    if not np.all(np.isfinite(matrix)):
        raise MethodError("`weighting` must be finite; it is the covariance of X Y Z K M N")
    gap = np.abs(matrix - matrix.T)
    if gap.max() > _SINGULAR * np.abs(matrix).max():
        row, column = np.unravel_index(int(gap.argmax()), (6, 6))
        raise MethodError(
            f"`weighting` must be symmetric; {AXES[row]}{AXES[column]} is {matrix[row, column]:g} "
            f"and {AXES[column]}{AXES[row]} is {matrix[column, row]:g}"
        )
    return matrix


def given_whitening(covariance: FloatArray, axes: Sequence[int]) -> Whitening:
    """Whiten by a covariance given by the user."""
    part = covariance[np.ix_(axes, axes)]
    names = " ".join(AXES[axis] for axis in axes)
    scale = np.sqrt(np.maximum(np.diag(part), 0.0))
    if not np.all(scale > 0.0):
        worst = AXES[axes[int(np.argmin(scale))]]
        raise MethodError(
            f"`weighting` must have positive variances on {names}; that of {worst} is "
            f"{np.diag(part)[int(np.argmin(scale))]:g}"
        )
    values, vectors = np.linalg.eigh(part / np.outer(scale, scale))
    if values[0] <= _SINGULAR * values[-1]:
        raise MethodError(
            f"`weighting` is singular on {names}: as correlations its smallest eigenvalue is "
            f"{values[0]:.1e}. Give a positive definite covariance, or none to use that of the "
            "residuals."
        )
    return Whitening(vectors.T / np.sqrt(values)[:, None] / scale)

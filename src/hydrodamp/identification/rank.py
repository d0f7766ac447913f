"""One axis of least squares: column-scaled, rank-revealing, smallest norm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import Term
from hydrodamp.identification.triangle import Triangle

RANK_TOLERANCE = 1e-11
"""Singular values of the column-scaled triangle below this share of the largest
are zero. Columns that are equal by nature (u^2 and u|u| under way) leave about
1e-16, the worst honest design of the paper's models about 1e-9."""

_IN_NULL_SPACE = 1e-3
"""Share of a unit coefficient that must lie in the null space to be aliased."""


@dataclass(frozen=True)
class AxisSolution:
    """The coefficients of one axis.

    Attributes
    ----------
    coefficients : ndarray, shape (m,)
        Smallest norm in scaled coefficients.
    covariance : ndarray, shape (m, m)
        Of white residuals, on the subspace the data determine.
    rank : int
        How many directions the data determine.
    aliased : tuple of tuple of Term
        Terms that the data cannot tell apart, group by group.
    residual : float
        Root mean square of what is left over, [N] or [N m].
    """

    coefficients: FloatArray
    covariance: FloatArray
    rank: int
    aliased: tuple[tuple[Term, ...], ...]
    residual: float


def solve_axis(triangle: Triangle, terms: Sequence[Term], axis: int) -> AxisSolution:
    """Solve ``min |Ξ κ − σ|`` (equation 12) on one axis from the triangle.

    Parameters
    ----------
    triangle : Triangle
        Its columns hold the terms and the wrench.
    terms : sequence of Term
        The model's row.
    axis : int
        Which wrench, 0 (X) to 5 (N).

    Returns
    -------
    solution : AxisSolution
        Coefficients, rank and aliases.
    """
    chosen = [triangle.basis.index(term) for term in terms]
    target = len(triangle.basis) + axis
    design = triangle.r[:, chosen]
    if not chosen:
        residual = _rms(triangle.r[:, target], triangle.n_samples)
        return AxisSolution(np.zeros(0), np.zeros((0, 0)), 0, (), residual)
    scale = np.linalg.norm(design, axis=0)
    scale[scale == 0.0] = 1.0
    left, singular, right = np.linalg.svd(design / scale, full_matrices=False)
    kept = singular > RANK_TOLERANCE * singular[0] if singular[0] > 0.0 else singular > 0.0
    inverse = np.where(kept, 1.0 / np.where(kept, singular, 1.0), 0.0)
    scaled = right.T @ (inverse * (left.T @ triangle.r[:, target]))
    left_over = triangle.r[:, target] - design @ (scaled / scale)
    rank = int(kept.sum())
    freedom = max(triangle.n_samples - rank, 1)
    half = right.T * inverse / scale[:, None]
    return AxisSolution(
        coefficients=scaled / scale,
        covariance=half @ half.T * (float(left_over @ left_over) / freedom),
        rank=rank,
        aliased=_aliased(terms, right[~kept]),
        residual=_rms(left_over, triangle.n_samples),
    )


def _rms(rest: FloatArray, n_samples: int) -> float:
    return float(np.linalg.norm(rest) / np.sqrt(max(n_samples, 1)))


def _aliased(terms: Sequence[Term], null: FloatArray) -> tuple[tuple[Term, ...], ...]:
    """Group the terms that the null space mixes: connected entries of its projector."""
    projector = np.abs(null.T @ null)
    linked = projector > _IN_NULL_SPACE
    left = [i for i in range(len(terms)) if linked[i, i]]
    groups: list[tuple[Term, ...]] = []
    while left:
        group, front = {left[0]}, {left[0]}
        while front:
            near = {j for i in front for j in left if linked[i, j]}
            front = near - group
            group |= near
        groups.append(tuple(terms[i] for i in sorted(group)))
        left = [i for i in left if i not in group]
    return tuple(groups)

"""What columns span, and one axis of least squares: scaled, rank-revealing, smallest norm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.identification.rows.triangle import Triangle

RANK_TOLERANCE = 1e-11
"""Singular values of the column-scaled triangle below this share of the largest
are zero. Columns that are equal by nature (u^2 and u|u| under way) leave about
1e-16, the worst honest design of the paper's models about 1e-9."""

_IN_NULL_SPACE = 1e-3
"""Share of a unit coefficient that must lie in the null space to be aliased."""

Name = TypeVar("Name")
"""Whatever names a column: a term, or a label."""


@dataclass(frozen=True)
class AxisSolution:
    """The coefficients of one axis."""

    coefficients: FloatArray
    covariance: FloatArray
    rank: int
    aliased: tuple[tuple[Term, ...], ...]
    residual: float


def group_labels(
    by_axis: Iterable[tuple[int, Iterable[Sequence[Term | str]]]],
) -> tuple[tuple[str, ...], ...]:
    """Return groups of terms as groups of labels."""
    return tuple(
        tuple(f"{AXES[axis]}_{term}" for term in group)
        for axis, groups in by_axis
        for group in groups
    )


@dataclass(frozen=True)
class Span(Generic[Name]):
    """What the data determine of the coefficients of some columns."""

    directions: FloatArray
    coefficients: FloatArray
    singular: FloatArray
    aliased: tuple[tuple[Name, ...], ...]

    @property
    def rank(self) -> int:
        """How many directions there are."""
        return len(self.singular)


def spanned(
    design: FloatArray, names: Sequence[Name], scale: FloatArray | None = None
) -> Span[Name]:
    """Find what the columns of a design span."""
    if not len(names):
        return Span(np.zeros((len(design), 0)), np.zeros((0, 0)), np.zeros(0), ())
    unit = np.linalg.norm(design, axis=0) if scale is None else scale
    unit = np.where(unit == 0.0, 1.0, unit)
    left, singular, right = np.linalg.svd(design / unit, full_matrices=False)
    kept = singular > RANK_TOLERANCE * singular[0] if singular[0] > 0.0 else singular > 0.0
    return Span(
        directions=left[:, kept],
        coefficients=(right[kept].T / singular[kept]) / unit[:, None],
        singular=singular[kept],
        aliased=_aliased(names, right[kept]),
    )


def solve_axis(triangle: Triangle, terms: Sequence[Term], axis: int) -> AxisSolution:
    """Solve ``min |Ξ κ − σ|`` (equation 12) on one axis from the triangle."""
    span = spanned(triangle.r[:, [triangle.basis.index(term) for term in terms]], terms)
    target = triangle.r[:, len(triangle.basis) + axis]
    explained = span.directions.T @ target
    left_over = target - span.directions @ explained
    freedom = max(triangle.n_samples - span.rank, 1)
    return AxisSolution(
        coefficients=span.coefficients @ explained,
        covariance=span.coefficients
        @ span.coefficients.T
        * (float(left_over @ left_over) / freedom),
        rank=span.rank,
        aliased=span.aliased,
        residual=_rms(left_over, triangle.n_samples),
    )


def _rms(rest: FloatArray, n_samples: int) -> float:
    return float(np.linalg.norm(rest) / np.sqrt(max(n_samples, 1)))


def _aliased(names: Sequence[Name], seen: FloatArray) -> tuple[tuple[Name, ...], ...]:
    """Group the columns that the null space mixes: connected entries of its projector."""
    projector = np.abs(np.eye(len(names)) - seen.T @ seen)
    linked = projector > _IN_NULL_SPACE
    left = [i for i in range(len(names)) if linked[i, i]]
    groups: list[tuple[Name, ...]] = []
    while left:
        group, front = {left[0]}, {left[0]}
        while front:
            near = {j for i in front for j in left if linked[i, j]}
            front = near - group
            group |= near
        groups.append(tuple(names[i] for i in sorted(group)))
        left = [i for i in left if i not in group]
    return tuple(groups)

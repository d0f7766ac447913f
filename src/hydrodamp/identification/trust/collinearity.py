"""Columns that look alike: condition, variance inflation, groups not told apart.

After D. A. Belsley, E. Kuh and R. E. Welsch, "Regression Diagnostics" (1980),
doi:10.1002/0471725153, chapter 3: columns are scaled to unit length and not centred; a
singular value is a dependency if it is small against the largest; a coefficient takes
part in a dependency if most of its variance comes from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic

import numpy as np
from scipy.sparse.csgraph import connected_components

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.identification.rows.rank import Name, Span, spanned

HIGH = 30.0
"""Condition index from which a dependency counts as strong (Belsley, Kuh and Welsch)."""

_MOST = 0.5
"""Share of its variance that makes a coefficient part of dependencies (the same)."""

_LINKED = 0.5
"""Correlation of the estimates that puts two coefficients into the same group."""


@dataclass(frozen=True, eq=False)
class Collinearity(Generic[Name]):
    """How far the columns of one axis can be told apart.

    Attributes
    ----------
    span : Span
        What the columns span.
    condition : float
        Largest over smallest singular value of the scaled columns; infinite where the
        rank is not full, 1 without columns.
    inflation : ndarray, shape (m,)
        Variance inflation factor: by how much the other columns multiply the variance of
        a coefficient; infinite where it is aliased.
    aliased : ndarray of bool, shape (m,)
        Whether the column is zero, or the null space takes part in the coefficient.
    groups : tuple of tuple
        Names not told apart: exactly alike first, then nearly alike.
    """

    span: Span[Name]
    condition: float
    inflation: FloatArray
    aliased: BoolArray
    groups: tuple[tuple[Name, ...], ...]


def collinearity(design: FloatArray, names: Sequence[Name]) -> Collinearity[Name]:
    """Examine the columns of a design.

    Parameters
    ----------
    design : ndarray, shape (h, m)
        Rows of a regression, or their triangle.
    names : sequence
        One a column.

    Returns
    -------
    collinearity : Collinearity
        Of the column-scaled design.

    Examples
    --------
    >>> design = np.array([[1.0, 1.0, 0.0], [1.0, 1.001, 0.0], [1.0, 1.0, 5.0], [1.0, 1.0, 0.0]])
    >>> found = collinearity(design, "abc")
    >>> found.groups, bool(found.condition > HIGH), round(float(found.inflation[2]), 2)
    ((('a', 'b'),), True, 1.5)
    """
    span = spanned(design, names)
    lost = {name for group in span.aliased for name in group}
    aliased = np.array([name in lost for name in names], dtype=bool)
    length = np.linalg.norm(design, axis=0)
    parts = (span.coefficients * length[:, None]) ** 2
    inflation = np.where(aliased, np.inf, parts.sum(axis=1))
    return Collinearity(
        span=span,
        condition=_condition(span, len(names)),
        inflation=inflation,
        aliased=aliased,
        groups=span.aliased + _near(span, parts, aliased, names),
    )


def _condition(span: Span[Name], n_columns: int) -> float:
    if not n_columns:
        return 1.0
    if span.rank < n_columns:
        return float("inf")
    return float(span.singular[0] / span.singular[-1])


def _near(
    span: Span[Name], parts: FloatArray, aliased: BoolArray, names: Sequence[Name]
) -> tuple[tuple[Name, ...], ...]:
    """Group coefficients whose variance comes from strong dependencies."""
    if not span.rank:
        return ()
    strong = span.singular[0] > HIGH * span.singular
    whole = parts.sum(axis=1)
    share = parts[:, strong].sum(axis=1) / np.where(whole > 0.0, whole, 1.0)
    members = np.flatnonzero((share > _MOST) & ~aliased)
    deviation = np.sqrt(np.sum(span.coefficients[members] ** 2, axis=1))
    scaled = span.coefficients[members] / deviation[:, None]
    count, label = connected_components(np.abs(scaled @ scaled.T) > _LINKED, directed=False)
    groups = [members[label == one] for one in range(count)]
    return tuple(tuple(names[i] for i in group) for group in groups if len(group) > 1)

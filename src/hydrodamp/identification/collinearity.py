"""Columns that look alike: condition, variance inflation, groups not told apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic

import numpy as np
from scipy.sparse.csgraph import connected_components

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.identification.triangle import Name, Span, spanned

#: Condition index from which a dependency counts as strong (Belsley, Kuh and Welsch).
HIGH = 30.0

# Share of its variance that makes a coefficient part of dependencies (the same), and correlation
# of the estimates that puts two coefficients into the same group.
_MOST, _LINKED = 0.5, 0.5


@dataclass(frozen=True, eq=False)
class Collinearity(Generic[Name]):
    """How far the columns of one axis can be told apart."""

    span: Span[Name]
    condition: float
    inflation: FloatArray
    aliased: BoolArray
    groups: tuple[tuple[Name, ...], ...]


def collinearity(design: FloatArray, names: Sequence[Name]) -> Collinearity[Name]:
    """Examine the columns of a design, scaled to unit length."""
    span = spanned(design, names)
    lost = {name for group in span.aliased for name in group}
    aliased = np.array([name in lost for name in names], dtype=bool)
    length = np.linalg.norm(design, axis=0)
    parts = (span.coefficients * length[:, None]) ** 2
    condition = float(span.singular[0] / span.singular[-1]) if span.rank else 1.0
    return Collinearity(
        span=span,
        condition=condition if span.rank == len(names) else float("inf"),
        inflation=np.where(aliased, np.inf, parts.sum(axis=1)),
        aliased=aliased,
        groups=span.aliased + _near(span, parts, aliased, names),
    )


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

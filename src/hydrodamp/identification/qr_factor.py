"""The sufficient statistic of least squares, a mergeable triangle, and what its columns span."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from scipy.linalg import lapack
from scipy.sparse.csgraph import connected_components

from hydrodamp.arrays import FloatArray, factorisation, frozen
from hydrodamp.basis.atoms import AXES
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import Term
from hydrodamp.errors import ProblemError

# Rows folded at once: they stay in cache, where columns of a power of two would collide.
BLOCK = 768

# Inner block of the LAPACK factorisation: narrow, so that little runs column by column.
_PANEL = 8

# Singular values of the column-scaled triangle below this share of the largest are zero. Columns
# that are equal by nature (u^2 and u|u| under way) leave about 1e-16, the worst honest design of
# the paper's models about 1e-9.
RANK_TOLERANCE = 1e-11

# Share of a unit coefficient that must lie in the null space to be aliased.
_IN_NULL_SPACE = 1e-3

# Whatever names a column: a term, or a label.
Name = TypeVar("Name")


@dataclass(frozen=True)
class Triangle:
    """The triangle of a QR factorisation of ``[ξᵀ τᵀ]``.

    It belongs to one vehicle, one velocity record and one derivative.

    Attributes
    ----------
    basis : Basis
        The unknown columns, in order; the six columns of the wrench follow.
    r : ndarray, shape (n_terms + 6, n_terms + 6)
        Upper triangular.
    n_samples : int
        Samples folded in.
    """

    basis: Basis
    r: FloatArray
    n_samples: int

    @classmethod
    def of(cls, basis: Basis, blocks: Iterable[FloatArray]) -> Triangle:
        """Fold blocks of rows ``[ξᵀ τᵀ]``, which are overwritten where they are Fortran-ordered."""
        size, n_samples = len(basis) + 6, 0
        r = np.zeros((size, size), order="F")
        for rows in blocks:
            n_samples += len(rows)
            r = _fold(r, rows)
        return cls(basis, frozen(np.triu(r)), n_samples)

    def merge(self, other: Triangle) -> Triangle:
        """Return the triangle of both sets of samples.

        Parameters
        ----------
        other : Triangle
            Of the same terms.

        Returns
        -------
        triangle : Triangle
            As if all samples had been folded into one.

        Raises
        ------
        ProblemError
            If the terms differ.
        """
        if self.basis != other.basis:
            raise ProblemError("triangles of different terms cannot be merged")
        r = _fold(self.r.copy(order="F"), other.r.copy(order="F"), upper=len(self.r))
        return Triangle(self.basis, frozen(np.triu(r)), self.n_samples + other.n_samples)

    @cached_property
    def _places(self) -> dict[Term, int]:
        return {term: place for place, term in enumerate(self.basis)}

    def columns(self, terms: Sequence[Term]) -> FloatArray:
        """Return the columns of some terms."""
        return self.r[:, [self._places[term] for term in terms]]

    def span(self, terms: tuple[Term, ...]) -> Span[Term]:
        """Return what the columns of some terms span, scaled to length one."""
        if terms not in self._spans:
            self._spans[terms] = column_span(self.columns(terms), terms)
        return self._spans[terms]

    @cached_property
    def _spans(self) -> dict[tuple[Term, ...], Span[Term]]:
        return {}

    def target(self, axis: int) -> FloatArray:
        """Return the column of the wrench on one axis."""
        return self.r[:, len(self.basis) + axis]


def merge(triangles: Iterable[Triangle]) -> Triangle:
    """Merge triangles of the same terms.

    Parameters
    ----------
    triangles : iterable of Triangle
        At least one; from segments, files, processes or machines.

    Returns
    -------
    triangle : Triangle
        As if all samples had been folded into one.

    Raises
    ------
    ProblemError
        If there is none or the terms differ.
    """
    result: Triangle | None = None
    for triangle in triangles:
        result = triangle if result is None else result.merge(triangle)
    if result is None:
        raise ProblemError("merge needs at least one triangle, got none")
    return result


def update_factor(r: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the triangle of one stacked on many rows."""
    r = np.asfortranarray(r)
    for first in range(0, len(rows), BLOCK):
        r = _fold(r, np.array(rows[first : first + BLOCK], order="F"))
    return np.triu(r)


def _fold(r: FloatArray, rows: FloatArray, *, upper: int = 0) -> FloatArray:
    """Return the triangle of one stacked on some rows; both are overwritten."""
    panel = min(_PANEL, len(r))
    folded: FloatArray = lapack.dtpqrt(upper, panel, r, rows, overwrite_a=True, overwrite_b=True)[0]
    return folded


@dataclass(frozen=True)
class Span(Generic[Name]):
    """What the data determine of the coefficients of some columns.

    ``directions`` (rows, rank) are orthonormal, ``coefficients`` (n, rank) make each of them.
    """

    directions: FloatArray
    coefficients: FloatArray
    singular: FloatArray
    aliased: tuple[tuple[Name, ...], ...]

    @property
    def rank(self) -> int:
        """How many directions there are."""
        return len(self.singular)


@factorisation("design matrix")
def column_span(
    design: FloatArray, names: Sequence[Name], scale: FloatArray | None = None
) -> Span[Name]:
    """Find what the columns of a design span."""
    if not len(names):
        return Span(np.zeros((len(design), 0)), np.zeros((0, 0)), np.zeros(0), ())
    unit = np.linalg.norm(design, axis=0) if scale is None else scale
    unit = np.where(unit == 0.0, 1.0, unit)
    left, singular, right = np.linalg.svd(design / unit, full_matrices=False)
    right[:, ~np.any(design, axis=0)] = 0.0  # the decomposition leaves 1e-17 in columns of zeros
    kept = singular > RANK_TOLERANCE * singular[0] if singular[0] > 0.0 else singular > 0.0
    return Span(
        directions=left[:, kept],
        coefficients=(right[kept].T / singular[kept]) / unit[:, None],
        singular=singular[kept],
        aliased=_aliased(names, right[kept]),
    )


@dataclass(frozen=True)
class AxisSolution:
    """The coefficients of one axis; ``share`` is what is left of each direction of the span."""

    span: Span[Term]
    share: FloatArray
    coefficients: FloatArray
    covariance: FloatArray
    residual: float


def solve_axis(
    triangle: Triangle, terms: tuple[Term, ...], axis: int, strength: float = 0.0
) -> AxisSolution:
    """Solve ``min |Ξ κ − σ|² / n + strength |S κ|²`` on one axis (equation 12 for strength 0).

    S is the root mean square of each column. Residuals count as white in the covariance.
    """
    n = max(triangle.n_samples, 1)
    span, target = triangle.span(terms), triangle.target(axis)
    square = span.singular**2
    share = square / (square + strength)
    amounts = share * (span.directions.T @ target)
    left_over = float(np.linalg.norm(target - span.directions @ amounts))
    variance = left_over**2 / max(n - float(share.sum()), 1.0)
    return AxisSolution(
        span=span,
        share=share,
        coefficients=span.coefficients @ amounts,
        covariance=(span.coefficients * share) @ span.coefficients.T * variance,
        residual=left_over / np.sqrt(n),
    )


def group_labels(by_axis: Iterable[Iterable[Sequence[Term]]]) -> tuple[tuple[str, ...], ...]:
    """Return groups of terms, axis by axis, as groups of labels."""
    return tuple(
        tuple(f"{axis}_{term}" for term in group)
        for axis, groups in zip(AXES, by_axis, strict=True)
        for group in groups
    )


def _aliased(names: Sequence[Name], seen: FloatArray) -> tuple[tuple[Name, ...], ...]:
    """Group the columns that the null space mixes: connected entries of its projector."""
    null = np.abs(np.eye(len(names)) - seen.T @ seen)
    places = np.flatnonzero(np.diag(null) > _IN_NULL_SPACE)
    if not len(places):
        return ()
    linked = null[np.ix_(places, places)] > _IN_NULL_SPACE
    n_groups, group = connected_components(linked, directed=False)
    members = (places[group == one].tolist() for one in range(n_groups))
    return tuple(tuple(names[place] for place in one) for one in members)

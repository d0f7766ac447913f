"""Mergeable QR factors of the regression, and least squares by SVD of the R factor.

With ``[Ξ σ] = Q R``, R is a sufficient statistic: R factors of two data sets merge into one, and
``min |Ξ κ − σ|²`` is solved from it per axis with rank and aliased columns.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from scipy.linalg import lapack
from scipy.sparse.csgraph import connected_components

from hydrodamp.arrays import FloatArray, factorisation, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import AXES, Term
from hydrodamp.errors import ProblemError

# Rows factorised together: they fit the cache, where powers of two would cause conflicts.
BLOCK = 768

# Inner block size of the LAPACK factorisation dtpqrt.
_PANEL_WIDTH = 8

# Singular values of the column-scaled R factor below this share of the largest count as zero.
# Identical columns (u^2 and u|u| under way) give about 1e-16, the worst full-rank design of
# the paper's models about 1e-9.
RANK_TOLERANCE = 1e-11

# Least entry of the null-space projector that makes columns aliased.
_NULL_SPACE_SHARE = 1e-3

# Identifier of a column: a term or a label.
Name = TypeVar("Name")


@dataclass(frozen=True)
class Triangle:
    """R factor of the QR factorisation of ``[Ξ σ]`` with rows ``[ξᵀ τᵀ]``.

    It is specific to one vehicle, log and derivative.

    Attributes
    ----------
    basis : Basis
        Terms of the first columns; the six columns of the wrench follow.
    r : ndarray, shape (n_terms + 6, n_terms + 6)
        Upper triangular.
    n_samples : int
        Number of rows.
    """

    basis: Basis
    r: FloatArray
    n_samples: int

    @classmethod
    def of(cls, basis: Basis, blocks: Iterable[FloatArray]) -> Triangle:
        """Factorise blocks of rows ``[ξᵀ τᵀ]``; Fortran-ordered blocks are overwritten."""
        size, n_samples = len(basis) + 6, 0
        r = np.zeros((size, size), order="F")
        for rows in blocks:
            n_samples += len(rows)
            r = _factorise(r, rows)
        return cls(basis, frozen(np.triu(r)), n_samples)

    def merge(self, second: Triangle) -> Triangle:
        """Return the R factor of both sets of samples.

        Parameters
        ----------
        second : Triangle
            Of the same terms.

        Returns
        -------
        triangle : Triangle
            Equal to that of all samples together.

        Raises
        ------
        ProblemError
            If the terms differ.
        """
        if self.basis != second.basis:
            raise ProblemError("R factors of different terms cannot be merged")
        r = _factorise(self.r.copy(order="F"), second.r.copy(order="F"), upper=len(self.r))
        return Triangle(self.basis, frozen(np.triu(r)), self.n_samples + second.n_samples)

    @cached_property
    def _indices(self) -> dict[Term, int]:
        return {term: index for index, term in enumerate(self.basis)}

    def columns(self, terms: Sequence[Term]) -> FloatArray:
        """Return the columns of some terms."""
        return self.r[:, [self._indices[term] for term in terms]]

    def span(self, terms: tuple[Term, ...]) -> Span[Term]:
        """Return the SVD of the columns of some terms, scaled to unit length."""
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
    """Merge R factors of the same terms.

    Parameters
    ----------
    triangles : iterable of Triangle
        At least one; from segments, files, processes or machines.

    Returns
    -------
    triangle : Triangle
        Equal to that of all samples together.

    Raises
    ------
    ProblemError
        If the iterable is empty or the terms differ.
    """
    result: Triangle | None = None
    for triangle in triangles:
        result = triangle if result is None else result.merge(triangle)
    if result is None:
        raise ProblemError("merge needs at least one R factor, got none")
    return result


def update_factor(r: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the R factor of ``r`` stacked on rows."""
    r = np.asfortranarray(r)
    for first in range(0, len(rows), BLOCK):
        r = _factorise(r, np.array(rows[first : first + BLOCK], order="F"))
    return np.triu(r)


def _factorise(r: FloatArray, rows: FloatArray, *, upper: int = 0) -> FloatArray:
    """Return the R factor of ``r`` stacked on one block of rows; both are overwritten."""
    panel = min(_PANEL_WIDTH, len(r))
    factor: FloatArray = lapack.dtpqrt(upper, panel, r, rows, overwrite_a=True, overwrite_b=True)[0]
    return factor


@dataclass(frozen=True)
class Span(Generic[Name]):
    """Column space of a design: SVD with rank and aliased columns.

    ``directions`` (rows, rank) are orthonormal; ``coefficients`` (n, rank) map to them.
    """

    directions: FloatArray
    coefficients: FloatArray
    singular: FloatArray
    aliased: tuple[tuple[Name, ...], ...]

    @property
    def rank(self) -> int:
        """Rank of the design."""
        return len(self.singular)


@factorisation("design matrix")
def column_span(
    design: FloatArray, names: Sequence[Name], scale: FloatArray | None = None
) -> Span[Name]:
    """Return the SVD of a column-scaled design, its rank, and the aliased columns."""
    if not len(names):
        return Span(np.zeros((len(design), 0)), np.zeros((0, 0)), np.zeros(0), ())
    unit = np.linalg.norm(design, axis=0) if scale is None else scale
    unit = np.where(unit == 0.0, 1.0, unit)
    u, singular, vt = np.linalg.svd(design / unit, full_matrices=False)
    vt[:, ~np.any(design, axis=0)] = 0.0  # rounding makes about 1e-17 in columns of zeros
    nonzero = singular > RANK_TOLERANCE * singular[0] if singular[0] > 0.0 else singular > 0.0
    return Span(
        directions=u[:, nonzero],
        coefficients=(vt[nonzero].T / singular[nonzero]) / unit[:, None],
        singular=singular[nonzero],
        aliased=_aliased(names, vt[nonzero]),
    )


@dataclass(frozen=True)
class AxisSolution:
    """Solution of one axis; ``share`` is the shrinkage factor of each singular direction."""

    span: Span[Term]
    share: FloatArray
    coefficients: FloatArray
    covariance: FloatArray
    residual: float


def solve_axis(
    triangle: Triangle, terms: tuple[Term, ...], axis: int, strength: float = 0.0
) -> AxisSolution:
    """Solve ``min |Ξ κ − σ|² / n + strength |S κ|²`` on one axis (equation 12 for strength 0).

    S is the root mean square of each column. The covariance assumes white residuals.
    """
    n = max(triangle.n_samples, 1)
    span, target = triangle.span(terms), triangle.target(axis)
    square = span.singular**2
    share = square / (square + strength)
    amounts = share * (span.directions.T @ target)
    residual_norm = float(np.linalg.norm(target - span.directions @ amounts))
    variance = residual_norm**2 / max(n - float(share.sum()), 1.0)
    return AxisSolution(
        span=span,
        share=share,
        coefficients=span.coefficients @ amounts,
        covariance=(span.coefficients * share) @ span.coefficients.T * variance,
        residual=residual_norm / np.sqrt(n),
    )


def group_labels(by_axis: Iterable[Iterable[Sequence[Term]]]) -> tuple[tuple[str, ...], ...]:
    """Return the labels of groups of terms, given per axis."""
    return tuple(
        tuple(f"{axis}_{term}" for term in group)
        for axis, groups in zip(AXES, by_axis, strict=True)
        for group in groups
    )


def _aliased(names: Sequence[Name], row_space: FloatArray) -> tuple[tuple[Name, ...], ...]:
    """Group columns by the connected components of the null-space projector."""
    null = np.abs(np.eye(len(names)) - row_space.T @ row_space)
    columns = np.flatnonzero(np.diag(null) > _NULL_SPACE_SHARE)
    if not len(columns):
        return ()
    linked = null[np.ix_(columns, columns)] > _NULL_SPACE_SHARE
    n_groups, group = connected_components(linked, directed=False)
    members = (columns[group == k].tolist() for k in range(n_groups))
    return tuple(tuple(names[index] for index in indices) for indices in members)

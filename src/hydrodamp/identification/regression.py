"""Rows of the regression ``σ = Ξ κ`` (equation 3), their QR factors, least squares and folds.

With ``[Ξ σ] = Q R``, R is a sufficient statistic: R factors of two data sets merge into one, and
``min |Ξ κ − σ|²`` is solved from it per axis, by SVD, with rank and aliased columns. Rows are
divided into folds for cross-validation.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Generic, Protocol, TypeVar

import numpy as np
from scipy.linalg import lapack
from scipy.sparse.csgraph import connected_components

from hydrodamp.arrays import FloatArray, IntArray, factorisation, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.basis.term import AXES, Term
from hydrodamp.errors import MethodError, ProblemError, demand
from hydrodamp.identification.differentiation import (
    Derivative,
    default_derivative,
    velocity_correlation_time,
)
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem

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
    remaining = iter(triangles)
    if (first := next(remaining, None)) is None:
        raise ProblemError("merge needs at least one R factor, got none")
    return reduce(Triangle.merge, remaining, first)


def update_factor(r: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the R factor of ``r`` stacked on rows."""
    r = np.asfortranarray(r)
    for first in range(0, len(rows), BLOCK):
        r = _factorise(r, np.array(rows[first : first + BLOCK], order="F"))
    return np.triu(r)


def _factorise(r: FloatArray, rows: FloatArray, *, upper: int = 0) -> FloatArray:
    """Return the R factor of ``r`` stacked on one block of rows; both are overwritten."""
    panel = min(_PANEL_WIDTH, len(r))
    return np.asarray(lapack.dtpqrt(upper, panel, r, rows, overwrite_a=True, overwrite_b=True)[0])


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
    directions, singular, row_space = u[:, nonzero], singular[nonzero], vt[nonzero]
    coefficients = (row_space.T / singular) / unit[:, None]
    return Span(directions, coefficients, singular, _aliased(names, row_space))


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
    coefficients = span.coefficients @ amounts
    covariance = (span.coefficients * share) @ span.coefficients.T * variance
    return AxisSolution(span, share, coefficients, covariance, residual_norm / np.sqrt(n))


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


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of the regression, in the order of time within each segment.

    Attributes
    ----------
    basis : Basis
        The unknown terms.
    design : ndarray, shape (m, n_terms)
        The regressors; in the paper the rows ξᵀ of Ξ.
    target : ndarray, shape (m, 6)
        The damping wrench σ = M ν̇ − H(Mν)ν − G − u, force X Y Z [N] and moment K M N [N m],
        body frame, on the right-hand side of equation 1: it opposes the motion.
    segment : ndarray of int, shape (m,)
        Segment number of each row, non-decreasing.
    time : ndarray, shape (m,)
        Time of each row [s], increasing within a segment.
    n_samples : int
        Number of samples of the log that the rows use.
    variance_inflation : float
        Number of rows that count as one for white noise, due to overlap of test functions.
    remarks : tuple of str
        Messages on how the rows were computed.
    time_scale : float
        Correlation time of the velocities [s]; zero where it is unknown.
    """

    basis: Basis
    design: FloatArray
    target: FloatArray
    segment: IntArray
    time: FloatArray
    n_samples: int = 0
    variance_inflation: float = 1.0
    remarks: tuple[str, ...] = ()
    time_scale: float = 0.0

    @property
    def n(self) -> int:
        """Number of rows."""
        return len(self.time)

    def select(self, index: IntArray) -> Rows:
        """Return a subset of the rows.

        Parameters
        ----------
        index : ndarray of int or bool
            Increasing indices, or a mask.

        Returns
        -------
        rows : Rows
            In the same order.
        """
        names = ("design", "target", "segment", "time")
        return replace(self, **{name: getattr(self, name)[index] for name in names})

    def triangle(self) -> Triangle:
        """Return the R factor of these rows, a sufficient statistic for every model.

        Returns
        -------
        triangle : Triangle
            As from :func:`accumulate`.
        """
        slices = (slice(first, first + BLOCK) for first in range(0, self.n, BLOCK))
        blocks = (np.hstack([self.design[rows], self.target[rows]]) for rows in slices)
        return Triangle.of(self.basis, blocks)


def residuals(rows: Rows, damping: Damping) -> FloatArray:
    """Return the residuals ``σ − Ξ κ`` of each axis, shape (m, 6)."""
    model = damping.model
    columns = [rows.basis.index(term) for term in model.basis]
    return np.asarray(rows.target - rows.design[:, columns] @ damping.matrix.T)


class RegressionForm(Protocol):
    """A form of the regression: maps a problem to rows without unknown acceleration."""

    def rows(self, problem: Problem) -> Rows:
        """Return all rows of a problem."""
        ...


@dataclass(frozen=True)
class PointwiseRegression:
    """One row per sample, with the acceleration from a derivative, as in section III.

    Parameters
    ----------
    derivative : Derivative, optional
        The recorded acceleration where the log has it, else finite differences.

    Examples
    --------
    >>> PointwiseRegression()
    PointwiseRegression(derivative=None)
    """

    derivative: Derivative | None = None

    def rows(self, problem: Problem) -> Rows:
        """Return one row per sample; held inputs pass through the filter of the derivative."""
        derivative = self.derivative or default_derivative(problem)
        acceleration = derivative.acceleration(problem)
        filtered = derivative.filter_held_inputs(problem)
        regressor, basis = filtered.regressor(), problem.equations.basis
        design = regressor[:, problem.equations.n_known :]
        target = _damping_wrench(filtered, acceleration, regressor, slice(None))
        segment, time = problem.segment_numbers, problem.inputs.time
        time_scale = velocity_correlation_time(problem)
        return Rows(basis, design, target, segment, time, problem.n_samples, time_scale=time_scale)


def accumulate(problem: Problem, derivative: Derivative | None = None) -> Triangle:
    """Return the R factor of a problem without storing the rows.

    Parameters
    ----------
    problem : Problem
        Samples and terms.
    derivative : Derivative, optional
        Source of the acceleration; by default the recorded one where there is one, else
        finite differences.

    Returns
    -------
    triangle : Triangle
        Held inputs pass through the filter of the derivative. It takes 8 (n_terms + 6)^2 bytes
        for a log of any length; an estimated acceleration takes 48 bytes per sample
        temporarily.
    """
    estimator = derivative or default_derivative(problem)
    acceleration = estimator.acceleration(problem)
    filtered = estimator.filter_held_inputs(problem)
    known, n = problem.equations.n_known, problem.n_samples

    def blocks() -> Iterator[FloatArray]:
        for first in range(0, n, BLOCK):
            block = slice(first, min(first + BLOCK, n))
            size = (block.stop - first, known + len(problem.equations.basis) + 6)
            rows = np.empty(size, order="F")
            regressor = filtered.regressor(first, block.stop, out=rows[:, :-6])
            rows[:, -6:] = _damping_wrench(filtered, acceleration, regressor, block)
            yield rows[:, known:]

    return Triangle.of(problem.equations.basis, blocks())


def damping_wrench(problem: Problem, acceleration: FloatArray) -> FloatArray:
    """Return the damping wrench of equation 3, ``τ = M ν̇ − H(Mν)ν − G − u``.

    It includes all errors of the known terms.

    Parameters
    ----------
    problem : Problem
        Vehicle and log.
    acceleration : ndarray, shape (n, 6)
        Of all samples of the problem, linear [m/s^2] and angular [rad/s^2].

    Returns
    -------
    wrench : ndarray, shape (n, 6)
        Force X Y Z [N] and moment K M N [N m], body frame, on the right-hand
        side of equation 1: it opposes the motion. Zero on locked axes.
    """
    return _damping_wrench(problem, acceleration, problem.regressor(), slice(None))


def _damping_wrench(
    problem: Problem, acceleration: FloatArray, regressor: FloatArray, block: slice
) -> FloatArray:
    mass = problem.vehicle.mass_matrix
    known = regressor[:, : problem.equations.n_known] @ problem.equations.known
    inertial = acceleration[block] @ mass
    coriolis = core.coriolis(mass, problem.inputs.velocity[block])
    return (inertial - coriolis - known - problem.inputs.wrench[block]) * problem.vehicle.free


# Default number of folds: at most, for several segments; and for a single one.
_MAX_FOLDS, _SINGLE_SEGMENT_FOLDS = 10, 5

# Default gap around a cut over the correlation time of the velocities.
_RELATIVE_GAP = 0.4


@dataclass(frozen=True)
class Split:
    """R factors of the training rows and of one held-out fold."""

    train: Triangle
    test: Triangle


@dataclass(frozen=True, eq=False)
class Folds:
    """Assignment of rows to cross-validation folds.

    Attributes
    ----------
    fold : ndarray of int, shape (m,)
        Number of the fold from 0, or -1 for a row in the gap around a cut.
    n : int
        Number of folds, at least two; none is empty.
    description : str
        How the rows were divided, as read in messages.
    """

    fold: IntArray
    n: int
    description: str

    def splits(self, rows: Rows) -> tuple[Split, ...]:
        """Return the R factors of every fold.

        Parameters
        ----------
        rows : Rows
            The rows that were divided.

        Returns
        -------
        splits : tuple of Split
            One per fold. The training R factors are merged from those of the folds.
        """
        tests = [rows.select(self.fold == k).triangle() for k in range(self.n)]
        return tuple(Split(merge(tests[:k] + tests[k + 1 :]), test) for k, test in enumerate(tests))


def folds(rows: Rows, n: int | None = None, gap: float | None = None) -> Folds:
    """Divide rows into cross-validation folds.

    Parameters
    ----------
    rows : Rows
        In the order of time within each segment.
    n : int, optional
        Number of folds. By default one per segment, at most ten, and five where
        there is a single segment. With fewer folds than segments, segments are assigned
        in turn; with more, the longest segments are cut into blocks of equal length.
    gap : float, optional
        Least time between rows on the two sides of a cut [s]: rows within it
        are in no fold. Boundaries of segments need none. By default 0.4 correlation times of
        the velocities.

    Returns
    -------
    folds : Folds
        The fold of each row, and a description.

    Raises
    ------
    MethodError
        If fewer than two folds are requested, the gap is negative, or there are too few rows.

    Examples
    --------
    >>> import numpy as np
    >>> from hydrodamp.basis.basis import Basis
    >>> time = np.arange(6.0)
    >>> rows = Rows(Basis(()), np.zeros((6, 0)), np.zeros((6, 6)), time.astype(int) // 3, time)
    >>> folds(rows).fold.tolist(), folds(rows).description
    ([0, 0, 0, 1, 1, 1], '2 folds, one per segment')
    >>> folds(rows, n=3).fold.tolist()
    [0, 1, 1, 2, 2, 2]
    """
    gap = _RELATIVE_GAP * rows.time_scale if gap is None else gap
    demand(gap >= 0.0, "gap", "zero or positive [s]", gap)
    _, number, lengths = np.unique(rows.segment, return_inverse=True, return_counts=True)
    default = _SINGLE_SEGMENT_FOLDS if len(lengths) < 2 else min(len(lengths), _MAX_FOLDS)
    n_folds = default if n is None else n
    if n_folds < 2:
        raise MethodError(f"cross-validation needs at least 2 folds; got {n_folds}")
    if n_folds > rows.n:
        raise MethodError(
            f"{rows.n} rows cannot be divided into {n_folds} folds: use a longer log or fewer folds"
        )
    if n_folds <= len(lengths):
        each = "one per segment" if n_folds == len(lengths) else f"{len(lengths)} segments in turn"
        return Folds(number % n_folds, n_folds, f"{n_folds} folds, {each}")
    return _cut_into_blocks(rows, lengths, n_folds, gap)


def _cut_into_blocks(rows: Rows, lengths: IntArray, n_folds: int, gap: float) -> Folds:
    """Cut the longest segments until there are enough blocks."""
    n_blocks = np.ones(len(lengths), dtype=np.int64)
    for _ in range(n_folds - len(lengths)):
        n_blocks[np.argmax(lengths / n_blocks)] += 1
    ends = np.cumsum(lengths)
    segments = zip(ends - lengths, lengths, n_blocks, strict=True)
    blocks = [start + np.arange(count) * length // count for start, length, count in segments]
    edges = np.concatenate(blocks)
    fold = np.repeat(np.arange(n_folds), np.diff(np.append(edges, rows.n)))
    for cut in np.setdiff1d(edges, ends - lengths).tolist():
        instant = (rows.time[cut - 1] + rows.time[cut]) / 2.0
        in_gap = np.abs(rows.time - instant) < gap / 2.0
        fold[in_gap & (rows.segment == rows.segment[cut])] = -1
    if len(empty := np.setdiff1d(np.arange(n_folds), fold)):
        raise MethodError(
            f"{rows.n} rows are too few for {n_folds} folds with gaps of {gap:g} s: fold "
            f"{empty[0] + 1} is empty. Use a longer log, fewer folds or a smaller gap."
        )
    source = "one segment" if len(lengths) == 1 else f"{len(lengths)} segments"
    return Folds(fold, n_folds, f"{n_folds} folds, blocks of {source}")

"""Rows of the pointwise regression ``σ = Ξ κ`` (equation 3), and folds for cross-validation."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.basis import Basis
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differentiation import Derivative, default_derivative
from hydrodamp.identification.qr_factor import BLOCK, Triangle, merge
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem


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
    """

    basis: Basis
    design: FloatArray
    target: FloatArray
    segment: IntArray
    time: FloatArray
    n_samples: int = 0
    variance_inflation: float = 1.0
    remarks: tuple[str, ...] = ()

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
        return Rows(basis, design, target, segment, time, problem.n_samples)


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


def folds(rows: Rows, n: int | None = None, gap: float = 1.0) -> Folds:
    """Divide rows into cross-validation folds.

    Parameters
    ----------
    rows : Rows
        In the order of time within each segment.
    n : int, optional
        Number of folds. By default one per segment, at most ten, and five where
        there is a single segment. With fewer folds than segments, segments are assigned
        in turn; with more, the longest segments are cut into blocks of equal length.
    gap : float
        Least time between rows on the two sides of a cut [s]: rows within it
        are in no fold. Boundaries of segments need none.

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

"""Rows of a regression: where they come from, and folds of them for cross-validation."""

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
        The unknown columns.
    design : ndarray, shape (m, n_terms)
        In the paper the rows ξᵀ of Ξ.
    target : ndarray, shape (m, 6)
        The wrench left over when everything known is subtracted, force X Y Z [N] and
        moment K M N [N m], body frame, on the right-hand side of equation 1: against
        the motion. In the paper σ.
    segment : ndarray of int, shape (m,)
        Number of the segment each row is from, never falling.
    time : ndarray, shape (m,)
        Its time [s], rising within a segment.
    n_samples : int
        Samples of the log that the rows are made of.
    likeness : float
        How many neighbouring rows count as one where their noise is white.
    remarks : tuple of str
        How they were made, in sentences.
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
        """How many rows there are."""
        return len(self.time)

    def select(self, chosen: IntArray) -> Rows:
        """Return some of the rows.

        Parameters
        ----------
        chosen : ndarray of int or bool
            Places of the rows, rising, or a mask.

        Returns
        -------
        rows : Rows
            In the order given.
        """
        names = ("design", "target", "segment", "time")
        return replace(self, **{name: getattr(self, name)[chosen] for name in names})

    def triangle(self) -> Triangle:
        """Return the triangle of these rows: enough to solve any model.

        Returns
        -------
        triangle : Triangle
            As from :func:`accumulate`.
        """
        parts = (slice(first, first + BLOCK) for first in range(0, self.n, BLOCK))
        blocks = (np.hstack([self.design[part], self.target[part]]) for part in parts)
        return Triangle.of(self.basis, blocks)


def residuals(rows: Rows, damping: Damping) -> FloatArray:
    """Return what a damping leaves of each axis of some rows."""
    model = damping.model
    columns = [rows.basis.index(term) for term in model.basis]
    rest: FloatArray = rows.target - rows.design[:, columns] @ damping.matrix.T
    return rest


class RegressionForm(Protocol):
    """A way from a problem to rows that hold no unknown acceleration."""

    def rows(self, problem: Problem) -> Rows:
        """Return all rows of a problem."""
        ...


@dataclass(frozen=True)
class PointwiseRegression:
    """One row a sample, with the acceleration of a derivative, as in section III.

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
        """Return one row a sample.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        rows : Rows
            Held inputs enter as the derivative sees them.
        """
        derivative = self.derivative or default_derivative(problem)
        acceleration, seen = (
            derivative.acceleration(problem),
            derivative.filter_held_inputs(problem),
        )
        regressor = seen.regressor()
        return Rows(
            basis=problem.equations.basis,
            design=regressor[:, problem.equations.n_known :],
            target=_remainder(seen, acceleration, regressor, slice(None)),
            segment=problem.segment_numbers,
            time=problem.inputs.time,
            n_samples=problem.n_samples,
        )


def accumulate(problem: Problem, derivative: Derivative | None = None) -> Triangle:
    """Fold a problem into its triangle, without keeping the rows.

    Parameters
    ----------
    problem : Problem
        Samples and terms.
    derivative : Derivative, optional
        Where the acceleration comes from; the record where there is one, else
        finite differences.

    Returns
    -------
    triangle : Triangle
        Held inputs enter as the derivative sees them. Needs 8 (n_terms + 6)^2 bytes whatever
        the length of the log; an estimated acceleration takes 48 bytes a sample
        while it is folded in.
    """
    estimator = derivative or default_derivative(problem)
    acceleration, seen = estimator.acceleration(problem), estimator.filter_held_inputs(problem)
    known, n = problem.equations.n_known, problem.n_samples

    def blocks() -> Iterator[FloatArray]:
        for first in range(0, n, BLOCK):
            part = slice(first, min(first + BLOCK, n))
            size = (part.stop - first, known + len(problem.equations.basis) + 6)
            rows = np.empty(size, order="F")
            regressor = seen.regressor(first, part.stop, out=rows[:, :-6])
            rows[:, -6:] = _remainder(seen, acceleration, regressor, part)
            yield rows[:, known:]

    return Triangle.of(problem.equations.basis, blocks())


def damping_wrench(problem: Problem, acceleration: FloatArray) -> FloatArray:
    """Return the wrench left over when everything known is subtracted.

    Equation 3 of the paper: ``τ = M ν̇ − H(Mν)ν − G − u``. What remains is
    attributed to damping, with every error of the known terms.

    Parameters
    ----------
    problem : Problem
        Equation 1 filled with a log.
    acceleration : ndarray, shape (n, 6)
        Of all samples of the problem, linear [m/s^2] and angular [rad/s^2].

    Returns
    -------
    wrench : ndarray, shape (n, 6)
        Force X Y Z [N] and moment K M N [N m], body frame, on the right-hand
        side of equation 1: against the motion. Zero on locked axes.
    """
    return _remainder(problem, acceleration, problem.regressor(), slice(None))


def _remainder(
    problem: Problem, acceleration: FloatArray, regressor: FloatArray, part: slice
) -> FloatArray:
    mass = problem.vehicle.mass_matrix
    known = regressor[:, : problem.equations.n_known] @ problem.equations.known
    inertial = acceleration[part] @ mass
    coriolis = core.coriolis(mass, problem.inputs.velocity[part])
    return (inertial - coriolis - known - problem.inputs.wrench[part]) * problem.vehicle.free


# Folds made of several segments, and of a single one, unless asked for.
_MOST, _BLOCKS = 10, 5


@dataclass(frozen=True)
class Split:
    """What one fold leaves to learn from, and the fold itself."""

    train: Triangle
    test: Triangle


@dataclass(frozen=True, eq=False)
class Folds:
    """Which fold each row belongs to.

    Attributes
    ----------
    part : ndarray of int, shape (m,)
        Number of the fold from 0, or -1 for a row in the margin of a cut.
    n : int
        How many folds there are, at least two; none is empty.
    made : str
        How they were made, in words.
    """

    fold: IntArray
    n: int
    description: str

    def splits(self, rows: Rows) -> tuple[Split, ...]:
        """Return the triangles of every fold: each row is folded in once.

        Parameters
        ----------
        rows : Rows
            Those the folds were made of.

        Returns
        -------
        splits : tuple of Split
            One a fold. The training triangles are merged from those of the folds.
        """
        tests = [rows.select(self.fold == fold).triangle() for fold in range(self.n)]
        return tuple(
            Split(merge(tests[:fold] + tests[fold + 1 :]), test) for fold, test in enumerate(tests)
        )


def folds(rows: Rows, n: int | None = None, gap: float = 1.0) -> Folds:
    """Divide rows into folds.

    Parameters
    ----------
    rows : Rows
        In the order of time within each segment.
    n : int, optional
        How many folds. By default one a segment, but at most ten, and five where
        there is a single segment. Fewer than there are segments: segments are dealt
        out in turn. More: the longest are cut into blocks of equal length.
    gap : float
        How far apart the rows on the two sides of a cut must lie [s]: closer ones
        are in no fold. Joins between segments need none.

    Returns
    -------
    folds : Folds
        The number of the fold of each row, and how it was come by.

    Raises
    ------
    MethodError
        If fewer than two folds are asked for, the gap is negative, or the rows are too
        few.

    Examples
    --------
    >>> import numpy as np
    >>> from hydrodamp.basis.basis import Basis
    >>> time = np.arange(6.0)
    >>> rows = Rows(Basis(()), np.zeros((6, 0)), np.zeros((6, 6)), time.astype(int) // 3, time)
    >>> folds(rows).part.tolist(), folds(rows).made
    ([0, 0, 0, 1, 1, 1], '2 folds, one a segment')
    >>> folds(rows, n=3).part.tolist()
    [0, 1, 1, 2, 2, 2]
    """
    demand(gap >= 0.0, "gap", "zero or positive [s]", gap)
    _, number, lengths = np.unique(rows.segment, return_inverse=True, return_counts=True)
    usual = _BLOCKS if len(lengths) < 2 else min(len(lengths), _MOST)
    wanted = usual if n is None else n
    if wanted < 2:
        raise MethodError(f"cross-validation needs at least 2 folds; got {wanted}")
    if wanted > rows.n:
        raise MethodError(
            f"{wanted} folds cannot be made of {rows.n} rows: give a longer log or fewer folds"
        )
    if wanted <= len(lengths):
        each = "one a segment" if wanted == len(lengths) else f"{len(lengths)} segments in turn"
        return Folds(number % wanted, wanted, f"{wanted} folds, {each}")
    return _blocks(rows, lengths, wanted, gap)


def _blocks(rows: Rows, lengths: IntArray, wanted: int, gap: float) -> Folds:
    """Cut the longest segments until there are enough blocks."""
    pieces = np.ones(len(lengths), dtype=np.int64)
    for _ in range(wanted - len(lengths)):
        pieces[np.argmax(lengths / pieces)] += 1
    ends = np.cumsum(lengths)
    edges = np.concatenate(
        [
            end - length + np.arange(count) * length // count
            for end, length, count in zip(ends, lengths, pieces, strict=True)
        ]
    )
    part = np.repeat(np.arange(wanted), np.diff(np.append(edges, rows.n)))
    for cut in np.setdiff1d(edges, ends - lengths).tolist():
        instant = (rows.time[cut - 1] + rows.time[cut]) / 2.0
        near = np.abs(rows.time - instant) < gap / 2.0
        part[near & (rows.segment == rows.segment[cut])] = -1
    if len(empty := np.setdiff1d(np.arange(wanted), part)):
        raise MethodError(
            f"{rows.n} rows are too few for {wanted} folds {gap:g} s apart: fold "
            f"{empty[0] + 1} is left without a row. Give a longer log, fewer folds or a "
            "smaller gap."
        )
    cut_up = "one segment" if len(lengths) == 1 else f"{len(lengths)} segments"
    return Folds(part, wanted, f"{wanted} folds, blocks of {cut_up}")

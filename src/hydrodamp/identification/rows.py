"""Equation 3 as rows of a linear regression."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Protocol

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.basis import Basis
from hydrodamp.errors import ProblemError
from hydrodamp.identification.differences import Derivative, default_derivative
from hydrodamp.identification.triangle import BLOCK, Triangle
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

    Raises
    ------
    ProblemError
        If a shape does not agree with the others.
    """

    basis: Basis
    design: FloatArray
    target: FloatArray
    segment: IntArray
    time: FloatArray
    n_samples: int = 0
    likeness: float = 1.0
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the shapes and freeze the arrays."""
        length = len(self.time)
        shapes = ((length, len(self.basis)), (length, 6), (length,), (length,))
        for one, shape in zip(fields(self)[1:5], shapes, strict=True):
            array = np.asarray(getattr(self, one.name))
            if array.shape != shape:
                raise ProblemError(f"`{one.name}` must have shape {shape}; got {array.shape}")
            array.setflags(write=False)
            object.__setattr__(self, one.name, array)

    @property
    def n(self) -> int:
        """How many rows there are."""
        return len(self.time)

    def taken(self, chosen: IntArray) -> Rows:
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
        part = {one.name: getattr(self, one.name)[chosen] for one in fields(self)[1:5]}
        return replace(self, **part)

    def triangle(self) -> Triangle:
        """Return the triangle of these rows: enough to solve any model.

        Returns
        -------
        triangle : Triangle
            As from :func:`accumulate`.
        """

        def blocks() -> Iterator[FloatArray]:
            for start in range(0, self.n, BLOCK):
                part = slice(start, min(start + BLOCK, self.n))
                rows = np.empty((part.stop - start, len(self.basis) + 6), order="F")
                rows[:, :-6], rows[:, -6:] = self.design[part], self.target[part]
                yield rows

        return Triangle.of(self.basis, blocks())


class Equations(Protocol):
    """A way from a problem to rows that hold no unknown acceleration."""

    def rows(self, problem: Problem) -> Rows:
        """Return all rows of a problem."""
        ...


@dataclass(frozen=True)
class Differenced:
    """One row a sample, with the acceleration of a derivative, as in section III.

    Parameters
    ----------
    derivative : Derivative, optional
        The recorded acceleration where the log has it, else finite differences.

    Examples
    --------
    >>> Differenced()
    Differenced(derivative=None)
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
        acceleration, seen = derivative.acceleration(problem), derivative.seen(problem)
        regressor = seen.regressor()
        return Rows(
            basis=problem.columns.basis,
            design=regressor[:, problem.columns.n_known :],
            target=_remainder(seen, acceleration, regressor, slice(None)),
            segment=problem.segment_numbers,
            time=problem.inputs.time,
            n_samples=problem.n_samples,
        )


def accumulate(
    problem: Problem,
    derivative: Derivative | None = None,
    segments: Iterable[int] | None = None,
) -> Triangle:
    """Fold a problem into its triangle, without keeping the rows.

    Parameters
    ----------
    problem : Problem
        Samples and terms.
    derivative : Derivative, optional
        Where the acceleration comes from; the record where there is one, else
        finite differences.
    segments : iterable of int, optional
        Which segments, by number; all by default.

    Returns
    -------
    triangle : Triangle
        Held inputs enter as the derivative sees them. Needs 8 (n_terms + 6)^2 bytes whatever
        the length of the log; an estimated acceleration takes 48 bytes a sample
        while it is folded in.

    Raises
    ------
    ProblemError
        If there is no such segment.
    """
    estimator = derivative or default_derivative(problem)
    acceleration, seen = estimator.acceleration(problem), estimator.seen(problem)
    try:
        bounds = problem.segments if segments is None else problem.segments[list(segments)]
    except IndexError as error:
        raise ProblemError(f"there are {len(problem.segments)} segments: {error}") from error
    known = problem.columns.n_known

    def blocks() -> Iterator[FloatArray]:
        for start, stop in _joined(bounds):
            for first in range(start, stop, BLOCK):
                part = slice(first, min(first + BLOCK, stop))
                size = (part.stop - first, known + len(problem.columns.basis) + 6)
                rows = np.empty(size, order="F")
                regressor = seen.regressor(first, part.stop, out=rows[:, :-6])
                rows[:, -6:] = _remainder(seen, acceleration, regressor, part)
                yield rows[:, known:]

    return Triangle.of(problem.columns.basis, blocks())


def damping_wrench(
    problem: Problem, acceleration: FloatArray, start: int = 0, stop: int | None = None
) -> FloatArray:
    """Return the wrench left over when everything known is subtracted.

    Equation 3 of the paper: ``τ = M ν̇ − H(Mν)ν − G − u``. What remains is
    attributed to damping, with every error of the known terms.

    Parameters
    ----------
    problem : Problem
        Equation 1 filled with a log.
    acceleration : ndarray, shape (n, 6)
        Of all samples of the problem, linear [m/s^2] and angular [rad/s^2].
    start, stop : int, optional
        First sample and one past the last; all by default.

    Returns
    -------
    wrench : ndarray, shape (stop - start, 6)
        Force X Y Z [N] and moment K M N [N m], body frame, on the right-hand
        side of equation 1: against the motion. Zero on locked axes.
    """
    regressor = problem.regressor(start, stop)
    return _remainder(problem, acceleration, regressor, slice(start, stop))


def _remainder(
    problem: Problem, acceleration: FloatArray, regressor: FloatArray, part: slice
) -> FloatArray:
    mass = problem.vehicle.mass_matrix
    known = regressor[:, : problem.columns.n_known] @ problem.columns.known
    inertial = acceleration[part] @ mass
    coriolis = kernels.coriolis(mass, problem.inputs.velocity[part])
    return (inertial - coriolis - known - problem.inputs.wrench[part]) * problem.vehicle.free


def _joined(bounds: IntArray) -> list[tuple[int, int]]:
    """Return neighbouring segments as one stretch: rows of a triangle know no join."""
    stretches: list[tuple[int, int]] = []
    for start, stop in bounds.tolist():
        if stretches and stretches[-1][1] == start:
            stretches[-1] = (stretches[-1][0], stop)
        else:
            stretches.append((start, stop))
    return stretches

"""The sufficient statistic of least squares: one triangle, mergeable."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.errors import ProblemError
from hydrodamp.identification.rows.derivative import Derivative, default_derivative
from hydrodamp.identification.rows.folding import BLOCK, fold, folded_rows
from hydrodamp.simulation.problem import Problem


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
        r = fold(self.r.copy(order="F"), other.r.copy(order="F"), upper=len(self.r))
        return Triangle(self.basis, frozen(np.triu(r)), self.n_samples + other.n_samples)


def accumulate(
    problem: Problem,
    derivative: Derivative | None = None,
    segments: Iterable[int] | None = None,
) -> Triangle:
    """Fold a problem into its triangle.

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
        Held inputs enter as the derivative sees them; see
        :mod:`hydrodamp.identification.rows.held`. Needs 8 (n_terms + 6)^2 bytes whatever
        the length of the log; an estimated acceleration takes 48 bytes a sample
        while it is folded in.
    """
    estimator = derivative or default_derivative(problem)
    acceleration, seen = estimator.acceleration(problem), estimator.seen(problem)
    size = len(problem.columns.basis) + 6
    r = np.zeros((size, size), order="F")
    n_samples = 0
    for start, stop in _runs(problem, segments):
        n_samples += stop - start
        for first in range(start, stop, BLOCK):
            r = fold(r, _rows(seen, acceleration, first, min(first + BLOCK, stop)))
    return Triangle(problem.columns.basis, frozen(np.triu(r)), n_samples)


def folded(basis: Basis, design: FloatArray, target: FloatArray) -> Triangle:
    """Fold rows that are already there into their triangle."""
    size = len(basis) + 6
    r = folded_rows(np.zeros((size, size)), np.hstack([design, target]))
    return Triangle(basis, frozen(r), len(target))


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


def _runs(problem: Problem, segments: Iterable[int] | None) -> list[tuple[int, int]]:
    try:
        bounds = problem.segments if segments is None else problem.segments[list(segments)]
    except IndexError as error:
        raise ProblemError(f"there are {len(problem.segments)} segments: {error}") from error
    runs: list[tuple[int, int]] = []
    for start, stop in bounds.tolist():
        if runs and runs[-1][1] == start:
            runs[-1] = (runs[-1][0], stop)
        else:
            runs.append((start, stop))
    return runs


def _rows(problem: Problem, acceleration: FloatArray, start: int, stop: int) -> FloatArray:
    """Return ``[ξᵀ τᵀ]`` of a block, filled in place and ready for LAPACK."""
    known = problem.columns.n_known
    rows = np.empty((stop - start, known + len(problem.columns.basis) + 6), order="F")
    regressor = problem.regressor(start, stop, out=rows[:, :-6])
    rows[:, -6:] = _remainder(problem, acceleration, regressor, slice(start, stop))
    return rows[:, known:]


def _remainder(
    problem: Problem, acceleration: FloatArray, regressor: FloatArray, part: slice
) -> FloatArray:
    mass = problem.vehicle.mass_matrix
    known = regressor[:, : problem.columns.n_known] @ problem.columns.known
    inertial = acceleration[part] @ mass
    coriolis = kernels.coriolis(mass, problem.inputs.velocity[part])
    return (inertial - coriolis - known - problem.inputs.wrench[part]) * problem.vehicle.free

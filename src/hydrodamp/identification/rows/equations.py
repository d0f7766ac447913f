"""Equation 3 as rows of a linear regression, however the acceleration is done away with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.basis import Basis
from hydrodamp.errors import ProblemError
from hydrodamp.identification.rows.derivative import Derivative, default_derivative
from hydrodamp.identification.rows.triangle import Triangle, accumulate, damping_wrench, folded
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

    def __post_init__(self) -> None:
        """Check the shapes and freeze the arrays."""
        length = len(self.time)
        shapes = {
            "design": (length, len(self.basis)),
            "target": (length, 6),
            "segment": (length,),
            "time": (length,),
        }
        for name, shape in shapes.items():
            array = np.asarray(getattr(self, name))
            if array.shape != shape:
                raise ProblemError(f"`{name}` must have shape {shape}; got {array.shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)

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
        return Rows(
            self.basis,
            self.design[chosen],
            self.target[chosen],
            self.segment[chosen],
            self.time[chosen],
        )

    def triangle(self) -> Triangle:
        """Return the triangle of these rows: enough to solve any model.

        Returns
        -------
        triangle : Triangle
            As from :func:`hydrodamp.identification.rows.triangle.accumulate`.
        """
        return folded(self.basis, self.design, self.target)


class Equations(Protocol):
    """A way from a problem to rows that hold no unknown acceleration."""

    def rows(self, problem: Problem) -> Rows:
        """Return all rows of a problem."""
        ...

    def triangle(self, problem: Problem) -> Triangle:
        """Return the triangle of all rows of a problem, in little memory."""
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
        return Rows(
            basis=problem.columns.basis,
            design=seen.regressor()[:, problem.columns.n_known :],
            target=frozen(damping_wrench(seen, acceleration)),
            segment=problem.segment_numbers,
            time=problem.inputs.time,
        )

    def triangle(self, problem: Problem) -> Triangle:
        """Return the triangle, made block by block.

        Parameters
        ----------
        problem : Problem
            Samples and terms.

        Returns
        -------
        triangle : Triangle
            That of :meth:`rows`, without keeping them.
        """
        return accumulate(problem, self.derivative)

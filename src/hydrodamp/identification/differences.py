"""Acceleration from velocity: never across a join, right on irregular clocks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.conditioning.derived import fitted, relative
from hydrodamp.errors import MethodError
from hydrodamp.simulation.problem import Problem

# From times (n,) and values (n, k) of one segment to slopes (n, k).
Slopes = Callable[[FloatArray, FloatArray], FloatArray]


class Derivative(Protocol):
    """A way to an acceleration."""

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return the acceleration (n, 6), linear [m/s^2] and angular [rad/s^2]."""
        ...

    def seen(self, problem: Problem) -> Problem:
        """Return the problem with held inputs as this acceleration sees them."""
        ...


@dataclass(frozen=True)
class RecordedAcceleration:
    """The acceleration columns ``du … dr`` of the log."""

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return what was recorded.

        Parameters
        ----------
        problem : Problem
            Its log must carry accelerations.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Time derivative of the body velocity's components, linear [m/s^2]
            and angular [rad/s^2].

        Raises
        ------
        MethodError
            If the log has none.
        """
        if problem.log.acceleration is None:
            raise MethodError(
                "the log has no acceleration columns du dv dw dp dq dr: use "
                "FiniteDifference() or SavitzkyGolay(), or a method that needs none."
            )
        recorded, free = problem.log.acceleration, problem.vehicle.free
        return recorded if free.all() else recorded * free  # a long log is not copied

    def seen(self, problem: Problem) -> Problem:
        """Return the problem itself: a measured acceleration belongs to its instant."""
        return problem


class _Differentiated:
    """Slopes of the velocities, segment by segment."""

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        raise NotImplementedError

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return the slopes of the velocities.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Linear [m/s^2] and angular [rad/s^2], never across a join.
        """
        return _by_segment(problem, problem.inputs.velocity, self._slopes)

    def seen(self, problem: Problem) -> Problem:
        """Return the problem with held inputs as these slopes see them."""
        inputs = problem.inputs
        turning = problem.propulsion_known and problem.log.propulsion_ratio is None
        held = np.hstack([inputs.channels, inputs.propulsion[:, : int(turning)]])
        if not held.size:
            return problem
        # A velocity is the integral of what is held, so its slope sees the slope of that integral.
        seen = _by_segment(problem, held, lambda t, rows: self._slopes(t, _integral(t, rows)))
        propulsion = inputs.propulsion.copy()
        propulsion[:, : int(turning)] = seen[:, inputs.n_channels :]
        channels = seen[:, : inputs.n_channels]
        return replace(problem, inputs=replace(inputs, channels=channels, propulsion=propulsion))


@dataclass(frozen=True)
class FiniteDifference(_Differentiated):
    """Central differences of second order, as in the paper; one-sided at a segment's ends."""

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        return np.gradient(values, time, axis=0, edge_order=2 if len(time) > 2 else 1)


@dataclass(frozen=True)
class SavitzkyGolay(_Differentiated):
    """The slope of a polynomial fitted to a window around each sample.

    Parameters
    ----------
    window : float
        Length of the window [s]; at least ``order + 2`` samples are taken.
    order : int
        Degree of the polynomial.

    Raises
    ------
    MethodError
        If the window is not positive or the order not 1 to 5.
    """

    window: float = 1.0
    order: int = 3

    def __post_init__(self) -> None:
        """Refuse settings that make no filter."""
        if not self.window > 0.0:
            raise MethodError(f"`window` must be positive [s], got {self.window}")
        if not 1 <= self.order <= 5:
            raise MethodError(f"`order` must be 1 to 5, got {self.order}")

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        order = min(self.order, len(time) - 1)
        half = max(round(self.window / float(np.median(np.diff(time))) / 2.0), order // 2 + 1)
        whole = np.array([[0, len(time)]])
        return fitted(time, whole, relative(values), 2 * half + 1, degree=order).slope


def default_derivative(problem: Problem) -> Derivative:
    """Return what key ``ls`` uses: the record where there is one, else differences."""
    if problem.log.acceleration is not None:
        return RecordedAcceleration()
    return FiniteDifference()


def _by_segment(problem: Problem, values: FloatArray, slopes: Slopes) -> FloatArray:
    result = np.empty_like(values)
    for start, stop in problem.segments.tolist():
        result[start:stop] = slopes(problem.inputs.time[start:stop], values[start:stop])
    return result


def _integral(time: FloatArray, held: FloatArray) -> FloatArray:
    steps = np.diff(time)[:, None]
    return np.vstack([np.zeros((1, held.shape[1])), np.cumsum(held[:-1] * steps, axis=0)])

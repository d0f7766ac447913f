"""Acceleration from velocity: never across a join, right on irregular clocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.held import by_segment, seen_through
from hydrodamp.simulation.problem import Problem

_BLOCK = 4096
"""Windows solved at once: bounds the memory of irregular clocks."""


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


@dataclass(frozen=True)
class FiniteDifference:
    """Central differences, as in the paper; one-sided at a segment's ends."""

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return second-order differences on the log's own clock.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Linear [m/s^2] and angular [rad/s^2].
        """
        return by_segment(problem, problem.inputs.velocity, _central_difference)

    def seen(self, problem: Problem) -> Problem:
        """Return the problem with held inputs as central differences see them."""
        return seen_through(problem, _central_difference)


@dataclass(frozen=True)
class SavitzkyGolay:
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

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return the fitted slopes.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Linear [m/s^2] and angular [rad/s^2].
        """
        return by_segment(problem, problem.inputs.velocity, self._slopes)

    def seen(self, problem: Problem) -> Problem:
        """Return the problem with held inputs as the fitted slopes see them."""
        return seen_through(problem, self._slopes)

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        order = min(self.order, len(time) - 1)
        half = max(round(self.window / float(np.median(np.diff(time))) / 2.0), order // 2 + 1)
        return _local_slopes(time, values, min(2 * half + 1, len(time)), order)


def default_derivative(problem: Problem) -> Derivative:
    """Return what key ``ls`` uses: the record where there is one, else differences."""
    if problem.log.acceleration is not None:
        return RecordedAcceleration()
    return FiniteDifference()


def _central_difference(time: FloatArray, values: FloatArray) -> FloatArray:
    if len(time) < 3:
        return np.gradient(values, time, axis=0, edge_order=1)
    return np.gradient(values, time, axis=0, edge_order=2)


def _local_slopes(time: FloatArray, values: FloatArray, width: int, order: int) -> FloatArray:
    """Slope at each sample of the polynomial through the ``width`` samples around it."""
    n = len(time)
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    slopes = np.empty_like(values)
    for start in range(0, n, _BLOCK):
        here = np.arange(start, min(start + _BLOCK, n))
        window = first[here, None] + np.arange(width)
        weights = _slope_weights(time[window] - time[here, None], order)
        slopes[here] = np.einsum("nw,nwk->nk", weights, values[window])
    return slopes


def _slope_weights(offsets: FloatArray, order: int) -> FloatArray:
    """Weights (n, width) whose sum with the samples is the fitted slope at offset 0."""
    scale = np.abs(offsets).max(axis=1)
    powers = (offsets / scale[:, None])[:, :, None] ** np.arange(order + 1)
    q, r = np.linalg.qr(powers)
    unit = np.zeros(order + 1)
    unit[1] = 1.0
    # The coefficients are R^-1 Q' y, so the slope's weights are Q R^-T e1.
    back = np.linalg.solve(np.swapaxes(r, 1, 2), np.broadcast_to(unit, r.shape[:2])[..., None])
    weights: FloatArray = (q @ back)[..., 0] / scale[:, None]
    return weights

"""Slopes whose window each velocity chooses for itself, with the budget of the choice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.conditioning.local_polynomials import WINDOWS, Around, best_window, fitted
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.derivative import SavitzkyGolay
from hydrodamp.identification.rows.velocity_noise import median_step, noise_variance
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True)
class Budget:
    """What the slopes of one velocity are worth; root mean squares in [m/s^2] or [rad/s^2].

    Attributes
    ----------
    velocity : str
        Its name.
    window : int
        Samples under each parabola.
    noise : float
        What white noise of the velocity leaves in the slope.
    bias : float or None
        What the parabola misses of the motion, by the next shorter window; None where
        there is none.
    slope : float
        The slope itself.
    """

    velocity: str
    window: int
    noise: float
    bias: float | None
    slope: float

    def __str__(self) -> str:
        """Return one sentence."""
        bias = "unknown" if self.bias is None else f"{self.bias:.2g}"
        return (
            f"{self.velocity}: {self.window} samples; of a slope of {self.slope:.2g}, noise "
            f"{self.noise:.2g} and bias {bias}"
        )


@dataclass(frozen=True)
class ChosenSlopes:
    """Slopes of local parabolas, each velocity over the window that foretells it best.

    Parameters
    ----------
    windows : tuple of int
        Odd numbers of samples to choose from, rising, five or more.

    Raises
    ------
    MethodError
        If the windows are none, not rising, even or shorter than five.

    Examples
    --------
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> from hydrodamp.models.catalog import catalog
    >>> campaign = reenact(duration=20.0)
    >>> problem = prepare(campaign.vehicle, campaign.train, catalog["fossen"])
    >>> [one.velocity for one in ChosenSlopes().budget(problem)]
    ['u', 'v', 'w', 'p', 'q', 'r']
    """

    windows: tuple[int, ...] = WINDOWS

    def __post_init__(self) -> None:
        """Refuse windows that make no choice."""
        rising = all(one < two for one, two in zip(self.windows, self.windows[1:], strict=False))
        if not self.windows or not rising or any(w < 5 or w % 2 == 0 for w in self.windows):
            raise MethodError(
                f"`windows` must be odd, rising and at least 5 samples; got {self.windows}"
            )

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return the slopes.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Linear [m/s^2] and angular [rad/s^2].
        """
        slopes = [_slope(problem, axis, window) for axis, window in enumerate(self.chosen(problem))]
        return np.column_stack(slopes)

    def seen(self, problem: Problem) -> Problem:
        """Return the problem with held inputs as the slopes see them.

        Each velocity has a window of its own, a command is one column for all: it is taken
        over the median window.
        """
        window = float(np.median(self.chosen(problem))) * median_step(problem)
        return SavitzkyGolay(window=window, order=2).seen(problem)

    def chosen(self, problem: Problem) -> tuple[int, ...]:
        """Return the window of each velocity.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        windows : tuple of 6 ints
            By leave-one-out cross-validation [samples].
        """
        time, bounds = problem.inputs.time, problem.segments
        return tuple(
            best_window(time, bounds, _values(problem, axis), self.windows) for axis in range(6)
        )

    def budget(self, problem: Problem) -> tuple[Budget, ...]:
        """Return what noise and bias the slopes have.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        budget : tuple of 6 Budget
            Noise for white errors of the velocities on an even clock, where a parabola over
            w samples a step h apart has a slope of variance ``12 s^2 / (h^2 w (w^2 - 1))``.
        """
        found = zip(self.chosen(problem), noise_variance(problem), strict=True)
        return tuple(
            self._of(problem, axis, window, float(noise))
            for axis, (window, noise) in enumerate(found)
        )

    def _of(self, problem: Problem, axis: int, window: int, noise: float) -> Budget:
        slope, step = _slope(problem, axis, window), median_step(problem)
        variance = noise * _gain(window, step)
        shorter = [one for one in self.windows if one < window]
        bias = None
        if shorter:
            # The noise of two windows, one within the other, differs by the difference of
            # their variances; beyond that they differ in what they miss of the motion, which
            # grows with the square of the window.
            inner = shorter[-1]
            apart = float(np.mean((slope - _slope(problem, axis, inner)) ** 2))
            beyond = apart - noise * (_gain(inner, step) - _gain(window, step))
            bias = float(np.sqrt(max(beyond, 0.0))) / (1.0 - (inner / window) ** 2)
        size = float(np.sqrt(np.mean(slope**2)))
        return Budget(VELOCITIES[axis], window, float(np.sqrt(variance)), bias, size)


def said(budget: Sequence[Budget]) -> str:
    """Return a budget as one sentence."""
    return f"Slopes over windows chosen by cross-validation: {'; '.join(map(str, budget))}."


def _gain(window: int, step: float) -> float:
    return 12.0 / (step**2 * window * (window**2 - 1))


def _slope(problem: Problem, axis: int, window: int) -> FloatArray:
    local = fitted(problem.inputs.time, problem.segments, _values(problem, axis), window)
    slope: FloatArray = local.slope[:, 0]
    return slope


def _values(problem: Problem, axis: int) -> Around:
    velocity = problem.inputs.velocity[:, axis]

    def around(at: IntArray, near: IntArray) -> FloatArray:
        beside: FloatArray = (velocity[near] - velocity[at, np.newaxis])[..., np.newaxis]
        return beside

    return around

"""The velocities a vehicle is operated at, as a box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.errors import MethodError
from hydrodamp.simulation.problem import Problem

TAIL = 0.01
"""Share of the samples left out at either end: outliers do not set the box."""

WIDENING = 0.25
"""Share by which the quantiles are widened, for a replay sails a little further."""

SLOWEST_UNDER_WAY = 0.05
"""Least surge, as a share of the greatest, of a vehicle that is said to be under way."""


@dataclass(frozen=True, eq=False)
class OperatingBox:
    """An interval for every velocity.

    Parameters
    ----------
    low, high : array_like, shape (6,)
        Bounds of u v w [m/s] p q r [rad/s], body frame. Both zero for a locked velocity.

    Raises
    ------
    MethodError
        If a bound is not finite, or a lower one above its upper one.

    Examples
    --------
    >>> print(OperatingBox([1, -0.2, 0, 0, 0, -0.3], [2, 0.2, 0, 0, 0, 0.3]))
    u 1 to 2 m/s, v -0.2 to 0.2 m/s, r -0.3 to 0.3 rad/s
    """

    low: FloatArray
    high: FloatArray

    def __post_init__(self) -> None:
        """Copy the bounds and check them."""
        for name in ("low", "high"):
            try:
                bound = frozen(getattr(self, name), (6,), name)
            except ValueError as error:
                raise MethodError(f"{error}: one bound each for u v w p q r.") from error
            object.__setattr__(self, name, bound)
        wrong = ~(np.isfinite(self.low) & np.isfinite(self.high) & (self.low <= self.high))
        if wrong.any():
            first = int(np.argmax(wrong))
            raise MethodError(
                f"the operating box must be finite with `low` <= `high`; got {VELOCITIES[first]} "
                f"from {self.low[first]:g} to {self.high[first]:g}."
            )

    @property
    def extent(self) -> FloatArray:
        """Greatest absolute value of each velocity, shape (6,)."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    @property
    def nearest(self) -> FloatArray:
        """Least absolute value of each velocity, shape (6,); zero where it may vanish."""
        away = np.minimum(np.abs(self.low), np.abs(self.high))
        return np.where(self.low * self.high > 0.0, away, 0.0)

    def contains(self, velocity: npt.ArrayLike) -> BoolArray:
        """Tell which velocities lie in the box.

        Parameters
        ----------
        velocity : array_like, shape (n, 6) or (6,)
            u v w [m/s] p q r [rad/s].

        Returns
        -------
        inside : ndarray of bool, shape (n,) or ()
            Bounds count as inside.
        """
        value = np.asarray(velocity, dtype=np.float64)
        return np.asarray(np.all((value >= self.low) & (value <= self.high), axis=-1))

    def at(self, places: npt.ArrayLike) -> FloatArray:
        """Return the velocities at relative places, 0 the lower bound and 1 the upper.

        Parameters
        ----------
        places : array_like, shape (n, 6)
            Between zero and one.

        Returns
        -------
        velocity : ndarray, shape (n, 6)
            u v w [m/s] p q r [rad/s].
        """
        return self.low + np.asarray(places, dtype=np.float64) * (self.high - self.low)

    def __str__(self) -> str:
        """Return the intervals of the velocities that are not locked."""
        units = ("m/s",) * 3 + ("rad/s",) * 3
        return ", ".join(
            f"{name} {low:.3g} to {high:.3g} {unit}"
            for name, low, high, unit in zip(VELOCITIES, self.low, self.high, units, strict=True)
            if low != 0.0 or high != 0.0
        )


def operating_box(problem: Problem, tail: float = TAIL, widening: float = WIDENING) -> OperatingBox:
    """Return the box that a log was sailed in.

    Every velocity but surge gets an interval symmetric about zero: water does not know
    port from starboard. Surge gets its own quantiles where it keeps its sign, so that
    the box of a vehicle under way does not reach down to rest; where surge changes sign
    or nearly vanishes, the vehicle hovers and its interval is symmetric too.

    Parameters
    ----------
    problem : Problem
        Its velocities, of the free axes.
    tail : float
        Share of the samples left out at either end.
    widening : float
        Share by which the quantiles are widened.

    Returns
    -------
    box : OperatingBox
        Zero on locked axes.

    Raises
    ------
    MethodError
        If a share is not one.
    """
    if not (0.0 <= tail < 0.5 and 0.0 <= widening < 1.0):
        raise MethodError(
            f"`tail` must be at least 0 and below 0.5, `widening` at least 0 and below 1; "
            f"got {tail:g} and {widening:g}."
        )
    low, high = np.quantile(problem.inputs.velocity, [tail, 1.0 - tail], axis=0)
    reach = (1.0 + widening) * np.maximum(np.abs(low), np.abs(high))
    below, above = -reach, reach.copy()
    if low[0] > SLOWEST_UNDER_WAY * high[0]:
        below[0] = low[0] * (1.0 - widening)
    elif high[0] < SLOWEST_UNDER_WAY * low[0]:
        above[0] = high[0] * (1.0 - widening)
    return OperatingBox(frozen(below), frozen(above))

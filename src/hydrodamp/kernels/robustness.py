"""Settings and state of the robust adaptive identifier, arrays only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import ProblemError
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.track import Track


@dataclass(frozen=True, eq=False)
class Robustness:
    """What makes the adaptive identifier robust; the defaults change nothing.

    Parameters
    ----------
    entries : Entries
        The coefficients that move.
    a : array_like, shape (6,)
        Error gain of each axis, positive [N/(m/s), N m/(rad/s)].
    gains : array_like, shape (n_squares,)
        Adaptation gains: one symmetric positive-definite matrix an axis, packed
        as by :meth:`Entries.packed`. Zero rows hold a coefficient.
    rest : array_like, shape (n,), optional
        Where leakage leads to; zero by default.
    lower, upper : array_like, shape (n,), optional
        Bounds of the coefficients; none by default.
    leakage : float, optional
        How fast a coefficient that nothing excites returns to rest [1/s].
    dead_zone : float, optional
        Size of velocity error, as the root of ``errorᵀ M error`` [kg^(1/2) m/s], that
        teaches nothing.

    Raises
    ------
    ProblemError
        If a shape is wrong, a number negative, or bounds exclude each other.
    """

    entries: Entries
    a: FloatArray
    gains: FloatArray
    rest: FloatArray | None = None
    lower: FloatArray | None = None
    upper: FloatArray | None = None
    leakage: float = 0.0
    dead_zone: float = 0.0

    def __post_init__(self) -> None:
        """Copy, check and freeze the arrays."""
        n = self.entries.n
        filled = {"rest": 0.0, "lower": -np.inf, "upper": np.inf}
        shapes = {"a": 6, "gains": self.entries.n_squares, **dict.fromkeys(filled, n)}
        for name, size in shapes.items():
            given = getattr(self, name)
            try:
                array = frozen(
                    np.full(size, filled[name]) if given is None else given, (size,), name
                )
            except ValueError as error:
                raise ProblemError(str(error)) from error
            object.__setattr__(self, name, array)
        for name in ("leakage", "dead_zone"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ProblemError(f"`{name}` must be zero or more; got {getattr(self, name)}")
        if not np.all(self.bounds[0] <= self.bounds[1]):
            raise ProblemError("`lower` must not exceed `upper`")

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds, infinite where there are none."""
        assert self.lower is not None
        assert self.upper is not None
        return self.lower, self.upper

    @property
    def led_to(self) -> FloatArray:
        """Where leakage leads to."""
        assert self.rest is not None
        return self.rest


@dataclass(frozen=True, eq=False, slots=True)
class Adapting:
    """What the robust identifier moves.

    Attributes
    ----------
    coefficients : ndarray, shape (n,)
        The estimate.
    error : ndarray, shape (6,)
        Velocity error [m/s, rad/s], estimate minus record.
    total : ndarray, shape (n,)
        Coefficients after each step times its length, summed since the mean began.
    duration : float
        Of the steps summed [s].
    """

    coefficients: FloatArray
    error: FloatArray
    total: FloatArray
    duration: float

    @classmethod
    def at(cls, coefficients: FloatArray) -> Adapting:
        """Return the state before the first step: no error, no mean."""
        estimate = np.array(coefficients, dtype=np.float64)
        return cls(estimate, np.zeros(6), np.zeros(len(estimate)), 0.0)

    @property
    def mean(self) -> FloatArray:
        """The mean over time since it began; the estimate where there was no step."""
        return self.total / self.duration if self.duration > 0.0 else self.coefficients


@dataclass(frozen=True, eq=False, slots=True)
class RobustRun:
    """What a run of the robust identifier leaves behind.

    Attributes
    ----------
    adapting : Adapting
        After the last step.
    track : Track
        Velocity errors and coefficients on the way, where asked for.
    """

    adapting: Adapting
    track: Track

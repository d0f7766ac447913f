"""How noisy the sensors are, and how large the disturbances that a model does not explain."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.data import attitude as attitudes
from hydrodamp.errors import MethodError
from hydrodamp.identification.smoothing.transition import Steps
from hydrodamp.simulation.problem import Problem

_QUIETEST = 1e-6
"""No sensor is taken to be quieter [m/s, rad/s, rad]: rounding of the log is of this size."""


@dataclass(frozen=True)
class Noise:
    """White errors of the sensors, and white disturbances.

    Parameters
    ----------
    velocity : array_like, shape (6,)
        Standard deviation of u v w [m/s], p q r [rad/s].
    turn : array_like, shape (3,)
        Standard deviation of the attitude about the body axes [rad].
    disturbance : array_like, shape (6,)
        Root of the spectral density of the wrench that the model leaves out, X Y Z
        [N s^0.5], K M N [N m s^0.5]: over a step of h seconds its mean has a
        standard deviation of this over the root of h.

    Raises
    ------
    MethodError
        If a level of a sensor is not positive, or that of a disturbance is negative.

    Examples
    --------
    >>> print(Noise([0.01] * 6, [1e-4] * 3, [0, 0, 0, 0, 0, 1.5]))
    u 0.01, v 0.01, w 0.01 m/s; p 0.01, q 0.01, r 0.01 rad/s; disturbance N 1.5
    """

    velocity: FloatArray
    turn: FloatArray
    disturbance: FloatArray

    def __post_init__(self) -> None:
        """Copy, check and freeze."""
        for name, size in (("velocity", 6), ("turn", 3), ("disturbance", 6)):
            try:
                values = frozen(getattr(self, name), (size,), name)
            except ValueError as error:
                raise MethodError(str(error)) from error
            lowest = 0.0 if name == "disturbance" else np.finfo(np.float64).tiny
            if not (np.isfinite(values).all() and values.min() >= lowest):
                kind = "zero or more" if name == "disturbance" else "positive"
                raise MethodError(f"`{name}` must be {kind} and finite; got {values}")
            object.__setattr__(self, name, values)

    def of_samples(self, steps: Steps) -> FloatArray:
        """Return the variances of the errors of one sample, shape (width,)."""
        return np.concatenate([self.velocity[steps.free], self.turn[steps.turning]]) ** 2

    def of_steps(self, steps: Steps) -> FloatArray:
        """Return the spectral densities of the free axes, shape (n_free,)."""
        densities: FloatArray = self.disturbance[steps.free] ** 2
        return densities

    def scaled(
        self, steps: Steps, samples: FloatArray, disturbance: FloatArray, loudest: Noise
    ) -> Noise:
        """Return other levels, none of a sensor above the loudest.

        Parameters
        ----------
        steps : Steps
            Says which axes are free.
        samples : ndarray, shape (width,)
            Factors of the variances of the sensors.
        disturbance : ndarray, shape (n_free,)
            Factors of the spectral densities.
        loudest : Noise
            Limits the sensors.

        Returns
        -------
        noise : Noise
            Locked axes keep their levels.
        """
        n_free = len(steps.free)
        velocity, turn, density = (np.ones(size) for size in (6, 3, 6))
        velocity[steps.free], turn[steps.turning] = samples[:n_free], samples[n_free:]
        density[steps.free] = disturbance
        return Noise(
            np.clip(self.velocity * np.sqrt(velocity), _QUIETEST, loudest.velocity),
            np.clip(self.turn * np.sqrt(turn), _QUIETEST, loudest.turn),
            self.disturbance * np.sqrt(density),
        )

    def disturbed(self, disturbance: FloatArray) -> Noise:
        """Return the same sensors under other disturbances, shape (6,)."""
        return replace(self, disturbance=disturbance)

    def __str__(self) -> str:
        """Return the levels on one line; locked axes and silent ones are left out."""
        linear = _listed(VELOCITIES[:3], self.velocity[:3], _QUIETEST)
        rates = _listed(VELOCITIES[3:], self.velocity[3:], _QUIETEST)
        wrench = _listed(AXES, self.disturbance, 0.0)
        return f"{linear} m/s; {rates} rad/s; disturbance {wrench}"


def _listed(names: tuple[str, ...], levels: FloatArray, silent: float) -> str:
    pairs = zip(names, levels.tolist(), strict=True)
    return ", ".join(f"{name} {level:.3g}" for name, level in pairs if level > silent) or "none"


def sensor_noise(problem: Problem) -> Noise:
    """Estimate the noise of the sensors from what no smooth motion has."""
    bounds = problem.segments.tolist()
    order = min(4, max(stop - start for start, stop in bounds) - 1)
    velocity, attitude = problem.inputs.velocity, problem.log.attitude
    turn = np.zeros((problem.n_samples, 3))
    if attitude is not None:
        turn[1:] = np.cumsum(attitudes.turn(attitude[:-1], attitude[1:]), axis=0)

    def white(values: FloatArray) -> FloatArray:
        parts = [np.diff(values[a:b], n=order, axis=0) ** 2 for a, b in bounds]
        variance = np.concatenate(parts).mean(axis=0) / comb(2 * order, order)
        level: FloatArray = np.maximum(np.sqrt(variance), _QUIETEST)
        return level

    return Noise(white(velocity), white(turn), np.zeros(6))

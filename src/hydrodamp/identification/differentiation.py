"""Acceleration, noise variance and smoothing of measured velocities.

Numerical differentiation by finite differences or Savitzky-Golay filters; the white-noise variance
from fourth differences, ``σ² = mad_std(Δ⁴ν)² / 70``; and local quadratics whose window minimises
Stein's unbiased risk estimate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.conditioning.derivatives import differences_from_centre, fit_local_polynomials
from hydrodamp.data.record import unrecorded_columns
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.errors import MethodError, demand
from hydrodamp.simulation.problem import Problem

# Times (n,) and values (n, k) of one segment -> derivatives (n, k).
Slopes = Callable[[FloatArray, FloatArray], FloatArray]


class Derivative(ABC):
    """Numerical differentiation of the velocities, segment by segment."""

    @abstractmethod
    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        """Return the derivatives of the values of one segment."""

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return the derivatives of the velocities.

        Parameters
        ----------
        problem : Problem
            Velocities and segments.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Linear [m/s^2] and angular [rad/s^2]; no segment boundary is crossed.
        """
        return _by_segment(problem, problem.inputs.velocity, self._slopes)

    def filter_held_inputs(self, problem: Problem) -> Problem:
        """Return the problem with sample-and-hold inputs filtered like the derivative."""
        inputs = problem.inputs
        n_propulsion = int(problem.propulsion_known and problem.log.propulsion_ratio is None)
        values = np.hstack([inputs.channels, inputs.propulsion[:, :n_propulsion]])
        if not values.size:
            return problem
        # A velocity integrates its inputs: differentiate their integral by the same filter.
        filtered = _by_segment(problem, values, lambda t, rows: self._slopes(t, _integral(t, rows)))
        propulsion = inputs.propulsion.copy()
        propulsion[:, :n_propulsion] = filtered[:, inputs.n_channels :]
        channels = filtered[:, : inputs.n_channels]
        return replace(problem, inputs=replace(inputs, channels=channels, propulsion=propulsion))


@dataclass(frozen=True)
class FiniteDifference(Derivative):
    """Central differences of second order, as in the paper; one-sided at the ends of a segment."""

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        return np.gradient(values, time, axis=0, edge_order=2 if len(time) > 2 else 1)


@dataclass(frozen=True)
class RecordedAcceleration(FiniteDifference):
    """The acceleration columns ``du … dr`` of the log; finite differences for absent ones."""

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return recorded accelerations, and differences of the velocities for absent ones.

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
        if (absent := _unrecorded(problem)).any():
            recorded = np.where(absent, super().acceleration(problem), recorded)
        return recorded if free.all() else np.where(free, recorded, 0.0)  # a long log is not copied

    def filter_held_inputs(self, problem: Problem) -> Problem:
        """Filter the inputs of the axes without a recorded acceleration."""
        if not (absent := _unrecorded(problem)).any():
            return problem
        filtered, known = super().filter_held_inputs(problem), slice(problem.equations.n_known)
        change = (problem.regressor() - filtered.regressor())[:, known] @ problem.equations.known
        wrench = problem.inputs.wrench + np.where(absent, 0.0, change)
        return replace(filtered, inputs=replace(filtered.inputs, wrench=wrench))


def _unrecorded(problem: Problem) -> BoolArray:
    assert problem.log.acceleration is not None
    return unrecorded_columns("acceleration", problem.log.acceleration) & problem.vehicle.free


@dataclass(frozen=True)
class SavitzkyGolay(Derivative):
    """The derivative of a polynomial fitted to a window around each sample.

    Parameters
    ----------
    window : float
        Length of the window [s]; it has at least ``order + 2`` samples.
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
        """Check the settings."""
        demand(self.window > 0.0, "window", "positive [s]", self.window)
        demand(1 <= self.order <= 5, "order", "1 to 5", self.order)

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        order = min(self.order, len(time) - 1)
        half = max(round(self.window / float(np.median(np.diff(time))) / 2.0), order // 2 + 1)
        bounds, window = np.array([[0, len(time)]]), 2 * half + 1
        differences = differences_from_centre(values)
        return fit_local_polynomials(time, bounds, differences, window, degree=order).slope


def default_derivative(problem: Problem) -> Derivative:
    """Return the derivative of method ``ls``: recorded accelerations, else finite differences."""
    return FiniteDifference() if problem.log.acceleration is None else RecordedAcceleration()


def _by_segment(problem: Problem, values: FloatArray, slopes: Slopes) -> FloatArray:
    result = np.empty_like(values)
    for start, stop in problem.segments.tolist():
        result[start:stop] = slopes(problem.inputs.time[start:stop], values[start:stop])
    return result


def _integral(time: FloatArray, values: FloatArray) -> FloatArray:
    steps = np.diff(time)[:, None]
    return np.vstack([np.zeros((1, values.shape[1])), np.cumsum(values[:-1] * steps, axis=0)])


# Samples whose regressors are in memory at once.
_CHUNK_SAMPLES = 4096


def median_step(problem: Problem) -> float:
    """Return the median sampling step [s] within segments; 1 s if no segment has two samples."""
    time = problem.inputs.time
    steps = np.concatenate([np.diff(time[start:stop]) for start, stop in problem.segments])
    return float(np.median(steps)) if len(steps) else 1.0


def signal_to_noise(problem: Problem) -> FloatArray:
    """Return the variance of each velocity over that of its white noise, from fourth differences.

    A robust scale of the differences keeps fin movements out of the noise.
    """
    velocity = problem.inputs.velocity
    segments = (velocity[start:stop] for start, stop in problem.segments)
    differences = np.concatenate([np.diff(segment, n=4, axis=0) for segment in segments])
    if not len(differences):
        differences = np.zeros((1, 6))
    deviation = np.median(np.abs(differences), axis=0) / 0.6745  # of a normal distribution
    noise = deviation**2 / 70.0  # 70 = 1 + 16 + 36 + 16 + 1
    signal = velocity.var(axis=0)
    floor = np.maximum(noise, 1e-6 * signal)
    ratio: FloatArray = np.divide(signal, floor, out=np.ones(6), where=floor > 0.0)
    return np.maximum(ratio, 1.0)


def noise_variance(problem: Problem) -> FloatArray:
    """Return the variance of the white noise of each velocity."""
    return np.asarray(problem.inputs.velocity.var(axis=0) / signal_to_noise(problem))


def regressor_mean_square(problem: Problem) -> FloatArray:
    """Return the mean square of every regressor of an unknown coefficient."""
    total = np.zeros(len(problem.equations.basis))
    for start in range(0, problem.n_samples, _CHUNK_SAMPLES):
        stop = min(start + _CHUNK_SAMPLES, problem.n_samples)
        xi = problem.regressor(start, stop)[:, problem.equations.n_known :]
        total += np.einsum("nj,nj->j", xi, xi)
    return total / problem.n_samples


#: Windows of local quadratics that smooth velocities [samples].
SMOOTHING_WINDOWS = (5, 7, 9, 11, 15, 21, 31)


def velocity_correlation_time(problem: Problem) -> float:
    """Return the time scale [s] of the smoothed velocities of the free axes."""
    velocity = smooth_velocity(problem)[0][:, problem.vehicle.free]
    return motion_time_scale(problem.inputs.time, velocity, problem.segments)


def smooth_velocity(
    problem: Problem, windows: Sequence[int] = SMOOTHING_WINDOWS
) -> tuple[FloatArray, tuple[int, ...], FloatArray]:
    """Return smoothed velocities, the window of each [samples], and the risk of each.

    Local quadratics over the window of the least risk, Stein's unbiased estimate of the mean square
    error under white noise. A window of 1 leaves a velocity as measured.
    """
    from scipy.ndimage import correlate1d  # takes long to import

    measured, noise = problem.inputs.velocity, noise_variance(problem)
    least, velocity, selected = noise.copy(), measured.copy(), np.ones(6, dtype=int)
    for window in windows:
        half = window // 2
        span = np.linalg.qr(np.vander(np.arange(window) - half, 3))[0]
        hat = span @ span.T  # hat matrix of a quadratic
        leverage, trial = float(hat[half, half]), correlate1d(measured, hat[half], axis=0)
        for start, stop in problem.segments.tolist():
            if stop - start < window:
                trial[start:stop] = measured[start:stop]
                continue
            trial[start : start + half] = hat[:half] @ measured[start : start + window]
            trial[stop - half : stop] = hat[half + 1 :] @ measured[stop - window : stop]
        risk = np.mean((trial - measured) ** 2, axis=0) + (2.0 * leverage - 1.0) * noise
        better = risk < least
        velocity[:, better], selected[better] = trial[:, better], window
        least = np.minimum(least, risk)
    return velocity, tuple(selected.tolist()), np.maximum(least, 0.0)

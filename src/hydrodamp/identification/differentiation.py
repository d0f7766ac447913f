"""What measured velocities tell by themselves: their slopes, their noise, and the size of terms."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.conditioning.derivatives import differences_from_centre, fit_local_polynomials
from hydrodamp.data.record import unrecorded_columns
from hydrodamp.errors import MethodError, demand
from hydrodamp.simulation.problem import Problem

# From times (n,) and values (n, k) of one segment to slopes (n, k).
Slopes = Callable[[FloatArray, FloatArray], FloatArray]


class Derivative(ABC):
    """A way to an acceleration: slopes of the velocities, segment by segment."""

    @abstractmethod
    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        """Return the slopes of the values of one segment."""

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

    def filter_held_inputs(self, problem: Problem) -> Problem:
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
class FiniteDifference(Derivative):
    """Central differences of second order, as in the paper; one-sided at a segment's ends."""

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        return np.gradient(values, time, axis=0, edge_order=2 if len(time) > 2 else 1)


@dataclass(frozen=True)
class RecordedAcceleration(FiniteDifference):
    """The acceleration columns ``du … dr`` of the log; differences where one is absent."""

    def acceleration(self, problem: Problem) -> FloatArray:
        """Return what was recorded, and differences of the velocities for the rest.

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
        if (absent := _unrecorded(problem)).any():
            recorded = np.where(absent, super().acceleration(problem), recorded)
        return recorded if free.all() else np.where(free, recorded, 0.0)  # a long log is not copied

    def filter_held_inputs(self, problem: Problem) -> Problem:
        """Return the problem itself, but for axes that are differenced as differences see it."""
        if not (absent := _unrecorded(problem)).any():
            return problem
        seen, known = super().filter_held_inputs(problem), slice(problem.equations.n_known)
        held = (problem.regressor() - seen.regressor())[:, known] @ problem.equations.known
        wrench = problem.inputs.wrench + np.where(absent, 0.0, held)
        return replace(seen, inputs=replace(seen.inputs, wrench=wrench))


def _unrecorded(problem: Problem) -> BoolArray:
    assert problem.log.acceleration is not None
    return unrecorded_columns("acceleration", problem.log.acceleration) & problem.vehicle.free


@dataclass(frozen=True)
class SavitzkyGolay(Derivative):
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
        demand(self.window > 0.0, "window", "positive [s]", self.window)
        demand(1 <= self.order <= 5, "order", "1 to 5", self.order)

    def _slopes(self, time: FloatArray, values: FloatArray) -> FloatArray:
        order = min(self.order, len(time) - 1)
        half = max(round(self.window / float(np.median(np.diff(time))) / 2.0), order // 2 + 1)
        whole = np.array([[0, len(time)]])
        return fit_local_polynomials(
            time, whole, differences_from_centre(values), 2 * half + 1, degree=order
        ).slope


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


# Samples whose terms are held at once.
_BLOCK = 4096


def median_step(problem: Problem) -> float:
    """Return the median step between samples of one segment [s]; one second where there is none."""
    steps = [np.diff(problem.inputs.time[start:stop]) for start, stop in problem.segments]
    every = np.concatenate(steps)
    return float(np.median(every)) if len(every) else 1.0


def signal_to_noise(problem: Problem) -> FloatArray:
    """Return variance over white noise of each velocity, from its fourth differences.

    Their median counts, not their mean square: it takes no turn of a fin for noise.
    """
    velocity = problem.inputs.velocity
    left = [np.diff(velocity[start:stop], n=4, axis=0) for start, stop in problem.segments]
    differences = np.concatenate([part for part in left if len(part)] or [np.zeros((1, 6))])
    deviation = np.median(np.abs(differences), axis=0) / 0.6745  # of a normal distribution
    noise = deviation**2 / 70.0  # 70 = 1 + 16 + 36 + 16 + 1
    signal = velocity.var(axis=0)
    floor = np.maximum(noise, 1e-6 * signal)
    ratio: FloatArray = np.divide(signal, floor, out=np.ones(6), where=floor > 0.0)
    return np.maximum(ratio, 1.0)


def noise_variance(problem: Problem) -> FloatArray:
    """Return the variance of the white noise of each velocity."""
    variance: FloatArray = problem.inputs.velocity.var(axis=0) / signal_to_noise(problem)
    return variance


def regressor_mean_square(problem: Problem) -> FloatArray:
    """Return the mean square of every unknown column over a log."""
    total = np.zeros(len(problem.equations.basis))
    for start in range(0, problem.n_samples, _BLOCK):
        stop = min(start + _BLOCK, problem.n_samples)
        xi = problem.regressor(start, stop)[:, problem.equations.n_known :]
        total += np.einsum("nj,nj->j", xi, xi)
    return total / problem.n_samples


#: Lengths of local quadratics offered to each velocity [samples].
SMOOTHING_WINDOWS = (5, 7, 9, 11, 15, 21, 31)


def smooth_velocity(
    problem: Problem, windows: Sequence[int] = SMOOTHING_WINDOWS
) -> tuple[FloatArray, tuple[int, ...], FloatArray]:
    """Return velocities by local quadratics, each over the window of the least risk.

    The windows chosen [samples] come with them, one where a velocity is best as measured, and the
    risks: Stein's estimate of the mean square error under white noise.
    """
    from scipy.ndimage import correlate1d  # takes long to import

    measured, noise = problem.inputs.velocity, noise_variance(problem)
    best, velocity, chosen = noise.copy(), measured.copy(), np.ones(6, dtype=int)
    for window in windows:
        half = window // 2
        span = np.linalg.qr(np.vander(np.arange(window) - half, 3))[0]
        hat = span @ span.T  # what a quadratic makes of the samples of a window, each its row
        own, trial = float(hat[half, half]), correlate1d(measured, hat[half], axis=0)
        for start, stop in problem.segments.tolist():
            if stop - start < window:
                trial[start:stop] = measured[start:stop]
                continue
            trial[start : start + half] = hat[:half] @ measured[start : start + window]
            trial[stop - half : stop] = hat[half + 1 :] @ measured[stop - window : stop]
        risk = np.mean((trial - measured) ** 2, axis=0) + (2.0 * own - 1.0) * noise
        better = risk < best
        velocity[:, better], chosen[better] = trial[:, better], window
        best = np.minimum(best, risk)
    return velocity, tuple(chosen.tolist()), np.maximum(best, 0.0)

r"""What each step of a log leaves unexplained, and how that answers to errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import BoolArray, FloatArray, IndexArray, IntArray
from hydrodamp.data import attitude as attitudes
from hydrodamp.identification.smoothing.track import Track
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.simulation.problem import Problem

_NONE = np.empty((0, 2), dtype=np.int32)


@dataclass(frozen=True, eq=False)
class Steps:
    """The steps between neighbouring samples, never across a join."""

    first: IntArray
    length: FloatArray
    joined: BoolArray
    free: IntArray
    turning: IntArray

    @classmethod
    def of(cls, problem: Problem) -> Steps:
        """Return the steps of a problem."""
        inside = np.ones(problem.n_samples, dtype=np.bool_)
        inside[problem.segments[:, 1] - 1] = False
        first = np.flatnonzero(inside)
        free = np.flatnonzero(problem.vehicle.free)
        turning = free[free >= 3] - 3 if problem.log.attitude is not None else free[:0]
        time = problem.inputs.time
        return cls(first, time[first + 1] - time[first], np.diff(first) == 1, free, turning)

    @property
    def n(self) -> int:
        """How many there are."""
        return len(self.first)

    @property
    def width(self) -> int:
        """How many rows a step has, and how many errors a sample."""
        return len(self.free) + len(self.turning)


@dataclass(frozen=True, eq=False)
class Transitions:
    """All steps of a log, linearised along a track."""

    steps: Steps
    defect: FloatArray
    before: FloatArray
    after: FloatArray

    def at_steps(self, errors: FloatArray) -> FloatArray:
        """Return what errors of the samples do to the steps."""
        first = self.steps.first
        ends = errors[first, :, None], errors[first + 1, :, None]
        change: FloatArray = (self.before @ ends[0] + self.after @ ends[1])[..., 0]
        return change

    def at_samples(self, weights: FloatArray, n: int) -> FloatArray:
        """Return the transpose of :meth:`at_steps` applied to weights of the steps."""
        first, result = self.steps.first, np.zeros((n, self.steps.width))
        result[first] += (weights[:, None, :] @ self.before)[:, 0]
        result[first + 1] += (weights[:, None, :] @ self.after)[:, 0]
        return result


def transitions(problem: Problem, steps: Steps, matrix: FloatArray, track: Track) -> Transitions:
    """Linearise every step along a track."""
    n_free, inputs = len(steps.free), track.inputs(problem)
    reached, slope = _one_step(problem, steps, matrix, inputs, np.arange(steps.n), _NONE)
    inertia = _mass(problem, steps) / steps.length[:, None, None]
    ends = track.velocity[steps.first + 1][:, steps.free]
    defect = np.zeros((steps.n, steps.width))
    before, after = np.zeros((2, steps.n, steps.width, steps.width))
    defect[:, :n_free] = (inertia @ (ends - reached)[..., None])[..., 0]
    before[:, :n_free, :n_free] = -inertia @ slope[:, :, steps.free]
    after[:, :n_free, :n_free] = inertia
    if len(steps.turning):
        pose = track.attitude(problem)
        assert pose is not None  # there is a turn only where one was recorded
        made = attitudes.turn(pose[steps.first], pose[steps.first + 1])
        mean = _mean_rate(problem, steps, matrix, inputs)
        defect[:, n_free:] = (made / steps.length[:, None] - mean)[:, steps.turning]
        _kinematics(steps, made, before, after)
    return Transitions(steps, defect, before, after)


def by_coefficients(
    problem: Problem,
    steps: Steps,
    matrix: FloatArray,
    inputs: Inputs,
    chosen: IntArray,
    parameters: IndexArray,
) -> FloatArray:
    """Differentiate what some steps explain by the coefficients."""
    _, jacobian = _one_step(problem, steps, matrix, inputs, chosen, parameters)
    result = np.zeros((len(chosen), steps.width, len(parameters)))
    inertia = _mass(problem, steps) / steps.length[chosen, None, None]
    result[:, : len(steps.free)] = inertia @ jacobian[:, :, : len(parameters)]
    return result


def accelerations(
    problem: Problem, matrix: FloatArray, inputs: Inputs, at: IntArray, held: IntArray
) -> FloatArray:
    """Return the acceleration of equation 1 at some samples."""
    plant, velocity, free = problem.columns.plant, inputs.velocity[at], problem.vehicle.free
    channels, speed = inputs.channels[held], inputs.propulsion[held, 0]
    xi = kernels.regressor(plant.factors, velocity, inputs.down[at], channels, speed)
    mass = problem.vehicle.mass_matrix
    wrench = xi @ matrix + inputs.wrench[at] + kernels.coriolis(mass, velocity)
    result = np.zeros((len(at), 6))
    result[:, free] = np.linalg.solve(mass[np.ix_(free, free)], wrench[:, free].T).T
    return result


def _one_step(
    problem: Problem,
    steps: Steps,
    matrix: FloatArray,
    inputs: Inputs,
    chosen: IntArray,
    parameters: IndexArray,
) -> tuple[FloatArray, FloatArray]:
    """Velocity reached on the free axes, and its slope by coefficients and first velocity."""
    ends = (steps.first[chosen, None] + np.arange(2)).ravel()
    pairs = Inputs(
        inputs.time[ends],
        inputs.velocity[ends],
        inputs.down[ends],
        inputs.wrench[ends],
        inputs.channels[ends],
        inputs.propulsion[ends],
    )
    spans = 2 * np.arange(len(chosen))[:, None] + np.array([0, 2])
    plant = problem.columns.plant
    velocity, slope = kernels.sensitivities(plant, matrix, parameters, pairs, spans)
    return velocity[1::2][:, steps.free], slope[1::2][:, steps.free]


def _mass(problem: Problem, steps: Steps) -> FloatArray:
    return problem.vehicle.mass_matrix[np.ix_(steps.free, steps.free)]


def _mean_rate(problem: Problem, steps: Steps, matrix: FloatArray, inputs: Inputs) -> FloatArray:
    """Mean rate whose turn is that of the step: Hermite's rule and the first Magnus term."""
    first, length = steps.first, steps.length[:, None]
    opening = accelerations(problem, matrix, inputs, first, first)[:, 3:]
    closing = accelerations(problem, matrix, inputs, first + 1, first)[:, 3:]
    one, other = inputs.velocity[first, 3:], inputs.velocity[first + 1, 3:]
    bend: FloatArray = length / 12.0 * (opening - closing + np.cross(one, other))
    return (one + other) / 2.0 + bend


def _kinematics(steps: Steps, made: FloatArray, before: FloatArray, after: FloatArray) -> None:
    """Fill in the rows of attitude, to first order in the turn of a step."""
    n_free, turning = len(steps.free), steps.turning
    rates = np.searchsorted(steps.free, turning + 3)
    places = n_free + np.arange(len(turning))
    before[:, places, rates] = after[:, places, rates] = -0.5
    bend = np.cross(made[:, None, :], np.eye(3)).swapaxes(1, 2) / 2.0
    pick = np.ix_(np.arange(steps.n), turning, turning)
    per_second = 1.0 / steps.length[:, None, None]
    before[:, n_free:, n_free:] = (bend - np.eye(3))[pick] * per_second
    after[:, n_free:, n_free:] = (bend + np.eye(3))[pick] * per_second

"""The smoothed log: what the motion was, by the sensors and by the model together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.derivative import SavitzkyGolay
from hydrodamp.identification.rows.triangle import damping_wrench
from hydrodamp.identification.smoothing.noise import Noise, sensor_noise
from hydrodamp.identification.smoothing.step_errors import StepErrors
from hydrodamp.identification.smoothing.track import Track
from hydrodamp.identification.smoothing.transition import (
    Steps,
    Transitions,
    accelerations,
    transitions,
)
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem

_PASSES = 40
_STILL = 1e-3
"""A track has settled where no pass moves it by more than this share of the noise."""

_CONVERGED = 0.1
"""Noise levels have settled where minus twice the log-likelihood changes by less."""

_DOUBT = 10.0
"""How much more a model is doubted at first than its residuals say: smoothing starts
from the sensors and comes to trust the model, not the other way round."""

_SEED = 20
"""Of the random signs that stand for noise in a trace."""


@dataclass(frozen=True, eq=False)
class Pass:
    """All steps of a log along one track, under given noise."""

    problem: Problem
    track: Track
    noise: Noise
    linear: Transitions
    errors: StepErrors
    missing: FloatArray

    @classmethod
    def along(
        cls, problem: Problem, steps: Steps, matrix: FloatArray, track: Track, noise: Noise
    ) -> Pass:
        """Linearise along a track."""
        linear = transitions(problem, steps, matrix, track)
        errors = StepErrors.of(linear, noise)
        departure = problem.inputs.velocity - track.velocity
        apart = np.hstack([departure[:, steps.free], -track.turn[:, steps.turning]])
        return cls(problem, track, noise, linear, errors, linear.defect + linear.at_steps(apart))

    def weights(self) -> FloatArray:
        """Return what is missing, weighed by its covariance, shape (n_steps, width)."""
        return self.errors.weigh(self.missing.reshape(-1, 1)).reshape(self.missing.shape)

    def deviance(self, weights: FloatArray) -> float:
        """Return minus twice the logarithm of the likelihood, but for a constant."""
        return float(np.sum(weights * self.missing)) + self.errors.log_determinant

    def smoothed(self, weights: FloatArray) -> Track:
        """Return the most probable track, to first order."""
        steps, n_free = self.linear.steps, len(self.linear.steps.free)
        answer = self.linear.at_samples(weights, self.problem.n_samples)
        error = answer * self.noise.of_samples(steps)
        velocity, turn = self.problem.inputs.velocity.copy(), np.zeros_like(self.track.turn)
        velocity[:, steps.free] -= error[:, :n_free]
        turn[:, steps.turning] = -error[:, n_free:]
        return Track(velocity, turn)

    def disturbance(self, weights: FloatArray) -> FloatArray:
        """Return the most probable disturbance of each step, shape (n_steps, 6) [N, N m]."""
        steps = self.linear.steps
        wrench = np.zeros((steps.n, 6))
        density = self.noise.of_steps(steps) / steps.length[:, None]
        wrench[:, steps.free] = weights[:, : len(steps.free)] * density
        return wrench

    def explained(self, weights: FloatArray, loudest: Noise) -> Noise:
        """Return the noise levels that explain what this pass found."""
        steps, n = self.linear.steps, self.problem.n_samples
        rng, root = np.random.default_rng(_SEED), np.sqrt(steps.length)[:, None]
        probes = [self.linear.at_steps(one) for one in _signs(rng, n, steps, steps.width)]
        probes += [one / root for one in _signs(rng, steps.n, steps, len(steps.free))]
        columns = np.stack(probes, axis=-1).reshape(-1, len(probes))
        expected = np.square(self.errors.whiten(columns)).sum(axis=0)
        found = [
            np.square(self.linear.at_samples(weights, n)).sum(axis=0),
            np.square(weights[:, : len(steps.free)] / root).sum(axis=0),
        ]
        ratio = np.clip(np.concatenate(found) / expected, 0.1, 10.0)
        return self.noise.scaled(steps, ratio[: steps.width], ratio[steps.width :], loudest)


def smooth(problem: Problem, damping: Damping, noise: Noise | None = None) -> Log:
    """Smooth a log with a model.

    Parameters
    ----------
    problem : Problem
        Prepared for (at least) the terms of the damping.
    damping : Damping
        The model with its numbers.
    noise : Noise, optional
        Of sensors and disturbances; found from the log by maximum likelihood where
        not given, see :func:`noise_levels`.

    Returns
    -------
    log : Log
        With smoothed velocities and attitude, and with accelerations, those of the
        model and the disturbance that follows each sample. Prepare it again to use it.

    Raises
    ------
    MethodError
        If a step of the model runs away.
    """
    steps = Steps.of(problem)
    levels = noise_levels(problem, damping) if noise is None else noise
    matrix, track = problem.matrix(damping), Track.recorded(problem)
    try:
        for _ in range(_PASSES):
            here = Pass.along(problem, steps, matrix, track, levels)
            weights = here.weights()
            last, track = track, here.smoothed(weights)
            if _moved(track, last, levels) < _STILL:
                break
    except np.linalg.LinAlgError as error:
        raise _ran_away(damping) from error
    return _logged(problem, matrix, track, steps, here.disturbance(weights))


def noise_levels(problem: Problem, damping: Damping) -> Noise:
    """Find how noisy the sensors are and how large the disturbances, by likelihood.

    Parameters
    ----------
    problem : Problem
        Prepared for (at least) the terms of the damping.
    damping : Damping
        The model with its numbers.

    Returns
    -------
    noise : Noise
        No sensor noisier than its fourth differences allow; a wrong model shows as
        a disturbance.

    Raises
    ------
    MethodError
        If a step of the model runs away.
    """
    steps, matrix = Steps.of(problem), problem.matrix(damping)
    loudest, track = sensor_noise(problem), Track.recorded(problem)
    noise, before = loudest.disturbed(first_disturbance(problem, matrix)), np.inf
    try:
        for _ in range(_PASSES):
            here = Pass.along(problem, steps, matrix, track, noise)
            weights = here.weights()
            deviance = here.deviance(weights)
            track, noise = here.smoothed(weights), here.explained(weights, loudest)
            if abs(before - deviance) < _CONVERGED:
                break
            before = deviance
    except np.linalg.LinAlgError as error:
        raise _ran_away(damping) from error
    return noise


def first_disturbance(problem: Problem, matrix: FloatArray) -> FloatArray:
    """Estimate the disturbances from above, by residuals on smoothed slopes."""
    slopes = SavitzkyGolay()
    seen = slopes.seen(problem)
    wrench = damping_wrench(seen, slopes.acceleration(problem))
    known = problem.columns.n_known
    rest = wrench - seen.regressor()[:, known:] @ matrix[known:]
    step = float(np.mean(Steps.of(problem).length))
    root: FloatArray = np.sqrt(_DOUBT * step * np.mean(np.square(rest), axis=0))
    return root


def _signs(rng: np.random.Generator, n: int, steps: Steps, columns: int) -> list[FloatArray]:
    """Random signs in one column after the other, the rest zero."""
    return [
        np.where(np.arange(steps.width) == column, rng.choice([-1.0, 1.0], size=(n, 1)), 0.0)
        for column in range(columns)
    ]


def _moved(track: Track, last: Track, noise: Noise) -> float:
    velocity = np.abs((track.velocity - last.velocity) / noise.velocity)
    turn = np.abs((track.turn - last.turn) / noise.turn)
    return max(float(velocity.max()), float(turn.max()))


def _logged(
    problem: Problem, matrix: FloatArray, track: Track, steps: Steps, disturbance: FloatArray
) -> Log:
    every, free = np.arange(problem.n_samples), problem.vehicle.free
    acting = np.zeros((problem.n_samples, 6))
    acting[steps.first + 1] = disturbance  # the last sample of a segment has no step after it
    acting[steps.first] = disturbance
    mass = problem.vehicle.mass_matrix[np.ix_(free, free)]
    acceleration = accelerations(problem, matrix, track.inputs(problem), every, every)
    acceleration[:, free] += np.linalg.solve(mass, acting[:, free].T).T
    velocity = np.where(free, track.velocity, problem.log.velocity)
    pose = track.attitude(problem)
    return replace(problem.log, velocity=velocity, attitude=pose, acceleration=acceleration)


def _ran_away(damping: Damping) -> MethodError:
    return MethodError(
        f"a single step of '{damping.model.key}' with these coefficients runs away from the log, "
        "so it cannot smooth it: identify them by a method that constrains them, or sample faster."
    )

"""Damped Gauss-Newton minimisation of the multi-step (truncated) simulation error.

Windows of a log are simulated from estimated initial states (multiple shooting). For
coefficients κ, ``s_i²(κ; L)`` is the mean square residual of velocity i over all windows of
length L, plus a noise floor, and ``d(κ; L)`` the mean square correction of the initial states
over their prior variance. With ``x = κ / scale``, f velocities and p coefficients, the objective
is the concentrated Gaussian log-likelihood with a ridge prior and an energy-injection penalty::

    J(κ) = mean_L [ (2/f) Σ_i log s_i(κ; L) + d(κ; L) ]
           + (λ/p) |x|² + w mean_k max(0, φ_k·x)²

``φ_k·x`` is the power νᵀτ(ν) at velocities ν_k beyond the operating range, over a usual power.
Steps are Levenberg-Marquardt steps with Nielsen's damping update (1999). Simulation-error
minimisation: Farina and Piroddi (2010).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.conditioning.derivatives import differences_from_centre, fit_local_polynomials
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.identification.differentiation import (
    noise_variance,
    regressor_mean_square,
    smooth_velocity,
)
from hydrodamp.identification.dissipativity import PowerRegressor, sample_box, velocity_box
from hydrodamp.identification.multiple_shooting import (
    MAX_RELATIVE_STEP,
    Windows,
    concatenate_bounds,
    sample_indices,
    split_windows,
)
from hydrodamp.identification.regression import solve_axis
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Smallest standard deviation of a velocity, relative to its largest: rounding is below it.
MIN_RELATIVE_STD = 1e-9

#: Share [1] of the estimated noise in the noise floor: fast motion inflates the estimate.
NOISE_FLOOR_SHARE = 0.5

#: Gauss-Newton steps of a stage of the continuation.
MAX_ITERATIONS = 10

#: Decrease of J [1] below which a stage ends: stages before the last, and the last.
STAGE_TOLERANCE, FINAL_TOLERANCE = 1e-2, 2e-3

#: Smallest Levenberg-Marquardt damping [1], relative to the diagonal of the Hessian.
MIN_DAMPING = 1e-3

#: Increases of the damping before a step is given up.
MAX_DAMPING_TRIALS = 8

#: Prior strength λ [1] before the evidence sets it.
INITIAL_PRIOR_STRENGTH = 0.1

#: Widening [1] of the operating range: the penalty covers velocities up to three times as large.
PENALTY_BOX_MARGIN = 2.0

#: Weight w [1] of the energy-injection penalty before the evidence sets it.
INITIAL_PENALTY_WEIGHT = 10.0

#: Samples per independent residual [1]: the weight of an initial state against the residuals.
SAMPLES_PER_RESIDUAL = 16.0

#: Prior strengths [1] of the weak-form regressions that give initial candidates.
CANDIDATE_PRIOR_STRENGTHS = (1e-6, 1e-4, 1e-2, 1.0)

#: Active-set iterations of the penalty in those regressions.
MAX_ACTIVE_SET_ITERATIONS = 20

#: Smallest residual of those regressions, relative to the target: a smaller one is an overfit.
MIN_RELATIVE_RESIDUAL = 1e-3


class Linearisation(NamedTuple):
    """Residuals of the windows of one length, linearised at their optimal initial states.

    ``residual_std`` (f,) belongs to each velocity, ``normal`` is the normal matrix of the mean
    square residual over the previous ``residual_std``, ``state_correction`` is d(κ; L).
    """

    windows: Windows
    residual_std: FloatArray
    normal: FloatArray
    state_correction: float


@dataclass(frozen=True, eq=False)
class Iterate:
    """Iterate x_k of the minimisation, with a linearisation for each window length so far.

    ``prior_strength`` is λ, ``prior_variance`` the mean square scaled coefficient that the
    evidence assigns to the prior, ``damping`` that of the next step, and ``n_free`` the number of
    independent residuals that do not determine coefficients.
    """

    coefficients: FloatArray
    linearisations: tuple[Linearisation, ...]
    prior_strength: float = INITIAL_PRIOR_STRENGTH
    prior_variance: float = 1.0
    penalty_weight: float = INITIAL_PENALTY_WEIGHT
    damping: float = MIN_DAMPING
    converged: bool = False
    n_free: float = 1.0

    @property
    def window_lengths(self) -> list[float]:
        """Window lengths of the objective [s]."""
        return [linearisation.windows.length for linearisation in self.linearisations]


@dataclass(frozen=True, eq=False)
class ShootingObjective:
    """The objective J without its window lengths: data, scales, and penalty.

    ``initial_state_std`` is the prior standard deviation of initial states around the smoothed
    ``velocity``; ``scale`` is the coefficient that produces the RMS inertial force of its axis;
    ``power_rows`` holds φ_k; ``time_scale`` [s] is that of the motion.
    """

    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    velocity: FloatArray
    initial_state_std: FloatArray
    noise_std: FloatArray
    scale: FloatArray
    power_rows: FloatArray
    time_scale: float

    def restrict(self, bounds: IntArray) -> ShootingObjective:
        """Return the objective of intervals of the log, each a segment of its own."""
        samples, segments = sample_indices(bounds), concatenate_bounds(bounds)
        inputs = self.problem.inputs.select(samples)
        problem = replace(self.problem, inputs=inputs, segments=segments)
        return replace(self, problem=problem, velocity=self.velocity[samples])

    def windows(self, length: float) -> Windows:
        """Return windows of a length [s] with initial states at the smoothed velocity."""
        bounds, std = split_windows(self.problem, length), self.initial_state_std
        states, max_step = self.velocity[bounds[:, 0]], MAX_RELATIVE_STEP * self.time_scale
        return Windows(length, self.problem, self.entries, bounds, states, std, max_step)

    def windows_like(self, windows: Windows) -> Windows:
        """Return windows with the length and the prior standard deviation of others."""
        return replace(self.windows(windows.length), initial_state_std=windows.initial_state_std)

    def widen_initial_states(self, iterate: Iterate, factor: float) -> Iterate:
        """Return the iterate with a larger prior standard deviation of the initial states."""
        std = factor * self.initial_state_std
        linearisations = tuple(
            each._replace(windows=replace(each.windows, initial_state_std=std))
            for each in iterate.linearisations
        )
        return self.move(replace(iterate, linearisations=linearisations), iterate.coefficients)

    def residual_std(self, coefficients: FloatArray, windows: Windows) -> FloatArray:
        """Return s_i (f,) with the initial states at their prior mean."""
        return self._std(np.mean(windows.residuals(coefficients) ** 2, axis=0))

    def _std(self, mean_square: FloatArray) -> FloatArray:
        return np.asarray(np.sqrt(np.maximum(mean_square, 0.0) + self.noise_std**2))

    def linearise(
        self, coefficients: FloatArray, windows: Windows, residual_std: FloatArray
    ) -> Linearisation:
        """Linearise the residuals of all windows at their optimal initial states."""
        normal, mean_square, correction = windows.linearise(coefficients, residual_std)
        return Linearisation(windows, self._std(mean_square), normal, correction)

    def add_length(self, iterate: Iterate, windows: Windows) -> Iterate:
        """Return the iterate with windows of a further length in the objective."""
        residual_std = self.residual_std(iterate.coefficients, windows)
        linearisation = self.linearise(iterate.coefficients, windows, residual_std)
        return replace(iterate, linearisations=(*iterate.linearisations, linearisation))

    def move(self, iterate: Iterate, coefficients: FloatArray) -> Iterate:
        """Return the iterate at other coefficients, residuals weighted as at the previous one."""
        linearisations = tuple(
            self.linearise(coefficients, previous.windows, previous.residual_std)
            for previous in iterate.linearisations
        )
        return replace(iterate, coefficients=coefficients, linearisations=linearisations)

    def cost(self, iterate: Iterate) -> float:
        """Return J(κ)."""
        _, residual_std, _, corrections = zip(*iterate.linearisations, strict=True)
        likelihood = 2.0 * float(np.mean(np.log(residual_std))) + float(np.mean(corrections))
        return likelihood + self.penalty(iterate)

    def penalty(self, iterate: Iterate) -> float:
        """Return the prior and the energy-injection penalty of J(κ)."""
        x = iterate.coefficients / self.scale
        injection = float(np.mean(np.maximum(self.power_rows @ x, 0.0) ** 2))
        return iterate.prior_strength * float(np.mean(x**2)) + iterate.penalty_weight * injection

    def gauss_newton(self, iterate: Iterate) -> tuple[FloatArray, FloatArray]:
        """Return matrix and right-hand side of the likelihood's normal equations in x."""
        normal = np.mean([each.normal for each in iterate.linearisations], axis=0)
        hessian = normal[:-1, :-1] * self.scale[:, None] * self.scale
        return hessian, normal[:-1, -1] * self.scale

    def penalty_hessian(
        self, x: FloatArray, prior_strength: float, penalty_weight: float
    ) -> FloatArray:
        """Return half the Hessian of the prior and the energy-injection penalty."""
        active = self.power_rows[self.power_rows @ x > 0.0]
        injection = penalty_weight / len(self.power_rows) * (active.T @ active)
        return np.asarray(prior_strength / len(x) * np.eye(len(x)) + injection)


def make_objective(problem: Problem, model: DampingModel) -> ShootingObjective:
    """Build the objective of a model's coefficients."""
    rows, axes = entries = problem.equations.entries(model)
    inputs, free = problem.inputs, problem.vehicle.free
    velocity, _, risk = smooth_velocity(problem)
    largest = np.abs(velocity[:, free]).max(axis=0)
    min_std = MIN_RELATIVE_STD * np.where(largest > 0.0, largest, 1.0)
    initial_state_std = np.maximum(np.sqrt(risk / SAMPLES_PER_RESIDUAL)[free], min_std)
    noise_std = np.maximum(NOISE_FLOOR_SHARE * np.sqrt(noise_variance(problem))[free], min_std)
    time, segments, change = inputs.time, problem.segments, differences_from_centre(inputs.velocity)
    acceleration = fit_local_polynomials(time, segments, change, 15, degree=3).slope
    inertial = np.sqrt(np.mean((acceleration @ problem.vehicle.mass_matrix.T) ** 2, axis=0))
    force = inertial[axes]
    size = np.sqrt(regressor_mean_square(problem))[rows - problem.equations.n_known]
    scale = np.where((size > 0.0) & (force > 0.0), force / np.where(size > 0.0, size, 1.0), 1.0)
    box = velocity_box(velocity, PENALTY_BOX_MARGIN, 0.0).restrict(free)
    usual_power = float(np.linalg.norm(box.max_abs * inertial * free)) or 1.0
    power_rows = PowerRegressor(model).rows(sample_box(box)) * scale / usual_power
    time_scale = motion_time_scale(time, velocity[:, free], segments)
    std = initial_state_std, noise_std
    return ShootingObjective(problem, entries, velocity, *std, scale, power_rows, time_scale)


@factorisation("normal matrix of the weak form")
def initial_candidates(objective: ShootingObjective, model: DampingModel) -> list[FloatArray]:
    """Return weak-form ridge estimates with the energy penalty, one for each prior strength."""
    triangle = WeakRegression().rows(objective.problem).triangle()
    blocks, targets = [], []
    for axis, terms in enumerate(model.terms):
        target = triangle.target(axis)
        norm = float(np.linalg.norm(target)) / np.sqrt(triangle.n_samples)
        residual = solve_axis(triangle, terms, axis).residual
        deviation = max(residual, MIN_RELATIVE_RESIDUAL * norm) or 1.0
        blocks.append(triangle.columns(terms) / deviation)
        targets.append(target / deviation)
    design = block_diag(*blocks) * objective.scale / np.sqrt(triangle.n_samples)
    target = np.concatenate(targets) / np.sqrt(triangle.n_samples)
    hessian, rhs = design.T @ design, design.T @ target
    candidates = []
    for prior_strength in CANDIDATE_PRIOR_STRENGTHS:
        x = np.zeros(len(rhs))
        for _ in range(MAX_ACTIVE_SET_ITERATIONS):
            previous = x
            penalty = objective.penalty_hessian(x, prior_strength, INITIAL_PENALTY_WEIGHT)
            x = np.linalg.solve(hessian + penalty, rhs)
            if np.allclose(x, previous, rtol=1e-6):
                break
        candidates.append(x * objective.scale)
    return candidates


def best_initial_iterate(
    objective: ShootingObjective, candidates: Sequence[FloatArray], length: float
) -> Iterate:
    """Return the candidate of the lowest cost on windows of a length [s]."""
    windows = objective.windows(length)

    def cost(coefficients: FloatArray) -> float:
        likelihood = 2.0 * float(np.mean(np.log(objective.residual_std(coefficients, windows))))
        return likelihood + objective.penalty(Iterate(coefficients, ()))

    return objective.add_length(Iterate(min(candidates, key=cost), ()), windows)


@factorisation("normal matrix of the windows")
def minimise(
    objective: ShootingObjective,
    iterate: Iterate,
    tolerance: float,
    max_iterations: int = MAX_ITERATIONS,
) -> Iterate:
    """Minimise J by Levenberg-Marquardt steps with Nielsen's damping update (1999)."""
    damping, converged = iterate.damping, False
    cost = objective.cost(iterate)
    for _ in range(max_iterations):
        x = iterate.coefficients / objective.scale
        hessian, rhs = objective.gauss_newton(iterate)
        penalty = objective.penalty_hessian(x, iterate.prior_strength, iterate.penalty_weight)
        hessian, rhs = hessian + penalty, rhs - penalty @ x
        predicted_decrease = float(rhs @ np.linalg.solve(hessian, rhs))
        if converged := predicted_decrease < tolerance:
            break
        factor = 2.0
        for _ in range(MAX_DAMPING_TRIALS):
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), rhs)
            trial = objective.move(iterate, (x + step) * objective.scale)
            trial_cost = objective.cost(trial)
            if trial_cost < cost:
                break
            damping, factor = factor * damping, 2.0 * factor
        else:
            break
        decrease = cost - trial_cost
        # a heavily damped step decreases J little anywhere: that is no convergence
        undamped = damping <= 1.0 or predicted_decrease < STAGE_TOLERANCE
        converged = decrease < STAGE_TOLERANCE and undamped
        gain_ratio = decrease / float(step @ (2.0 * rhs - hessian @ step))
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * gain_ratio - 1.0) ** 3), MIN_DAMPING)
        iterate, cost = trial, trial_cost
        if decrease < tolerance:
            break
    return replace(iterate, converged=converged, damping=damping)

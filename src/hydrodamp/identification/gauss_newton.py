"""Damped Gauss-Newton minimisation of the multi-step (truncated) simulation error.

Windows of a log are simulated from estimated initial states (multiple shooting). For
coefficients κ, ``s_i²(κ; L)`` is the mean square residual of velocity i over all windows of
length L, plus a noise floor, and ``d(κ; L)`` the mean square correction of the initial states
over their prior variance. With ``x = κ / scale``, f velocities and p coefficients, the objective
is the concentrated Gaussian log-likelihood with a ridge prior and an energy-injection penalty::

    J(κ) = mean_L [ (2/f) Σ_i log s_i(κ; L) + d(κ; L) ]
           + (λ/p) |x|² + w mean_k max(0, φ_k·x)²

Where sensors take the place of velocities, i counts their outputs and 1/f is the share of their
residuals, weighted by degree of freedom; parameters of sensors join κ with priors of their own.

``φ_k·x`` is the power νᵀτ(ν) at velocities ν_k beyond the operating range, over a usual power.
Steps are Levenberg-Marquardt steps with Nielsen's damping update (1999). Simulation-error
minimisation: Farina and Piroddi (2010).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.multiple_shooting import (
    MAX_RELATIVE_STEP,
    Outputs,
    Windows,
    concatenate_bounds,
    sample_indices,
)
from hydrodamp.simulation.problem import Problem

#: Shortest window [sampling steps].
MIN_WINDOW_STEPS = 4

#: Gauss-Newton steps of the last stage by default, and share of a stage before it.
MAX_ITERATIONS, STAGE_SHARE = 40, 0.25

#: Decrease of J [1] below which a stage ends: stages before the last, and the last.
STAGE_TOLERANCE, FINAL_TOLERANCE = 1e-2, 2e-3

#: Smallest Levenberg-Marquardt damping [1], relative to the diagonal of the Hessian.
MIN_DAMPING = 1e-3

#: Increases of the damping before a step is given up.
MAX_DAMPING_TRIALS = 8

#: Prior strength λ [1] before the evidence sets it.
INITIAL_PRIOR_STRENGTH = 0.1

#: Weight w [1] of the energy-injection penalty before the evidence sets it.
INITIAL_PENALTY_WEIGHT = 10.0


class Linearisation(NamedTuple):
    """Residuals of the windows of one length, linearised at their optimal initial states.

    ``residual_std`` belongs to each output, ``normal`` is the normal matrix of the mean
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
    ``power_rows`` holds φ_k; ``time_scale`` [s] is that of the motion. Parameters of sensors
    follow the p coefficients, with their prior standard deviation as scale. ``counts`` are the
    residuals of each output. The last stage of a minimisation has at most ``max_iterations``.
    """

    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    velocity: FloatArray
    initial_state_std: FloatArray
    noise_std: FloatArray
    scale: FloatArray
    power_rows: FloatArray
    time_scale: float
    outputs: Outputs
    counts: FloatArray
    max_iterations: int = MAX_ITERATIONS

    @property
    def n_coefficients(self) -> int:
        """The number p of coefficients, without parameters of sensors."""
        return len(self.entries[0])

    @cached_property
    def weights(self) -> FloatArray:
        """Weights of the residuals of each output, with a mean of one."""
        return self.outputs.weights(self.counts)

    @property
    def residuals_per_sample(self) -> float:
        """Residuals of all outputs over the samples of the log."""
        return float(self.counts.sum()) / self.problem.n_samples

    def restrict(self, bounds: IntArray) -> ShootingObjective:
        """Return the objective of intervals of the log, each a segment of its own."""
        samples, segments = sample_indices(bounds), concatenate_bounds(bounds)
        inputs = self.problem.inputs.select(samples)
        problem = replace(self.problem, inputs=inputs, segments=segments)
        outputs = self.outputs.select(samples)
        return replace(self, problem=problem, velocity=self.velocity[samples], outputs=outputs)

    def windows(self, length: float) -> Windows:
        """Return windows of a length [s] with initial states at the smoothed velocity."""
        bounds, std = split_windows(self.problem, length), self.initial_state_std
        states, max_step = self.velocity[bounds[:, 0]], MAX_RELATIVE_STEP * self.time_scale
        settings = self.problem, self.entries, bounds, states, std, max_step, self.outputs
        return Windows(length, *settings)

    def windows_like(self, windows: Windows) -> Windows:
        """Return windows with the length and the prior standard deviation of others."""
        return replace(self.windows(windows.length), initial_state_std=windows.initial_state_std)

    def widen_initial_states(self, iterate: Iterate, std: FloatArray) -> Iterate:
        """Return the iterate with another prior standard deviation of the initial states."""
        linearisations = tuple(
            each._replace(windows=replace(each.windows, initial_state_std=std))
            for each in iterate.linearisations
        )
        return self.move(replace(iterate, linearisations=linearisations), iterate.coefficients)

    def residual_std(self, coefficients: FloatArray, windows: Windows) -> FloatArray:
        """Return s_i (f,) with the initial states at their prior mean."""
        series = windows.outputs.residuals(windows, coefficients)
        squares = [np.sum(r**2, axis=0) / max(len(r), 1) for _, _, r in series]
        return self._std(np.concatenate(squares))

    def _std(self, mean_square: FloatArray) -> FloatArray:
        return np.asarray(np.sqrt(np.maximum(mean_square, 0.0) + self.noise_std**2))

    def linearise(
        self, coefficients: FloatArray, windows: Windows, residual_std: FloatArray
    ) -> Linearisation:
        """Linearise the residuals of all windows at their optimal initial states."""
        std = residual_std / np.sqrt(self.weights)
        normal, mean_square, correction = windows.linearise(coefficients, std)
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
        return (
            self.log_std(np.array(residual_std))
            + float(np.mean(corrections))
            + self.penalty(iterate)
        )

    def log_std(self, residual_std: FloatArray) -> float:
        """Return twice the mean log residual_std over residuals and window lengths."""
        share = self.weights * self.counts / self.counts.sum()
        return 2.0 * float(np.mean(np.log(residual_std) @ share))

    def penalty(self, iterate: Iterate) -> float:
        """Return the prior and the energy-injection penalty of J(κ)."""
        x, p = iterate.coefficients / self.scale, self.n_coefficients
        injection = float(np.mean(np.maximum(self.power_rows @ x[:p], 0.0) ** 2))
        prior = iterate.prior_strength * float(np.mean(x[:p] ** 2))
        prior += self.nuisance_weight * float(np.sum(x[p:] ** 2))
        return prior + iterate.penalty_weight * injection

    @property
    def nuisance_weight(self) -> float:
        """Weight of the squared parameters of sensors over their prior variance."""
        return self.outputs.samples_per_residual / float(self.counts.sum())

    def gauss_newton(self, iterate: Iterate) -> tuple[FloatArray, FloatArray]:
        """Return matrix and right-hand side of the likelihood's normal equations in x."""
        normal = np.mean([each.normal for each in iterate.linearisations], axis=0)
        hessian = normal[:-1, :-1] * self.scale[:, None] * self.scale
        return hessian, normal[:-1, -1] * self.scale

    def normal_equations(self, iterate: Iterate) -> tuple[FloatArray, FloatArray]:
        """Return matrix and right-hand side of the Gauss-Newton step of J(κ) in x."""
        x, (hessian, rhs) = iterate.coefficients / self.scale, self.gauss_newton(iterate)
        penalty = self.penalty_hessian(x, iterate.prior_strength, iterate.penalty_weight)
        return hessian + penalty, rhs - penalty @ x

    def penalty_hessian(
        self, x: FloatArray, prior_strength: float, penalty_weight: float
    ) -> FloatArray:
        """Return half the Hessian of the prior and the energy-injection penalty."""
        p = self.n_coefficients
        active = self.power_rows[self.power_rows @ x[:p] > 0.0]
        hessian = np.diag(np.full(len(x), self.nuisance_weight))
        hessian[:p, :p] = penalty_weight / len(self.power_rows) * (active.T @ active)
        hessian[:p, :p] += prior_strength / p * np.eye(p)
        return hessian


def split_windows(problem: Problem, length: float) -> IntArray:
    """Return the bounds of windows of a length [s] that cover every segment with least overlap."""
    windows, length = [], max(length, MIN_WINDOW_STEPS * median_step(problem))
    for start, stop in problem.segments.tolist():
        time = problem.inputs.time[start:stop]
        room = time[-1] - time[0] - length
        if not room > 0.0:
            windows.append((start, stop))
            continue
        begin = time[0] + np.linspace(0.0, room, int(np.ceil(room / length - 1e-6)) + 1)
        rounding = 1e-6 * length  # of the clock
        first = start + np.searchsorted(time, begin - rounding)
        last = start + np.searchsorted(time, begin + length + rounding, side="right")
        windows += zip(first, last, strict=True)
    bounds = np.array(windows, dtype=np.int64).reshape(-1, 2)
    return bounds[bounds[:, 0] < bounds[:, 1]]  # a window without samples lies in a gap


@factorisation("normal matrix of the windows")
def minimise(
    objective: ShootingObjective,
    iterate: Iterate,
    tolerance: float,
    share: float = 1.0,
) -> Iterate:
    """Minimise J by Levenberg-Marquardt steps with Nielsen's damping update (1999)."""
    damping, converged = iterate.damping, False
    cost = objective.cost(iterate)
    for _ in range(math.ceil(share * objective.max_iterations)):
        x = iterate.coefficients / objective.scale
        hessian, rhs = objective.normal_equations(iterate)
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


def newton_step(objective: ShootingObjective, result: Iterate) -> FloatArray:
    """Return the undamped step from an iterate: what a narrow valley has left."""
    step = np.linalg.solve(*objective.normal_equations(result))
    return np.asarray(step * objective.scale)


@factorisation("normal matrix of the windows")
def prior_share(objective: ShootingObjective, result: Iterate) -> FloatArray:
    """Return the posterior over the prior variance: one where the data say nothing."""
    hessian, _ = objective.normal_equations(result)
    return np.asarray(objective.nuisance_weight * np.diag(np.linalg.inv(hessian)))

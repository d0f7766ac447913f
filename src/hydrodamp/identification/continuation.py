"""Continuation over window lengths, with prior strength and penalty weight from the evidence.

Windows of the first length give the first stage; each later stage adds the next length to the
objective J(κ) of :mod:`hydrodamp.identification.gauss_newton`. Lengths are multiples of the time
scale of the motion. With N independent residuals, of which γ determine the coefficients x, and a
mean square scaled coefficient σ_x², the strengths of a stage are (MacKay 1992)::

    λ = p / ((N − γ) σ_x²),    w = 1 / ((N − γ) σ_P²)

times the misfit, the share of the residuals that is not noise floor. σ_P = ``POWER_STD`` is the
prior standard deviation of the injected power. In the last stage, the prior variance of the initial
states grows by ``(N − γ) / (n p)``, n = ``RESIDUALS_PER_COEFFICIENT``: the prior mean is a smoothed
measurement, whose bias would stay in the estimate. So all three priors vanish as N grows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    STAGE_TOLERANCE,
    Iterate,
    ShootingObjective,
    minimise,
)
from hydrodamp.identification.har_covariance import Bins
from hydrodamp.identification.initial_iterate import best_initial_iterate, initial_candidates
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Window lengths by default over the time scale of the motion; entire segments follow.
RELATIVE_LENGTHS = (0.75, 1.5, 3.0, 6.0)

#: Bounds of the prior strength λ [1].
PRIOR_STRENGTH_BOUNDS = 1e-6, 10.0

#: Sampling intervals of the slowest sensor in the shortest window.
MIN_INTERVALS = 4.0

#: Prior standard deviation [1] of the injected power over the usual power.
POWER_STD = 0.01

#: Independent residuals per coefficient from which the prior of the initial states fades.
RESIDUALS_PER_COEFFICIENT = 10.0

#: Decrease of J below which the last stage ends, over p / N: a tenth of the expected decrease of
#: −2 log-likelihood from the true to the estimated coefficients is 0.1 p / N.
RELATIVE_TOLERANCE = 0.2

#: Windows from which the correlation time of residuals is estimated, and bins of their time.
MAX_EVIDENCE_WINDOWS, MAX_TIME_BINS = 32, 2048

#: Residuals from which a correlation time is estimated.
MIN_SERIES = 8


def fit_windows(
    objective: ShootingObjective,
    model: DampingModel,
    lengths: Sequence[float] = (),
    initial: Sequence[FloatArray] = (),
) -> tuple[Iterate, Iterate]:
    """Return the best of initial coefficients and weak-form estimates, and the minimum of J.

    Lengths [s] are multiples of the time scale of the motion by default.
    """
    shortest = MIN_INTERVALS * objective.outputs.interval
    multiples = (max(each * objective.time_scale, shortest) for each in RELATIVE_LENGTHS)
    default = (*dict.fromkeys(multiples), np.inf)
    lengths = admissible_lengths(objective.problem, lengths or default)
    candidates = [*initial, *initial_candidates(objective, model)]
    start = best_initial_iterate(objective, candidates, lengths[0])
    return start, continue_over_lengths(objective, start, lengths)


def continue_over_lengths(
    objective: ShootingObjective, iterate: Iterate, lengths: Sequence[float]
) -> Iterate:
    """Minimise over windows of the first length, then with one length more in each stage."""
    for length in lengths[1:]:
        iterate = minimise(objective, update_prior(objective, iterate), STAGE_TOLERANCE)
        iterate = objective.add_length(iterate, objective.windows(length))
        # the damping of a stage that failed must not block the next one
        iterate = replace(iterate, damping=min(iterate.damping, 1.0))
    iterate, p = update_prior(objective, iterate), objective.n_coefficients
    widening = max(iterate.n_free / (RESIDUALS_PER_COEFFICIENT * p), 1.0)
    iterate = objective.widen_initial_states(iterate, np.sqrt(widening))
    tolerance = min(FINAL_TOLERANCE, RELATIVE_TOLERANCE * p / iterate.n_free)
    return minimise(objective, iterate, tolerance)


def admissible_lengths(problem: Problem, lengths: Sequence[float]) -> list[float]:
    """Return the lengths [s] shorter than the longest segment, then infinity if any is longer."""
    shorter = [length for length in lengths if length < problem.durations.max()]
    return shorter if len(shorter) == len(lengths) else [*shorter, np.inf]


@factorisation("normal matrix of the windows")
def update_prior(objective: ShootingObjective, iterate: Iterate) -> Iterate:
    """Set λ, the prior variance σ_x² = |x|²/γ and w by the evidence.

    With eigenvalues μ_j of the Hessian, γ = Σ μ_j / (μ_j + λ/p). N is the number of samples over
    the correlation time of the residuals, summed over the velocities.
    """
    windows, residual_std, *_ = iterate.linearisations[-1]
    subset = windows.select(slice(None, None, -(-len(windows.bounds) // MAX_EVIDENCE_WINDOWS)))
    series = (
        (each.window, each.time, column)
        for each in subset.outputs.residuals(subset, iterate.coefficients)
        for column in each.residuals.T
    )
    steps = median_step(objective.problem) * objective.problem.n_samples / objective.counts
    pairs = zip(series, steps.tolist(), strict=True)
    correlation = [correlation_length(*each, step) for each, step in pairs]
    n_independent = float(np.sum(objective.counts / np.array(correlation)))
    share = objective.weights * objective.counts / objective.counts.sum()
    misfit = float(share @ (1.0 - (objective.noise_std / residual_std) ** 2))
    eigenvalues = np.maximum(np.linalg.eigvalsh(_coefficient_hessian(objective, iterate)), 0.0)
    p = objective.n_coefficients
    square = float(np.sum((iterate.coefficients / objective.scale)[:p] ** 2))
    p, strength, variance = len(eigenvalues), iterate.prior_strength, iterate.prior_variance
    n_free = n_independent
    for _ in range(5):
        n_determined = float(np.sum(eigenvalues / (eigenvalues + strength / p)))
        if not (n_determined > 0.0 and square > 0.0):
            break
        variance = square / n_determined
        n_free = max(n_independent - n_determined, 0.1 * n_independent)
        strength = p * misfit / n_free / variance
        strength = float(np.clip(strength, *PRIOR_STRENGTH_BOUNDS))
    weight = misfit / n_free / POWER_STD**2
    return replace(
        iterate,
        prior_strength=strength,
        prior_variance=variance,
        penalty_weight=weight,
        n_free=n_free,
    )


def correlation_length(
    window: IntArray, time: FloatArray, residuals: FloatArray, step: float
) -> float:
    """Return the correlation time of residuals over their sampling step, at least 1."""
    if len(time) < MIN_SERIES:
        return 1.0
    bins = Bins.of(window, time, MAX_TIME_BINS)
    return max(bins.correlation_time(bins.sums(residuals[:, None])) / step, 1.0)


def _coefficient_hessian(objective: ShootingObjective, iterate: Iterate) -> FloatArray:
    """Return the Hessian of the likelihood in the coefficients, parameters of sensors optimal."""
    hessian, p = objective.gauss_newton(iterate)[0], objective.n_coefficients
    if len(hessian) == p:
        return hessian
    nuisance = hessian[p:, p:] + objective.nuisance_weight * np.eye(len(hessian) - p)
    cross = hessian[:p, p:]
    return np.asarray(hessian[:p, :p] - cross @ np.linalg.solve(nuisance, cross.T))

"""Minimisation over growing windows, from the best weak-form ridge estimate.

Candidates are weak-form estimates with several prior strengths λ and the energy-injection penalty;
where velocities are rebuilt from sensors also published, hull and zero damping. The candidate of
the lowest objective on windows of the first length is the initial iterate. These windows give the
first stage; each later stage adds the next length to the objective J(κ) of
:mod:`hydrodamp.identification.gauss_newton`. Lengths are multiples of the time scale of the motion.
With N independent residuals, of which γ determine the coefficients x, and a mean square scaled
coefficient σ_x², the strengths of a stage are (MacKay 1992)::

    λ = p / ((N − γ) σ_x²),    w = 1 / ((N − γ) σ_P²)

times the misfit, the share of the residuals that is not noise floor. σ_P = ``POWER_STD`` is the
prior standard deviation of the injected power. The prior mean of an initial state is a smoothed
measurement, whose error would stay in the estimate: in the last stage, the prior variance of the
initial states grows by ``(N − γ) / (n p)``, n = ``RESIDUALS_PER_COEFFICIENT``, and where the form
explains the motion, its root is at least twice the residual of the shortest windows, coloured
errors included. The form explains the motion where the growth of the errors,
``g = max_i s_i(longest) / s_i(shortest)`` without the noise floor, is small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray, factorisation
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.conditioning.derivatives import differences_from_centre, fit_local_polynomials
from hydrodamp.conditioning.sensor_log import SensorLog
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.identification.differentiation import (
    median_step,
    noise_variance,
    regressor_mean_square,
    smooth_velocity,
)
from hydrodamp.identification.dissipativity import PowerRegressor, sample_box, velocity_box
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    INITIAL_PENALTY_WEIGHT,
    STAGE_SHARE,
    STAGE_TOLERANCE,
    Iterate,
    ShootingObjective,
    minimise,
)
from hydrodamp.identification.har_covariance import Bins
from hydrodamp.identification.multiple_shooting import (
    SAMPLES_PER_RESIDUAL,
    VelocityOutputs,
    Windows,
)
from hydrodamp.identification.regression import solve_axis
from hydrodamp.identification.sensor_outputs import SensorOutputs
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.damping_estimate import hull_damping, published_damping
from hydrodamp.simulation.problem import Problem

#: Smallest standard deviation of a velocity, relative to its largest: rounding is below it.
MIN_RELATIVE_STD = 1e-9

#: Share [1] of the estimated noise in the noise floor: fast motion inflates the estimate.
NOISE_FLOOR_SHARE = 0.5

#: Widening [1] of the operating range: the penalty covers velocities up to three times as large.
PENALTY_BOX_MARGIN = 2.0

#: Prior strengths [1] of the weak-form regressions that give initial candidates.
CANDIDATE_PRIOR_STRENGTHS = (1e-6, 1e-4, 1e-2, 1.0)

#: Active-set iterations of the penalty in those regressions.
MAX_ACTIVE_SET_ITERATIONS = 20

#: Smallest residual of those regressions, relative to the target: a smaller one is an overfit.
MIN_RELATIVE_RESIDUAL = 1e-3

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

#: Prior standard deviation of initial states over that of the residuals, in the last stage, and
#: growth of the errors [1] above which it would absorb the error of the form. Over 236 rows of the
#: benchmark it changes the error of replays by a factor of 0.81 below a growth of 1.5, of 1.00 up
#: to 2.5, and of 1.03 above.
INITIAL_STATE_FACTOR, MAX_GROWTH = 2.0, 2.5

# Of the growth by the last minimisation: at most 3.9 in 29 fits of seven campaigns.
MAX_DECREASE = 4.0

#: Decrease of J below which the last stage ends, over p / N: a fifth of the expected decrease of −2
#: log-likelihood from the true to the estimated coefficients.
RELATIVE_TOLERANCE = 0.2

#: Windows from which the correlation time of residuals is estimated, and bins of their time.
MAX_EVIDENCE_WINDOWS, MAX_TIME_BINS = 32, 2048

#: Residuals from which a correlation time is estimated.
MIN_SERIES = 8


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
    square = np.mean((acceleration @ problem.vehicle.mass_matrix.T) ** 2, axis=0)
    if problem.sensor_log is not None:  # smoothing attenuates accelerations
        square += problem.vehicle.mass_matrix**2 @ problem.sensor_log.acceleration_std**2
    inertial = np.sqrt(square)
    force = inertial[axes]
    size = np.sqrt(regressor_mean_square(problem))[rows - problem.equations.n_known]
    scale = np.where((size > 0.0) & (force > 0.0), force / np.where(size > 0.0, size, 1.0), 1.0)
    box = velocity_box(velocity, 0.0).widen(PENALTY_BOX_MARGIN).restrict(free)
    usual_power = float(np.linalg.norm(box.max_abs * inertial * free)) or 1.0
    power_rows = PowerRegressor(model).rows(sample_box(box)) * scale / usual_power
    time_scale = motion_time_scale(time, velocity[:, free], segments)
    counts = np.full(len(noise_std), float(problem.n_samples))
    std, outputs = (initial_state_std, noise_std), VelocityOutputs()
    objective = ShootingObjective(
        problem, entries, velocity, *std, scale, power_rows, time_scale, outputs, counts
    )
    return (
        objective if problem.sensor_log is None else _compare_sensors(objective, problem.sensor_log)
    )


def _compare_sensors(objective: ShootingObjective, sensor_log: SensorLog) -> ShootingObjective:
    """Return the objective with the outputs of sensors in place of the velocities."""
    vehicle = objective.problem.vehicle
    sensors = SensorOutputs.of(sensor_log, [VELOCITY_OF[axis] for axis in vehicle.axes])
    prior_std = sensor_log.velocity_std[vehicle.free] / np.sqrt(SAMPLES_PER_RESIDUAL)
    if sensors.parameters:  # a bias or a delay is in the velocities that the sensors give
        spread = np.std(objective.velocity[:, vehicle.free], axis=0)
        prior_std = np.where(prior_std > 0.0, np.maximum(prior_std, spread), 0.0)
    prior_std = np.where(prior_std > 0.0, prior_std, objective.initial_state_std)
    recorded = objective.noise_std / NOISE_FLOOR_SHARE
    return replace(
        objective,
        initial_state_std=np.concatenate([prior_std, sensors.offset_std]),
        noise_std=NOISE_FLOOR_SHARE * sensors.noise_std(recorded, vehicle.free),
        scale=np.concatenate([objective.scale, [each.std for each in sensors.parameters]]),
        outputs=sensors,
        counts=sensors.counts,
    )


@factorisation("normal matrix of the weak form")
def initial_candidates(objective: ShootingObjective, model: DampingModel) -> list[FloatArray]:
    """Return weak-form ridge estimates; of sensors, also damping that needs no log."""
    triangle = WeakRegression().rows(objective.problem).triangle()
    blocks, targets = [], []
    for axis, terms in enumerate(model.terms):
        target = triangle.target(axis)
        norm = float(np.linalg.norm(target)) / np.sqrt(triangle.n_samples)
        residual = solve_axis(triangle, terms, axis).residual
        deviation = max(residual, MIN_RELATIVE_RESIDUAL * norm) or 1.0
        blocks.append(triangle.columns(terms) / deviation)
        targets.append(target / deviation)
    scale = objective.scale[: objective.n_coefficients]
    design = block_diag(*blocks) * scale / np.sqrt(triangle.n_samples)
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
        candidates.append(x * scale)
    if objective.problem.sensor_log is not None:  # rebuilt velocities may be inaccurate
        vehicle = objective.problem.vehicle
        known = published_damping(vehicle), hull_damping(vehicle)
        candidates += [each.onto(model) for each in known if each is not None]
        candidates.append(np.zeros(len(scale)))
    return candidates


def best_initial_iterate(
    objective: ShootingObjective, candidates: Sequence[FloatArray], length: float
) -> Iterate:
    """Return the candidate of the lowest cost on windows of a length [s]."""
    windows = objective.windows(length)

    def cost(coefficients: FloatArray) -> float:
        likelihood = objective.log_std(objective.residual_std(coefficients, windows))
        return likelihood + objective.penalty(Iterate(coefficients, ()))

    n_nuisance = len(objective.scale) - objective.n_coefficients
    extended = [np.concatenate([each, np.zeros(n_nuisance)]) for each in candidates]
    return objective.add_length(Iterate(min(extended, key=cost), ()), windows)


def fit_windows(
    objective: ShootingObjective,
    model: DampingModel,
    lengths: Sequence[float] = (),
    initial: Sequence[FloatArray] = (),
) -> tuple[Iterate, Iterate]:
    """Return the best of initial coefficients and weak-form estimates, and the minimum of J.

    Lengths [s] are multiples of the time scale of the motion by default.
    """
    default = window_lengths(objective.problem, objective.time_scale, objective.outputs.interval)
    lengths = admissible_lengths(objective.problem, lengths or (*default, np.inf))
    candidates = [*initial, *initial_candidates(objective, model)]
    start = best_initial_iterate(objective, candidates, lengths[0])
    return start, continue_over_lengths(objective, start, lengths)


def continue_over_lengths(
    objective: ShootingObjective, iterate: Iterate, lengths: Sequence[float] = ()
) -> Iterate:
    """Minimise over windows of the first length, then with one length more in each stage."""
    for length in lengths[1:]:
        iterate = minimise(
            objective, update_prior(objective, iterate), STAGE_TOLERANCE, STAGE_SHARE
        )
        iterate = objective.add_length(iterate, objective.windows(length))
        # the damping of a stage that failed must not block the next one
        iterate = replace(iterate, damping=min(iterate.damping, 1.0))
    iterate = update_prior(objective, iterate)
    n_residuals = RESIDUALS_PER_COEFFICIENT * objective.n_coefficients
    std = np.sqrt(max(iterate.n_free / n_residuals, 1.0)) * objective.initial_state_std
    if objective.problem.sensor_log is None:
        residual_std = iterate.linearisations[0].residual_std
        free_std = np.maximum(std, INITIAL_STATE_FACTOR * residual_std)
        widened = objective.widen_initial_states(iterate, free_std)
        if error_growth(objective, widened) < MAX_DECREASE * MAX_GROWTH:
            result = minimise_finally(objective, widened)
            if error_growth(objective, result) < MAX_GROWTH:
                return result
    return minimise_finally(objective, objective.widen_initial_states(iterate, std))


def error_growth(objective: ShootingObjective, iterate: Iterate) -> float:
    """Return the largest growth of the errors from the shortest to the longest windows."""
    ends = iterate.linearisations[0], iterate.linearisations[-1]
    floor = objective.noise_std**2
    shortest, longest = (np.maximum(each.residual_std**2 - floor, floor) for each in ends)
    return float(np.sqrt(np.max(longest / shortest)))


def minimise_finally(
    objective: ShootingObjective, iterate: Iterate, relative_tolerance: float = RELATIVE_TOLERANCE
) -> Iterate:
    """Minimise to a small part of the expected error of the coefficients."""
    tolerance = relative_tolerance * objective.n_coefficients / iterate.n_free
    return minimise(objective, iterate, min(FINAL_TOLERANCE, tolerance))


def admissible_lengths(problem: Problem, lengths: Sequence[float]) -> list[float]:
    """Return the lengths [s] shorter than the longest segment, then infinity if any is longer."""
    shorter = [length for length in lengths if length < problem.durations.max()]
    return shorter if len(shorter) == len(lengths) else [*shorter, np.inf]


def window_lengths(problem: Problem, time_scale: float, interval: float = 0.0) -> list[float]:
    """Return the default window lengths [s], none below some sampling intervals."""
    lengths = (max(each * time_scale, MIN_INTERVALS * interval) for each in RELATIVE_LENGTHS)
    return admissible_lengths(problem, [*dict.fromkeys(lengths)])


@factorisation("normal matrix of the windows")
def update_prior(objective: ShootingObjective, iterate: Iterate) -> Iterate:
    """Set λ, the prior variance σ_x² = |x|²/γ and w by the evidence.

    With eigenvalues μ_j of the Hessian, γ = Σ μ_j / (μ_j + λ/p). N is the number of samples over
    the correlation time of the residuals, summed over the velocities.
    """
    windows, residual_std, *_ = iterate.linearisations[-1]
    subset = windows.select(slice(None, None, -(-len(windows.bounds) // MAX_EVIDENCE_WINDOWS)))
    lengths = correlation_lengths(objective, subset, iterate.coefficients)
    n_independent = float(np.sum(objective.counts / lengths))
    share = objective.weights * objective.counts / objective.counts.sum()
    misfit = float(share @ (1.0 - (objective.noise_std / residual_std) ** 2))
    eigenvalues = np.maximum(np.linalg.eigvalsh(_coefficient_hessian(objective, iterate)), 0.0)
    p, strength, variance = len(eigenvalues), iterate.prior_strength, iterate.prior_variance
    square = float(np.sum((iterate.coefficients / objective.scale)[:p] ** 2))
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


def correlation_lengths(
    objective: ShootingObjective, windows: Windows, parameters: FloatArray
) -> FloatArray:
    """Return the correlation time of each output's residuals over its sampling step, at least 1."""
    times: list[float] = []
    for window, time, residuals in windows.outputs.residuals(windows, parameters):
        if len(time) < MIN_SERIES:
            times += [0.0] * residuals.shape[1]
            continue
        bins = Bins.of(window, time, MAX_TIME_BINS)
        times += [bins.correlation_time(sums) for sums in bins.sums(residuals).T[:, :, None]]
    steps = median_step(objective.problem) * objective.problem.n_samples / objective.counts
    return np.maximum(np.array(times) / steps, 1.0)


def _coefficient_hessian(objective: ShootingObjective, iterate: Iterate) -> FloatArray:
    """Return the Hessian of the likelihood in the coefficients, parameters of sensors optimal."""
    hessian, p = objective.gauss_newton(iterate)[0], objective.n_coefficients
    if len(hessian) == p:
        return hessian
    nuisance = hessian[p:, p:] + objective.nuisance_weight * np.eye(len(hessian) - p)
    cross = hessian[:p, p:]
    return np.asarray(hessian[:p, :p] - cross @ np.linalg.solve(nuisance, cross.T))

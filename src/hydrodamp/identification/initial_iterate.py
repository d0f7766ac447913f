"""The objective of a problem, and the initial iterate: weak-form ridge estimates.

Candidates are weak-form estimates with several prior strengths λ and the energy-injection penalty;
where velocities are rebuilt from sensors also published, hull and zero damping. The one of the
lowest objective on windows of the first length is the initial iterate.
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
    noise_variance,
    regressor_mean_square,
    smooth_velocity,
)
from hydrodamp.identification.dissipativity import PowerRegressor, sample_box, velocity_box
from hydrodamp.identification.gauss_newton import (
    INITIAL_PENALTY_WEIGHT,
    SAMPLES_PER_RESIDUAL,
    Iterate,
    ShootingObjective,
)
from hydrodamp.identification.regression import solve_axis
from hydrodamp.identification.sensor_outputs import SensorOutputs
from hydrodamp.identification.velocity_outputs import VelocityOutputs
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
    box = velocity_box(velocity, PENALTY_BOX_MARGIN, 0.0).restrict(free)
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

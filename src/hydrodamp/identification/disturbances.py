"""Shift of an estimate where each window has an unknown constant wrench.

An autopilot answers what pushes the vehicle, so the motion correlates with the push, and estimates
that take it as zero are biased. In windows of one length, with sensitivities A of the coefficients,
B of the initial state and C of a constant wrench, Gauss-Newton steps minimise

    Σ_windows min_{δ, ω} |ε − A Δκ − B δ − C ω|² + δᵀP⁻¹δ + ωᵀS⁻¹ω,

with the RMS inertial force of each axis as the standard deviation S of ω. The result has a larger
variance but less bias than one without ω, so its difference bounds the bias of that.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray, factorisation
from hydrodamp.basis.term import AXES
from hydrodamp.identification.gauss_newton import (
    NOISE_FLOOR_SHARE,
    Iterate,
    ShootingObjective,
    make_objective,
)
from hydrodamp.identification.multiple_shooting import Windows, eliminate_initial_states
from hydrodamp.models.model import DampingModel

#: Window lengths over the time scale of the motion: a push is about constant in the shorter one.
RELATIVE_LENGTHS = (1.5, 3.0)

#: Gauss-Newton steps from the estimate.
N_STEPS = 2


@factorisation("normal matrix of windows with disturbances")
def disturbance_shifts(
    objective: ShootingObjective, model: DampingModel, iterate: Iterate
) -> list[FloatArray]:
    """Return the shift of an estimate (p,) with unknown wrenches in windows of each length."""
    free = objective.problem.vehicle.free
    constant = {axis: "1" for axis, is_free in zip(AXES, free, strict=True) if is_free}
    extended = model.with_terms(constant)
    problem = replace(objective.problem, models=(extended,)).with_log(objective.problem.log)
    augmented = make_objective(problem, extended)
    model_index = np.array([extended.labels.index(label) for label in model.labels])
    start = iterate.coefficients / augmented.scale[model_index]
    prior = iterate.prior_strength / len(model_index)
    shifts = []
    for length in RELATIVE_LENGTHS:
        x, windows = start, augmented.windows(length * augmented.time_scale)
        for _ in range(N_STEPS):
            normal = _normal_matrix(augmented, windows, model_index, x)
            hessian = normal[:-1, :-1] + prior * np.eye(len(x))
            x = x + np.linalg.solve(hessian, normal[:-1, -1] - prior * x)
        shifts.append((x - start) * augmented.scale[model_index])
    return shifts


def _normal_matrix(
    augmented: ShootingObjective, windows: Windows, model_index: np.ndarray, x: FloatArray
) -> FloatArray:
    """Return the mean normal matrix (p + 1, p + 1), initial states and wrenches eliminated."""
    n_terms, scale = len(augmented.scale), augmented.scale[model_index]
    wrench = np.setdiff1d(np.arange(n_terms), model_index)
    coefficients = np.zeros(n_terms)
    coefficients[model_index] = x * scale
    nuisance = np.concatenate([n_terms + windows.free, wrench])
    prior_std = np.concatenate([windows.initial_state_std, augmented.scale[wrench]])
    noise_std = augmented.noise_std / NOISE_FLOOR_SHARE
    total = np.zeros((len(model_index) + 1, len(model_index) + 1))
    for chunk in windows.chunks:
        jacobian, residuals, edges, _ = chunk.linearise_chunk(coefficients, noise_std)
        columns = np.column_stack(
            [jacobian[:, nuisance], jacobian[:, model_index] * scale, residuals]
        )
        normals = np.array([columns[a:b].T @ columns[a:b] for a, b in pairwise(edges)])
        total += eliminate_initial_states(normals, prior_std).sum(axis=0)
    return total / len(windows.samples) / len(windows.free)

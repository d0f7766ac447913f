"""Fisher information of the windows of a log, and the standard errors that sensors allow.

With the Jacobians A of the residuals on the parameters and B on the initial state of window w, both
over the standard deviation of the residuals, and the prior covariance P of the initial state,

    I = Σ_w AᵀA − AᵀB (BᵀB + P⁻¹)⁻¹ BᵀA

bounds the covariance of unbiased estimates from below by I⁻¹ (Cramér-Rao). Windows, steps of the
integration and averages are those of output error.

Forces X Y Z act on positions, linear velocities and specific forces; moments K M N on attitude and
rates. With the bound P of the covariance by all sensors and P' by those of the same motion, a
coefficient κ with the 95 % half-width h is indirect where ``h < |κ| ≤ h √(P'ᵢᵢ/Pᵢᵢ)``: without the
coupling in the mass matrix (Munk moment), not even its sign would be known.

The residuals that predict standard errors are those of a start: noise and model error, times the
root of their correlation length. With exact rotation equations a gyro alone would measure u v w by
Munk moments; the residuals of the rates include what these equations lack.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, factorisation
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.velocity_smoother import interpolate_rows
from hydrodamp.data.log import Log
from hydrodamp.data.measurement import Measurement
from hydrodamp.identification.continuation import (
    NOISE_FLOOR_SHARE,
    best_initial_iterate,
    correlation_lengths,
    initial_candidates,
    make_objective,
    window_lengths,
)
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective
from hydrodamp.identification.multiple_shooting import Windows
from hydrodamp.identification.output_equations import Output
from hydrodamp.identification.sensor_outputs import RECORDED, SensorOutputs
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Weak prior of a coefficient over its scale.
PRIOR_FACTOR = 1e3

#: A usual DVL: rate [Hz] and standard deviation of u v w [m/s].
DVL_RATE, DVL_STD = 5.0, 0.013


def fisher_information(
    windows: Windows, theta: FloatArray, residual_std: FloatArray, block_of_window: IntArray
) -> FloatArray:
    """Return the information (n_blocks, q, q) in successive blocks of windows."""
    normals = windows.block_normal_matrices(theta, residual_std, block_of_window)
    return normals[:, :-1, :-1]


@factorisation("Fisher information of the sensors")
def fisher_standard_errors(
    objective: ShootingObjective, windows: Windows, theta: FloatArray, residuals: FloatArray
) -> FloatArray:
    """Return the bound (p,) with independent residuals of a standard deviation and a weak prior."""
    p = objective.n_coefficients
    one_block = np.zeros(len(windows.bounds), dtype=np.intp)
    (information,) = fisher_information(windows, theta, residuals, one_block)
    prior = np.full(len(theta), PRIOR_FACTOR**-2.0)
    prior[p:] = 1.0
    scaled = information * objective.scale[:, None] * objective.scale
    covariance = np.linalg.inv(scaled + np.diag(prior))
    return np.asarray(np.sqrt(np.diag(covariance))[:p] * objective.scale[:p])


def _standard_errors_with(
    sensors: tuple[Output, ...],
    objective: ShootingObjective,
    windows: Windows,
    theta: FloatArray,
    known: Mapping[str, float],
) -> FloatArray:
    """Return the bound (p,) with some sensors, with known residuals by label, else their noise."""
    outputs = windows.outputs
    assert isinstance(outputs, SensorOutputs)
    outputs = replace(outputs, outputs=sensors)
    noise = np.concatenate([each.std for each in sensors]).tolist()
    pairs = zip(outputs.labels, noise, strict=True)
    residuals = np.array([known.get(label, std) for label, std in pairs])
    return fisher_standard_errors(objective, replace(windows, outputs=outputs), theta, residuals)


def find_indirect_coefficients(
    objective: ShootingObjective, result: Iterate, half_width: FloatArray
) -> BoolArray:
    """Return whether only sensors of other motions determine each coefficient, (p,)."""
    p, outputs = objective.n_coefficients, objective.outputs
    indirect = np.zeros(p, dtype=bool)
    if not isinstance(outputs, SensorOutputs):
        return indirect
    windows, residual_std, *_ = result.linearisations[-1]
    std = dict(zip(outputs.labels, residual_std.tolist(), strict=True))
    value = np.abs(result.coefficients[:p])
    linear = objective.entries[1] < 3
    complete = fisher_standard_errors(objective, windows, result.coefficients, residual_std)
    for of_group, is_linear in ((linear, True), (~linear, False)):
        direct = tuple(each for each in outputs.outputs if (each.freedom[0] < 3) == is_linear)
        if not direct or not of_group.any():
            indirect |= of_group & (half_width < value)
            continue
        error = _standard_errors_with(direct, objective, windows, result.coefficients, std)
        indirect |= of_group & (half_width < value) & (value <= half_width * error / complete)
    return indirect


def predict_standard_errors(
    problem: Problem, model: DampingModel, coefficients: FloatArray | None = None
) -> dict[str, FloatArray]:
    """Return the bound of each coefficient with all sensors, without each, and with a DVL.

    The coefficients at which the model is linearised are those of the weak form by default.
    """
    model = model.restricted_to(problem.vehicle.axes)
    problem = replace(problem, equations=problem.equations.restrict_to(model))
    objective, sensors = make_objective(problem, model), problem.sensor_log
    lengths = window_lengths(problem, objective.time_scale, objective.outputs.interval)
    if coefficients is None:
        candidates = initial_candidates(objective, model)
        start = best_initial_iterate(objective, candidates, lengths[0])
        coefficients = start.coefficients[: objective.n_coefficients]
    spread = np.std(objective.velocity[:, problem.vehicle.free], axis=0)
    free = objective.initial_state_std.copy()
    free[: len(spread)] = np.maximum(free[: len(spread)], spread)
    objective = replace(objective, initial_state_std=free)
    windows = objective.windows(lengths[-1])
    outputs, theta = objective.outputs, np.zeros(len(objective.scale))
    theta[: len(coefficients)] = coefficients
    if sensors is None or not isinstance(outputs, SensorOutputs):
        residuals = effective_residuals(objective, windows, theta)
        return {"all sensors": fisher_standard_errors(objective, windows, theta, residuals)}
    labels = outputs.labels
    known = dict(zip(labels, effective_residuals(objective, windows, theta).tolist(), strict=True))
    names = dict.fromkeys(each.name for each in outputs.outputs if each.name != RECORDED)
    configurations = {"all sensors": outputs.outputs}
    for name in names if len(outputs.outputs) > 1 else ():
        remaining = tuple(each for each in outputs.outputs if each.name != name)
        configurations[f"without {name}"] = remaining
    shares = [  # model error over the motion, as in the recorded rates
        known[f"{RECORDED} {name}"] / float(np.std(sensors.log.velocity[:, axis]) or 1.0)
        for axis, name in enumerate(VELOCITIES)
        if f"{RECORDED} {name}" in known
    ]
    motion = np.std(sensors.log.velocity[:, :3], axis=0)
    dvl = _dvl(sensors.log, np.hypot(DVL_STD, motion * (np.mean(shares) if shares else 0.0)))
    configurations[f"with a {DVL_RATE:g} Hz DVL"] = (*outputs.outputs, dvl)
    return {
        title: _standard_errors_with(chosen, objective, windows, theta, known)
        for title, chosen in configurations.items()
    }


def effective_residuals(
    objective: ShootingObjective, windows: Windows, theta: FloatArray
) -> FloatArray:
    """Return the standard deviation of each output times the root of its correlation length."""
    lengths = correlation_lengths(objective, windows, theta)
    noise = objective.noise_std / NOISE_FLOOR_SHARE
    return np.maximum(objective.residual_std(theta, windows), noise) * np.sqrt(lengths)


def _dvl(log: Log, std: FloatArray) -> Output:
    """Return a DVL that measures u v w with a standard deviation (3,)."""
    moments = [
        np.arange(log.time[start], log.time[stop - 1], 1.0 / DVL_RATE)
        for start, stop in log.bounds.tolist()
    ]
    time, n = np.concatenate(moments), [len(each) for each in moments]
    segment = np.repeat(np.arange(len(moments)), n)
    measurement = Measurement("DVL", "velocity", time, np.zeros((len(time), 3)), segment=segment)
    rows, valid = interpolate_rows(log, measurement), np.ones((len(time), 3), dtype=bool)
    return Output(
        "DVL", "velocity", np.eye(3), rows, measurement.values, valid, std, np.zeros(3), {}
    )

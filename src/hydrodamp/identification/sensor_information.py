"""Standard errors that sensors allow, from the Fisher information of windows.

The information is that of all outputs on the coefficients and parameters of sensors, with a weak
prior. The residuals are those of a start: noise and model error, times the root of their
correlation length. With exact rotation equations a gyro alone would measure u v w by Munk moments;
the residuals of the rates include what these equations lack.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.velocity_smoother import interpolate_rows
from hydrodamp.data.log import Log
from hydrodamp.data.measurement import Measurement
from hydrodamp.identification.continuation import correlation_length
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.gauss_newton import ShootingObjective
from hydrodamp.identification.information import fisher_standard_errors, window_lengths
from hydrodamp.identification.initial_iterate import (
    NOISE_FLOOR_SHARE,
    best_initial_iterate,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.multiple_shooting import Windows
from hydrodamp.identification.output_equations import Output
from hydrodamp.identification.sensor_outputs import RECORDED, SensorOutputs
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: A usual DVL: rate [Hz] and standard deviation of u v w [m/s].
DVL_RATE, DVL_STD = 5.0, 0.013


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
    bounds = {}
    for title, chosen in configurations.items():
        changed = replace(outputs, outputs=chosen)
        stds = np.concatenate([each.std for each in chosen]).tolist()
        pairs = zip(changed.labels, stds, strict=True)
        residuals = np.array([known.get(label, std) for label, std in pairs])
        trial = replace(windows, outputs=changed)
        bounds[title] = fisher_standard_errors(objective, trial, theta, residuals)
    return bounds


def effective_residuals(
    objective: ShootingObjective, windows: Windows, theta: FloatArray
) -> FloatArray:
    """Return the standard deviation of each output times the root of its correlation length."""
    steps = objective.problem.n_samples / objective.counts * median_step(objective.problem)
    series = (
        (each.window, each.time, column)
        for each in windows.outputs.residuals(windows, theta)
        for column in each.residuals.T
    )
    lengths = [correlation_length(*each, step) for each, step in zip(series, steps, strict=True)]
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

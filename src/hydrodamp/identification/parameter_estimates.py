"""Estimates of the parameters that join the coefficients, and whether the log determines them.

The variance is that of a delete-one-block jackknife plus the squares of half the difference of
estimates from two halves, of the undamped step that the minimisation has left and of the share of
the prior; at most that of the prior. Terms that the model lacks bias these parameters, also on axes
whose own residuals are small: unless all residuals, innovations where the form is adequate, are at
the level of white noise, none is determined. Those of the vehicle are then held at their priors;
those of sensors, whose priors hold no value, stay free.

White noise of variance σ² gives averages of n residuals the variance σ²/n. Forces that a model
lacks, and coloured sensor errors, last longer than a sample: √n times such an average has a larger
variance. For a model in the truth the ratio of the variances has at most Fisher's F distribution,
because estimated parameters only reduce the residuals. σ² is that of the residuals' own third
differences: velocities have fast motion that is not noise.

The delay d of a sensor that its description does not state shifts its output to y(t − d). From
d = 0 and the coefficients of a fit, one Gauss-Newton step with all coefficients, initial states and
delays free estimates the delays, with errors of the jackknife. A lag of the actuators delays all
sensors by the same time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import fdtri

from hydrodamp.arrays import FloatArray, factorisation, jackknife_covariance
from hydrodamp.basis.term import AXES, MOTIONS, VELOCITY_OF
from hydrodamp.conditioning.velocity_smoother import white_noise_std
from hydrodamp.identification.continuation import MIN_RELATIVE_RESIDUAL
from hydrodamp.identification.fit import MIN_BLOCKS, jackknife
from hydrodamp.identification.gauss_newton import (
    Iterate,
    ShootingObjective,
    newton_step,
    prior_share,
)
from hydrodamp.identification.grades import critical_value
from hydrodamp.identification.held_out_replay import PieceNormals, split_pieces
from hydrodamp.identification.multiple_shooting import AVERAGES_PER_WINDOW, Windows
from hydrodamp.identification.output_equations import average_rows
from hydrodamp.identification.parameters import Estimate, free_gains
from hydrodamp.identification.rebuilt_outputs import RebuiltOutputs
from hydrodamp.identification.sensor_outputs import RECORDED, SensorOutputs
from hydrodamp.identification.vehicle_values import CURVE_FIELDS
from hydrodamp.models.model import DampingModel

#: Posterior over prior standard deviation from which a parameter is not determined by the log.
MAX_DETERMINED_RATIO = 0.7

#: Standard errors that a delay must exceed, and share of the interval of the sensor.
MIN_SIGNIFICANCE, RESOLUTION = 3.0, 0.25

#: Starts of the labels of curves: part of the form of a force, effective as coefficients are.
_EFFECTIVE = ("dead_band_", "voltage_", *CURVE_FIELDS)

#: What the origins of values in a vehicle file are called in a sentence.
_ORIGINS = {
    "measured": "measured",
    "published": "published",
    "formula": "formula from the sizes of the hull",
    "assumed": "assumed",
}

_CURVE_WORDS = {
    "reverse_": "reverse over forward thrust",
    "exponent_": "exponent",
    "dead_band_": "dead band",
    "voltage_": "exponent of the voltage",
    "gain_": "gain",
    "stall_": "stall angle",
}

_WIDE = f"The standard error is at least {100.0 * MAX_DETERMINED_RATIO:.0f} % of the prior's."
_SCALE = (
    "The gains of commands on {} are free: mass, damping and gains of such an axis have a common "
    "factor that no log determines. A known thrust [N], or a dive with a known ballast, resolves "
    "it."
)
_MISFIT = (
    "{}: the model lacks terms, or sensor errors are coloured, and such parameters absorb both. "
    "Choose a larger damping model, or take the values from a towing tank or strip theory, those "
    "of a sensor from its calibration."
)

#: Probability of a false alarm for a model in the truth, over all outputs and window lengths.
FALSE_ALARMS = 0.01

#: Degrees of freedom of the white-noise variance over the number of residuals (simulated).
NOISE_FREEDOM = 0.22


def estimate_parameters(normals: PieceNormals, model: DampingModel) -> dict[str, Estimate]:
    """Return the estimates by label, with the causes of those that are not determined."""
    objective, result = normals.objective, normals.iterate
    p, parameters = objective.n_coefficients, objective.outputs.parameters
    if not parameters:
        return {}
    theta, std = result.coefficients[p:], np.array([each.std for each in parameters])
    errors = std
    if len(normals.replicates) >= MIN_BLOCKS:
        errors = np.fmin(np.sqrt(variance_rows(normals)[:, p:].diagonal()), std)
    is_wide, misfit = errors >= MAX_DETERMINED_RATIO * std, _misfit(objective, result)
    axes = free_gains(objective.problem, model)
    open_scale, scaled = _SCALE.format(" ".join(axes)), [f"A_{axis}" for axis in axes]
    causes = [
        open_scale
        if each.label in scaled
        else (misfit if not each.label.startswith(_EFFECTIVE) else "") or _WIDE * wide
        for each, wide in zip(parameters, is_wide.tolist(), strict=True)
    ]
    rows = zip(parameters, theta.tolist(), errors.tolist(), causes, strict=True)
    return {each.label: each.estimate(*row) for each, *row in rows}


def parameter_covariance(
    rows: FloatArray, estimates: Mapping[str, Estimate], factors: FloatArray
) -> FloatArray:
    """Return the rows (k, p + k) of the estimates in the joint covariance, from unscaled ones.

    ``factors`` (p,) widen the standard errors of the coefficients.
    """
    errors = np.array([each.standard_error for each in estimates.values()])
    widths = errors / np.sqrt(rows[:, len(factors) :].diagonal())
    return rows * np.outer(widths, np.concatenate([factors, widths]))


def variance_rows(normals: PieceNormals) -> FloatArray:
    """Return the rows (k, p + k) of θ in the covariance of the jackknife, with its allowance."""
    p = normals.objective.n_coefficients
    rows = jackknife_covariance(normals.replicates)[p:]
    rows[:, p:] += np.diag(_bias_allowance(normals))
    return rows


def _bias_allowance(normals: PieceNormals) -> FloatArray:
    """Return the squares that the jackknife lacks."""
    objective, result = normals.objective, normals.iterate
    p = objective.n_coefficients
    remaining = newton_step(objective, result)[p:]
    prior = (objective.scale * prior_share(objective, result))[p:]
    return np.asarray(normals.half_difference[p:] ** 2 + remaining**2 + prior**2)


def _misfit(objective: ShootingObjective, result: Iterate) -> str:
    """Return why residuals exclude estimates of parameters, empty if they do not."""
    names = [VELOCITY_OF[axis] for axis in objective.problem.vehicle.axes]
    outputs = objective.outputs
    base = outputs.base if isinstance(outputs, RebuiltOutputs) else outputs
    if isinstance(base, SensorOutputs):
        names = list(base.labels)
    excess = _excess_over_noise(objective, result, names)
    return _MISFIT.format(excess) if excess else ""


def describe_estimates(estimates: Mapping[str, Estimate]) -> Iterator[str]:
    """Yield a line for each estimate, then a sentence for each cause."""
    for label, each in estimates.items():
        yield f"{label} {each}"
    causes = {label: (each.is_held, each.cause) for label, each in estimates.items() if each.cause}
    for reason in dict.fromkeys(causes.values()):
        labels = " ".join(label for label, each in causes.items() if each == reason)
        is_held, cause = reason
        ending = ": the prior is kept" if is_held else ""
        yield f"The log does not determine {labels}{ending}. {cause}"


def describe_changes(estimates: Mapping[str, Estimate]) -> Iterator[str]:
    """Yield a sentence for each value that the log contradicts, then for each that it changes."""
    moved = {label: each for label, each in estimates.items() if each.is_moved}
    for label, each in sorted(moved.items(), key=lambda item: not item[1].is_contradicted):
        half, unit = critical_value() * each.standard_error, f" {each.unit}".rstrip()
        yield (
            f"{describe_label(label)}: {each.value:.3g} ± {half:.2g}{unit} instead of the file's "
            f"{each.prior:.4g} ({_ORIGINS[each.origin]}): "
            f"{'contradicted' if each.is_contradicted else 'estimated'}."
        )


def describe_label(label: str) -> str:
    for start, words in _CURVE_WORDS.items():
        if label.startswith(start) and label.removeprefix(start) not in AXES:
            return f"{words} of `{label.removeprefix(start)}`"
    quantity, _, component = label.partition("_")
    if quantity == "A":
        return f"{MOTIONS[VELOCITY_OF[component]]} added mass"
    if quantity == "gain":
        return f"gain of the recorded wrench on {component}"
    return "buoyancy" if quantity == "B" else f"{quantity} of the centre of gravity"


def _excess_over_noise(
    objective: ShootingObjective, result: Iterate, outputs: Sequence[str]
) -> str:
    """Return the level furthest above its bound, of all outputs and window lengths, as text."""
    noise, freedom = _white_noise(objective, result)
    confidence = 1.0 - FALSE_ALARMS / (len(noise) * len(result.linearisations))
    levels: list[tuple[str, float, float]] = []
    for windows, *_ in result.linearisations:
        square, count = _average_squares(windows, result.coefficients, noise)
        bounds = fdtri(np.maximum(count, 1.0), freedom, confidence)
        levels += zip(outputs, np.sqrt(square).tolist(), np.sqrt(bounds).tolist(), strict=True)
    name, ratio, bound = max(levels, key=lambda each: each[1] / each[2])
    if not ratio > bound:
        return ""
    return (
        f"Averages of the residuals of {name} are {ratio:.3g} times the sensor noise (white noise: "
        f"at most {bound:.3g})"
    )


def _white_noise(objective: ShootingObjective, result: Iterate) -> tuple[FloatArray, FloatArray]:
    """Return the white noise of each output, at least rounding, and its degrees of freedom."""
    windows, problem = result.linearisations[-1].windows, objective.problem
    columns = [
        (column, each.window)
        for each in windows.outputs.residuals(windows, result.coefficients)
        for column in each.residuals.T
    ]
    noise = np.array([white_noise_std(*each) for each in columns])
    if problem.sensor_log is None:
        spread = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
        noise = np.maximum(noise, MIN_RELATIVE_RESIDUAL * spread)
    sizes = np.array([len(column) for column, _ in columns])
    return noise, np.maximum(NOISE_FREEDOM * sizes, 1.0)


def _average_squares(
    windows: Windows, coefficients: FloatArray, residual_std: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return mean square and number (n_outputs,) of averages of n residuals, times √n.

    Initial states are optimal; diverged and too sensitive windows do not count.
    """
    square, count = np.zeros(len(residual_std)), np.zeros(len(residual_std))
    for linearised, residuals in windows.optimal_residuals(coefficients, residual_std):
        n_windows = len(linearised.edges) - 1
        window = np.repeat(np.arange(n_windows), np.diff(linearised.edges))
        is_used = linearised.columns.any(axis=1)
        for index in range(len(residual_std)):
            rows = np.flatnonzero(is_used & (linearised.output == index))
            averages, _ = average_rows(
                residuals[rows, None], window[rows], n_windows * AVERAGES_PER_WINDOW
            )
            square[index] += np.sum(averages**2)
            count[index] += len(averages)
    return square / np.maximum(count, 1.0), count


@factorisation("normal matrix of the delays")
def significant_delays(objective: ShootingObjective, result: Iterate) -> list[str]:
    """Return the delays beyond their standard errors and the resolution, as text with keys."""
    outputs, sensors = objective.outputs, objective.problem.sensor_log
    finite = [each for each in result.linearisations if np.isfinite(each.windows.length)]
    pieces = split_pieces(objective.problem)
    if sensors is None or not isinstance(outputs, SensorOutputs) or len(pieces) < MIN_BLOCKS:
        return []
    n, names = len(objective.scale) - objective.n_coefficients, list[str]()
    chosen = []
    for each in outputs.outputs:
        if each.name != RECORDED and "delay" not in each.parameters:
            index = {**each.parameters, "delay": np.array([n + len(names)])}
            chosen.append(replace(each, parameters=index))
            names.append(each.name)
        else:
            chosen.append(each)
    k, delayed = len(names), replace(outputs, outputs=tuple(chosen))
    if not k or not finite:
        return []
    scale = np.concatenate([objective.scale, np.full(k, sensors.log.time_scale)])
    objective = replace(objective, outputs=delayed, scale=scale)
    last = finite[-1]._replace(windows=replace(finite[-1].windows, outputs=delayed))
    coefficients = np.concatenate([result.coefficients, np.zeros(k)])
    start = objective.move(replace(result, linearisations=(last,)), coefficients)
    values = newton_step(objective, start)[-k:]
    replicates = PieceNormals.of(objective, start, pieces).replicates[:, -k:]
    errors = jackknife(replicates, objective.problem.duration).standard_errors
    known = {each.measurement.name: each.measurement for each in sensors.sensors}
    steps = [RESOLUTION / known[name].rate for name in names]
    limits = np.maximum(MIN_SIGNIFICANCE * errors, np.maximum(steps, 1.0 / sensors.log.sample_rate))
    half_widths = (critical_value() * errors).tolist()
    pairs = zip(names, values.tolist(), half_widths, limits.tolist(), strict=True)
    return [
        f"{name} {value:.2g} ± {half:.2g} s (`delay: {known[name].delay + value:.2g}` or "
        "`estimate: [delay]` in the mapping)"
        for name, value, half, limit in pairs
        if abs(value) > limit
    ]

"""Estimates of the parameters that join the coefficients, and whether the log determines them.

The variance is that of a delete-one-block jackknife; for parameters of plant and inputs plus the
squares of half the difference of estimates from two halves, of the undamped step that the
minimisation has left and of the share of the prior. Terms that the model lacks and coloured sensor
errors bias these parameters, also on axes whose own residuals are small: unless all residuals are
at the level of the white noise, none is determined.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.identification.fit import MIN_BLOCKS, Estimate, jackknife
from hydrodamp.identification.gauss_newton import (
    Iterate,
    ShootingObjective,
    newton_step,
    prior_share,
)
from hydrodamp.identification.held_out_replay import half_estimates, split_pieces, update_estimate
from hydrodamp.identification.rebuilt_outputs import RebuiltOutputs
from hydrodamp.identification.residual_level import highest_residual_level
from hydrodamp.identification.sensor_outputs import SensorOutputs
from hydrodamp.identification.vehicle_parameters import free_gains
from hydrodamp.models.model import DampingModel

#: Posterior over prior standard deviation from which a parameter is not determined by the log.
MAX_DETERMINED_RATIO = 0.7

_WIDE = f"The standard error is at least {100.0 * MAX_DETERMINED_RATIO:.0f} % of the prior's."
_SCALE = (
    "The gains of commands on {} are free: mass, damping and gains of such an axis have a common "
    "factor that no log determines. A known thrust [N], or a dive with a known ballast, resolves "
    "it."
)
_MISFIT = (
    "{}: the model lacks terms, or sensor errors are coloured, and such parameters absorb both. "
    "Choose a larger damping model, or take the values from a towing tank or strip theory."
)


def estimate_parameters(
    objective: ShootingObjective, model: DampingModel, result: Iterate, replicates: FloatArray
) -> dict[str, Estimate]:
    """Return the estimates by label, with the causes of those that are not determined."""
    p, parameters = objective.n_coefficients, objective.outputs.parameters
    if not parameters:
        return {}
    theta, std = result.coefficients[p:], np.array([each.std for each in parameters])
    errors, causes = np.full(len(std), np.nan), [""] * len(std)
    if len(replicates) >= MIN_BLOCKS:
        covariance = jackknife(replicates[:, p:], objective.problem.duration).covariance
        errors = np.sqrt(np.diag(covariance))
    if isinstance(objective.outputs, RebuiltOutputs):
        chosen = slice(-len(objective.outputs.rebuilt), None)
        square = errors[chosen] ** 2 + _bias_allowance(objective, result)[chosen]
        errors[chosen] = np.fmin(np.sqrt(square), std[chosen])
        is_wide = (errors >= MAX_DETERMINED_RATIO * std)[chosen]
        causes[chosen] = _causes(objective, objective.outputs, model, result, is_wide.tolist())
    rows = zip(parameters, theta.tolist(), errors.tolist(), causes, strict=True)
    return {each.label: each.estimate(*row) for each, *row in rows}


def _bias_allowance(objective: ShootingObjective, result: Iterate) -> FloatArray:
    """Return the squares that the jackknife lacks."""
    p, pieces = objective.n_coefficients, split_pieces(objective.problem)
    halves = half_estimates(objective, pieces, partial(update_estimate, iterate=result))
    remaining = newton_step(objective, result)[p:]
    prior = (objective.scale * prior_share(objective, result))[p:]
    return np.asarray(((halves[0] - halves[1])[p:] / 2.0) ** 2 + remaining**2 + prior**2)


def _causes(
    objective: ShootingObjective,
    outputs: RebuiltOutputs,
    model: DampingModel,
    result: Iterate,
    is_wide: list[bool],
) -> list[str]:
    """Return why each parameter of plant and inputs is not determined."""
    names = [VELOCITY_OF[axis] for axis in objective.problem.vehicle.axes]
    if isinstance(outputs.base, SensorOutputs):
        names = list(outputs.base.labels)
    level = highest_residual_level(objective, result, names)
    misfit = _MISFIT.format(level) if level.is_excessive else ""
    axes = free_gains(objective.problem, model)
    open_scale, scaled = _SCALE.format(" ".join(axes)), [f"A_{axis}" for axis in axes]
    pairs = zip(outputs.rebuilt, is_wide, strict=True)
    return [open_scale if each.label in scaled else misfit or _WIDE * wide for each, wide in pairs]


def describe_estimates(estimates: Mapping[str, Estimate]) -> Iterator[str]:
    """Yield a line for each estimate, then a sentence for each cause."""
    for label, each in estimates.items():
        yield f"{label} {each}"
    for cause in dict.fromkeys(each.cause for each in estimates.values() if each.cause):
        labels = (label for label, each in estimates.items() if each.cause == cause)
        yield f"The log does not determine {' '.join(labels)}: the prior is kept. {cause}"

"""Fit of an iterate of the windows or of the innovations, with the intervals of its jackknife."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.identification.adequacy import Adequacy, Form
from hydrodamp.identification.continuation import RELATIVE_TOLERANCE
from hydrodamp.identification.curve_test import significant_curves
from hydrodamp.identification.fit import Fit, Method, make_fit
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective, newton_step
from hydrodamp.identification.held_out_replay import (
    PieceNormals,
    half_difference_factors,
    information_covariance,
    information_uncertainty,
    jackknife_uncertainty,
)
from hydrodamp.identification.information import find_indirect_coefficients
from hydrodamp.identification.parameter_estimates import (
    estimate_parameters,
    parameter_covariance,
    significant_delays,
    variance_rows,
)
from hydrodamp.identification.prediction_error import FilteredOutputs
from hydrodamp.identification.rebuilt_outputs import fix_parameters
from hydrodamp.identification.regression import column_span
from hydrodamp.kernels.kalman import Noise
from hydrodamp.models.model import DampingModel
from hydrodamp.status import Status

#: Initial estimates of logs whose velocities are rebuilt from sensors.
SENSOR_STARTS = "the best of weak-form, published, hull and zero damping"


def _remark(objective: ShootingObjective, result: Iterate) -> str:
    """Return a sentence on the window lengths, the errors and the prior of the result."""
    if isinstance(fix_parameters(objective, result)[0].outputs, FilteredOutputs):
        return (
            "The minimisation of prediction errors started from output error; prior strength "
            f"relative to the innovations: {result.prior_strength:.2g}."
        )
    lengths = ", ".join(
        "entire segments" if np.isinf(length) else f"{length:.3g} s"
        for length in result.window_lengths
    )
    origin = "the weak form" if objective.problem.sensor_log is None else SENSOR_STARTS
    return (
        f"The minimisation started from {origin}; window lengths: {lengths}; prior "
        f"strength relative to the residuals: {result.prior_strength:.2g}."
    )


def _unconverged_axes(objective: ShootingObjective, result: Iterate) -> list[str]:
    """Return the axes whose remaining step is large, at least that with the largest."""
    p, axes = objective.n_coefficients, objective.entries[1]
    variance = information_covariance(objective, result).diagonal()[:p]
    square = newton_step(objective, result)[:p] ** 2 / variance
    mean = np.array([square[axes == axis].mean() if axis in axes else 0.0 for axis in range(6)])
    is_large = (mean > RELATIVE_TOLERANCE) | (mean == mean.max())
    return [AXES[axis] for axis in np.flatnonzero(is_large)]


def build_fit(
    normals: PieceNormals,
    model: DampingModel,
    method: Method,
    start: FloatArray,
    adequacy: Adequacy | None = None,
    noise: Noise | None = None,
) -> Fit:
    """Build the fit of an iterate, with the intervals of its jackknife replicates.

    They cover the difference of halves and, unless the form is adequate, that to the start; where
    it is, the covariance is that of the Fisher information in proportion.
    """
    objective, result = normals.objective, normals.iterate
    fixed, at = fix_parameters(objective, result)
    problem, p = fixed.problem, objective.n_coefficients
    coefficients = result.coefficients[:p]
    windows, residual_std, *_ = result.linearisations[0]
    factor = windows.qr_factor(result.coefficients, residual_std)
    span = column_span(factor[:p, :p], model.labels)
    uncertainty = jackknife_uncertainty(objective, result, normals.replicates)
    is_adequate = adequacy is not None and adequacy.form is Form.ADEQUATE
    estimates, rows = estimate_parameters(normals, model), None
    if uncertainty is not None:
        factors = half_difference_factors(
            uncertainty, normals.half_difference[:p], objective.entries[1]
        )
        uncertainty = uncertainty.rescale(factors)
        if is_adequate:
            known = information_covariance(objective, result)
            uncertainty = information_uncertainty(known[:p, :p], uncertainty)
            factors = uncertainty.standard_errors / uncertainty.noise_only.standard_errors
            rows = parameter_covariance(known[p:], estimates, factors) if estimates else None
        else:
            if estimates:
                rows = parameter_covariance(variance_rows(normals), estimates, factors)
            origin = "weak-form" if problem.sensor_log is None else "initial"
            allowance = f"the difference of the {origin} to this estimate"
            uncertainty = uncertainty.inflate(coefficients - start[:p], allowance)
    sentences: tuple[str, ...] = ()
    unconverged: tuple[str, ...] = ()
    if not result.converged:
        unconverged = tuple(_unconverged_axes(objective, result))
        sentences += (
            f"The minimisation has not converged on {' '.join(unconverged)}: the remaining step is "
            "large against the standard errors.",
        )
    idle = {label for group in problem.undetermined(model) for label in group}
    status = Status.RANK_DEFICIENT if span.aliased else Status.OK
    if delays := significant_delays(fixed, at):
        sentences = (f"The log suggests delays of {'; '.join(delays)}.",)
    if curves := significant_curves(fixed, at, model):
        words = "`estimate: [thrust_curve]` in the vehicle file estimates the curves"
        sentences += (f"The log suggests that {'; '.join(curves)}: {words}.",)
    indirect: tuple[str, ...] = ()
    if uncertainty is not None:
        half_width = uncertainty.critical_value() * uncertainty.standard_errors
        is_indirect = find_indirect_coefficients(fixed, at, half_width)
        indirect = tuple(np.array(model.labels)[is_indirect].tolist())
    if indirect:
        sentences += (
            f"Only sensors of other motions determine {' '.join(indirect)}, through the coupling "
            "of the mass matrix: these are weak.",
        )
    sensor_std = 0.0 if noise is None else noise.sensor[problem.vehicle.free]
    fit = make_fit(
        problem,
        model,
        method,  # exactly zero, not the solver's 1e-17
        np.where([label in idle for label in model.labels], 0.0, coefficients),
        uncertainty=uncertainty,
        rank=span.rank,
        aliased=span.aliased,
        status=status if result.converged else Status.STOPPED,
        remarks=(_remark(objective, result), *sentences),
    )
    return replace(
        fit,
        estimates=estimates,
        parameter_covariance=rows,
        indirect=indirect,
        unconverged=unconverged,
        adequacy=adequacy,
        held_out_r_squared=normals.held_out_r_squared,
        form_errors={} if is_adequate else normals.form_errors(sensor_std),
        noise=noise,
    )

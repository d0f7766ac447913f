"""Output-error identification: multi-step simulation-error minimisation with error checks.

Two methods minimise the objective J(κ) of :mod:`hydrodamp.identification.gauss_newton`, the
concentrated log-likelihood of simulation errors over growing windows: :class:`OutputError`, and
:class:`Recommended`, which returns the weak form where that replays held-out pieces of the log
better. The covariance is a delete-one-block jackknife of one
Gauss-Newton step plus the prior variance ``σ_κ² (λ/p)² H⁻²`` of directions that the data do not
determine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.command_response import response_remarks
from hydrodamp.identification.continuation import RELATIVE_TOLERANCE, fit_windows
from hydrodamp.identification.fit import (
    MIN_BLOCKS,
    Estimate,
    Fit,
    Method,
    Uncertainty,
    empty_fit,
    jackknife,
    make_fit,
)
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    Iterate,
    ShootingObjective,
    minimise,
)
from hydrodamp.identification.held_out_replay import (
    half_estimates,
    is_lower,
    leave_one_out,
    replay_pieces,
    split_pieces,
    update_estimate,
)
from hydrodamp.identification.indirect_coefficients import find_indirect_coefficients
from hydrodamp.identification.initial_iterate import (
    best_initial_iterate,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.parameter_estimates import describe_estimates, estimate_parameters
from hydrodamp.identification.parameters import Parameter
from hydrodamp.identification.rebuilt_outputs import (
    fix_parameters,
    free_parameters,
    transfer_iterate,
)
from hydrodamp.identification.regression import column_span
from hydrodamp.identification.sensor_delays import significant_delays
from hydrodamp.identification.vehicle_parameters import (
    VEHICLE_PARAMETERS,
    rebuild_plant,
    vehicle_parameters,
)
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.status import Status

#: Initial estimates of logs whose velocities are rebuilt from sensors.
SENSOR_STARTS = "the best of weak-form, published, hull and zero damping"

#: Steps of the last minimisation with parameters of the vehicle.
MAX_STEPS = 40

_WEAK_FORM = (
    "This is the weak-form estimate: it replays held-out pieces of the log better than the "
    "output-error estimate."
)


@dataclass(frozen=True)
class OutputError:
    """Minimise the error of open-loop simulations over windows of growing length.

    The method minimises the truncated (multi-step) simulation error by damped Gauss-Newton steps,
    with the sensitivities of the Runge-Kutta steps of a replay. It estimates the initial state of
    each window, with the smoothed measured velocity as its prior. It starts from the weak form and
    adds the window lengths one after the other. Residuals of each velocity and length have an
    unknown variance of their own (concentrated likelihood). A ridge prior, whose strength the
    evidence sets (MacKay 1992), and a penalty on energy injection up to three times the measured
    velocities regularise the coefficients. After Farina and Piroddi (2010).

    Parameters
    ----------
    windows : tuple of float
        Window lengths [s], increasing; infinity for entire segments. Lengths beyond the longest
        segment count as infinity. By default 0.75, 1.5, 3 and 6 times the correlation time
        of the velocities (the lag at which their autocorrelation falls to 1/e, median over the
        velocities), then entire segments.
    estimate : tuple of str
        Parameters of the vehicle that are estimated with the coefficients: ``added-mass``,
        ``center-of-gravity``, ``buoyancy``. Those that the log determines become part of the
        vehicle of the fit; the others are held at their priors, with the cause in
        ``Fit.estimates``.

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing, or a parameter is unknown.

    Examples
    --------
    >>> OutputError().key, OutputError(windows=(5.0,)).windows
    ('oe', (5.0,))
    """

    windows: tuple[float, ...] = ()
    estimate: tuple[str, ...] = ()

    key = "oe"
    compares_sensors = True

    def __post_init__(self) -> None:
        """Check the window lengths and the names of parameters."""
        lengths = np.asarray(self.windows, dtype=np.float64)
        if not (np.all(lengths > 0.0) and np.all(np.diff(lengths) > 0.0)):
            raise MethodError(f"`windows` must be positive and increasing [s]; got {self.windows}")
        known = all(name in VEHICLE_PARAMETERS for name in self.estimate)
        demand(known, "estimate", f"from {', '.join(VEHICLE_PARAMETERS)}", self.estimate)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Damping model to identify.

        Returns
        -------
        fit : Fit
            ``STOPPED`` if the minimisation did not converge.
        """
        vehicle, model = problem.vehicle, model.restricted_to(problem.vehicle.axes)
        parameters = vehicle_parameters(vehicle, self.estimate)
        equations = problem.equations.restrict_to(model)
        if parameters:  # the vehicle of the fit has its estimates
            equations = replace(equations, vehicle=replace(vehicle, estimate=()))
        problem = replace(problem, equations=equations)
        if not model.n_coefficients:
            return empty_fit(problem, model, self.key, Status.EMPTY)
        fit = self._estimate(make_objective(problem, model), model, parameters)
        if not fit.estimates:
            return fit
        return replace(fit, remarks=(*fit.remarks, *describe_estimates(fit.estimates)))

    def _estimate(
        self, objective: ShootingObjective, model: DampingModel, parameters: tuple[Parameter, ...]
    ) -> Fit:
        """Return the joint fit; what the log does not determine keeps its prior."""
        if not parameters:
            return self._build_fit(objective, model, *fit_windows(objective, model, self.windows))
        joint, undetermined = _free_vehicle(objective, model, parameters), dict[str, Estimate]()
        start, result = fit_windows(joint, model, self.windows)
        while True:
            # mass and damping have a narrow valley
            tolerance = min(FINAL_TOLERANCE, RELATIVE_TOLERANCE / result.n_free)
            result = minimise(joint, result, tolerance, MAX_STEPS)
            fit = self._build_fit(joint, model, start, result)
            causes = {key: each.cause for key, each in fit.estimates.items()}
            if not any(causes.values()):
                return replace(fit, estimates=fit.estimates | undetermined)
            undetermined |= {key: each for key, each in fit.estimates.items() if each.cause}
            is_free = np.array([not cause for cause in causes.values()])
            index = np.flatnonzero(np.append(np.ones(objective.n_coefficients, bool), is_free))
            parameters = tuple(each for each in parameters if not causes[each.label])
            if not parameters:
                fit = self._estimate(objective, model, ())
                return replace(fit, estimates=fit.estimates | undetermined)
            joint = _free_vehicle(objective, model, parameters)
            start, result = (transfer_iterate(joint, each, index) for each in (start, result))

    def _build_fit(
        self, objective: ShootingObjective, model: DampingModel, start: Iterate, result: Iterate
    ) -> Fit:
        replicates = leave_one_out(objective, result, split_pieces(objective.problem))
        return build_fit(objective, model, self, start, result, replicates)


@dataclass(frozen=True)
class Recommended(OutputError):  # noqa: N818 (output error is a method, not an exception)
    """Output error, or the weak form where that replays held-out pieces of the log better.

    The log is cut into about 32 pieces. The estimate of :class:`OutputError` is updated by one step
    without each piece, which it then replays; the weak form is estimated without every second
    piece. The weak form is the result if its mean error is lower by more than one standard error.
    The difference of the output-error estimates from either half of the pieces widens the
    confidence intervals. A remark names a significant lag of the commands.

    Parameters
    ----------
    windows, estimate : tuple
        As of :class:`OutputError`.

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing, or a parameter is unknown.

    Examples
    --------
    >>> Recommended().key
    'recommended'
    """

    key = "recommended"

    def _build_fit(
        self, objective: ShootingObjective, model: DampingModel, start: Iterate, result: Iterate
    ) -> Fit:
        pieces = split_pieces(objective.problem)
        if len(pieces) < MIN_BLOCKS:
            return super()._build_fit(objective, model, start, result)
        replicates = leave_one_out(objective, result, pieces)
        halves = half_estimates(objective, pieces, partial(update_estimate, iterate=result))
        if _is_weak_form_better(objective, model, start, replicates, pieces):
            result, replicates = start, leave_one_out(objective, start, pieces)
        difference = (halves[0] - halves[1]) / 2.0
        fit = build_fit(objective, model, self, start, result, replicates, difference)
        return replace(fit, remarks=(*fit.remarks, *response_remarks(objective.problem, model)))


def _free_vehicle(
    objective: ShootingObjective, model: DampingModel, parameters: tuple[Parameter, ...]
) -> ShootingObjective:
    """Return the objective with free parameters of the vehicle."""
    rebuild = rebuild_plant(objective.problem, model, parameters)
    return free_parameters(objective, parameters, rebuild)


def _is_weak_form_better(
    objective: ShootingObjective,
    model: DampingModel,
    start: Iterate,
    replicates: FloatArray,
    pieces: IntArray,
) -> bool:
    """Return whether the weak form replays held-out pieces better; it needs all velocities."""
    if objective.problem.sensor_log is not None:
        return False
    weak = partial(_weak_form, model=model, length=start.window_lengths[0])
    other_half = 1 - np.arange(len(pieces)) % 2
    held_out = half_estimates(objective, pieces, weak)[other_half], replicates
    weak_error, error = (replay_pieces(objective, pieces, each) for each in held_out)
    return is_lower(weak_error, error)


def _weak_form(half: ShootingObjective, *, model: DampingModel, length: float) -> FloatArray:
    """Return the weak-form estimate of lowest cost on windows of a length [s]."""
    return best_initial_iterate(half, initial_candidates(half, model), length).coefficients


def _remark(problem: Problem, start: Iterate, result: Iterate) -> str:
    """Return a sentence on the window lengths and the prior of the result."""
    if result is start:
        return _WEAK_FORM
    lengths = ", ".join(
        "entire segments" if np.isinf(length) else f"{length:.3g} s"
        for length in result.window_lengths
    )
    origin = "the weak form" if problem.sensor_log is None else SENSOR_STARTS
    return (
        f"The minimisation started from {origin}; window lengths: {lengths}; prior strength "
        f"relative to the residuals: {result.prior_strength:.2g}."
    )


def build_fit(
    objective: ShootingObjective,
    model: DampingModel,
    method: Method,
    start: Iterate,
    result: Iterate,
    replicates: FloatArray,
    half_difference: FloatArray | None = None,
) -> Fit:
    """Build the fit of an iterate with its jackknife replicates (n_blocks, p).

    Intervals allow for its shift from the start and the difference of halves.
    """
    fixed, at = fix_parameters(objective, result)
    problem, p = fixed.problem, objective.n_coefficients
    coefficients = result.coefficients[:p]
    windows, residual_std, *_ = result.linearisations[0]
    factor = windows.qr_factor(result.coefficients, residual_std)
    span = column_span(factor[:p, :p], model.labels)
    uncertainty = jackknife_uncertainty(objective, result, replicates)
    if uncertainty is not None and half_difference is not None:
        axes = objective.entries[1]
        uncertainty = uncertainty.rescale(_inflation(uncertainty, half_difference[:p], axes))
    if uncertainty is not None and start is not result:
        origin = "weak-form" if problem.sensor_log is None else "initial"
        allowance = f"the shift from the {origin} to this estimate"
        uncertainty = uncertainty.inflate(coefficients - start.coefficients[:p], allowance)
    idle = {label for group in problem.undetermined(model) for label in group}
    status = Status.RANK_DEFICIENT if span.aliased else Status.OK
    estimates = estimate_parameters(objective, model, result, replicates)
    if result is start:
        estimates = {key: replace(each, cause=_WEAK_FORM) for key, each in estimates.items()}
    sentences: tuple[str, ...] = ()
    if delays := significant_delays(fixed, at):
        sentences = (f"The log suggests delays of {'; '.join(map(str, delays))}.",)
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
    fit = make_fit(
        problem,
        model,
        method,  # exactly zero, not the solver's 1e-17
        np.where([label in idle for label in model.labels], 0.0, coefficients),
        uncertainty=uncertainty,
        rank=span.rank,
        aliased=span.aliased,
        status=status if result.converged or result is start else Status.STOPPED,
        remarks=(_remark(problem, start, result), *sentences),
    )
    return replace(fit, estimates=estimates, indirect=indirect)


def _inflation(uncertainty: Uncertainty, half_difference: FloatArray, axes: IntArray) -> FloatArray:
    """Return the RMS difference of halves over standard errors on each axis, at least 1.

    It covers the curvature of the objective, which one linearisation does not.
    """
    error = uncertainty.noise_only.standard_errors
    ratio = np.divide(half_difference, error, out=np.zeros_like(error), where=error > 0.0) ** 2
    count = np.bincount(axes, minlength=6)
    mean_square = np.bincount(axes, ratio, minlength=6) / np.maximum(count, 1)
    return np.sqrt(np.maximum(mean_square, 1.0))[axes]


@factorisation("normal matrix of the windows")
def jackknife_uncertainty(
    objective: ShootingObjective, result: Iterate, replicates: FloatArray
) -> Uncertainty | None:
    """Return the jackknife covariance of replicates (n_blocks, p), plus the prior variance.

    With Hessian H, the prior adds ``σ_κ² (λ/p)² H⁻²``: the variance of directions that the data do
    not determine.
    """
    if len(replicates) < MIN_BLOCKS:
        return None
    p = objective.n_coefficients
    scale = objective.scale[:p]
    uncertainty = jackknife(replicates[:, :p], objective.problem.duration)
    prior = result.prior_strength / p
    hessian = objective.gauss_newton(result)[0][:p, :p] + prior * np.eye(p)
    prior_root = prior * np.linalg.inv(hessian) * scale[:, None]
    variance = result.prior_variance * (prior_root @ prior_root.T)
    noise = uncertainty.covariance
    return replace(uncertainty, covariance=noise + variance, noise=noise)

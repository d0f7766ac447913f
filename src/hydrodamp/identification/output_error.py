"""Output-error identification: multi-step simulation-error minimisation with error checks.

Two methods minimise the objective J(κ) of :mod:`hydrodamp.identification.gauss_newton`, the
concentrated log-likelihood of simulation errors over growing windows: :class:`OutputError`, and
:class:`Recommended`, which returns the weak form where that replays held-out pieces of the log
better. The covariance is a delete-one-block jackknife of one
Gauss-Newton step plus the prior variance ``σ_κ² (λ/p)² H⁻²`` of directions that the data do not
determine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.errors import MethodError
from hydrodamp.identification.command_response import response_remarks
from hydrodamp.identification.continuation import fit_windows
from hydrodamp.identification.fit import (
    MIN_BLOCKS,
    Fit,
    Method,
    Uncertainty,
    empty_fit,
    jackknife,
    make_fit,
)
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    MIN_DAMPING,
    Iterate,
    ShootingObjective,
    minimise,
)
from hydrodamp.identification.held_out_replay import (
    is_lower,
    leave_one_out,
    replay_pieces,
    split_pieces,
)
from hydrodamp.identification.indirect_coefficients import find_indirect_coefficients
from hydrodamp.identification.initial_iterate import (
    best_initial_iterate,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.regression import column_span
from hydrodamp.identification.sensor_delays import significant_delays
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.status import Status

#: Initial estimates of logs whose velocities are rebuilt from sensors.
SENSOR_STARTS = "the best of weak-form, published, hull and zero damping"


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

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing.

    Examples
    --------
    >>> OutputError().key, OutputError(windows=(5.0,)).windows
    ('oe', (5.0,))
    """

    windows: tuple[float, ...] = ()

    key = "oe"
    compares_sensors = True

    def __post_init__(self) -> None:
        """Check the window lengths."""
        lengths = np.asarray(self.windows, dtype=np.float64)
        if not (np.all(lengths > 0.0) and np.all(np.diff(lengths) > 0.0)):
            raise MethodError(f"`windows` must be positive and increasing [s]; got {self.windows}")

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
        model = model.restricted_to(problem.vehicle.axes)
        problem = replace(problem, equations=problem.equations.restrict_to(model))
        if not model.n_coefficients:
            return empty_fit(problem, model, self.key, Status.EMPTY)
        objective = make_objective(problem, model)
        return self._build_fit(objective, model, *fit_windows(objective, model, self.windows))

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
    windows : tuple of float
        As of :class:`OutputError`.

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing.

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


def half_estimates(
    objective: ShootingObjective,
    pieces: IntArray,
    estimate: Callable[[ShootingObjective], FloatArray],
) -> FloatArray:
    """Return the estimates (2, p) from the even and from the odd pieces."""
    return np.array([estimate(objective.restrict(pieces[parity::2])) for parity in (0, 1)])


def _weak_form(half: ShootingObjective, *, model: DampingModel, length: float) -> FloatArray:
    """Return the weak-form estimate of lowest cost on windows of a length [s]."""
    return best_initial_iterate(half, initial_candidates(half, model), length).coefficients


def update_estimate(half: ShootingObjective, *, iterate: Iterate) -> FloatArray:
    """Return an estimate after one step on a part of the log."""
    linearisations = tuple(
        previous._replace(windows=half.windows_like(previous.windows))
        for previous in iterate.linearisations
    )
    start = replace(iterate, linearisations=linearisations, damping=MIN_DAMPING)
    start = half.move(start, iterate.coefficients)
    return minimise(half, start, FINAL_TOLERANCE, max_iterations=1).coefficients


def _remark(problem: Problem, start: Iterate, result: Iterate) -> str:
    """Return a sentence on the window lengths and the prior of the result."""
    if result is start:
        return (
            "This is the weak-form estimate: it replays held-out pieces of the log better than "
            "the output-error estimate."
        )
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
    problem, p = objective.problem, objective.n_coefficients
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
    sensors, sentences = sensor_estimates(objective, result, replicates)
    if delays := significant_delays(objective, result):
        sentences += (f"The log suggests delays of {'; '.join(map(str, delays))}.",)
    indirect: tuple[str, ...] = ()
    if uncertainty is not None:
        half_width = uncertainty.critical_value() * uncertainty.standard_errors
        is_indirect = find_indirect_coefficients(objective, result, half_width)
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
    return replace(fit, sensor_parameters=sensors, indirect=indirect)


def sensor_estimates(
    objective: ShootingObjective, result: Iterate, replicates: FloatArray
) -> tuple[dict[str, tuple[float, float]], tuple[str, ...]]:
    """Return value and standard error of each parameter of sensors, and a sentence on them."""
    p, parameters = objective.n_coefficients, objective.outputs.parameters
    if not parameters:
        return {}, ()
    error = np.full(len(parameters), np.nan)
    if len(replicates) >= MIN_BLOCKS:
        error = np.sqrt(
            np.diag(jackknife(replicates[:, p:], objective.problem.duration).covariance)
        )
    pairs = zip(result.coefficients[p:].tolist(), error.tolist(), strict=True)
    estimates = {each.label: pair for each, pair in zip(parameters, pairs, strict=True)}
    texts = [
        f"{each.label} {estimates[each.label][0]:.3g} ± {estimates[each.label][1]:.2g} {each.unit}"
        for each in parameters
    ]
    return estimates, (f"Sensors (value ± standard error): {'; '.join(texts)}.",)


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

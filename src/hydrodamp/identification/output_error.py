"""Output-error identification: multi-step simulation-error minimisation with error checks.

Two methods minimise the objective J(κ) of :mod:`hydrodamp.identification.gauss_newton`, the
concentrated log-likelihood of simulation errors over growing windows: :class:`OutputError`, and
:class:`Recommended`, which cross-validates the result against the weak-form estimate on two halves
of the log. The covariance is a delete-one-block jackknife of one Gauss-Newton step plus the prior
variance ``σ_κ² (λ/p)² H⁻²`` of directions that the data do not determine.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.errors import MethodError, Status
from hydrodamp.identification.fit import Fit, Method, Uncertainty, empty_fit, make_fit
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    MIN_DAMPING,
    Iterate,
    ShootingObjective,
    admissible_lengths,
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
    minimise,
)
from hydrodamp.identification.jackknife import (
    MAX_BLOCKS,
    MIN_BLOCKS,
    jackknife,
    leave_one_out_sums,
)
from hydrodamp.identification.qr_factor import column_span
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Length of the blocks [s] that alternate between the two halves of a cross-validation.
HALF_BLOCK_LENGTH = 100.0

#: Standard errors by which the weak form must predict better to replace the output-error estimate.
SIGNIFICANCE = 3.0


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
        segment count as infinity.

    Raises
    ------
    MethodError
        If the lengths are not positive and increasing.

    Examples
    --------
    >>> OutputError().key, OutputError(windows=(5.0,)).windows
    ('oe', (5.0,))
    """

    windows: tuple[float, ...] = (2.0, 4.0, 8.0, 16.0)

    def __post_init__(self) -> None:
        """Check the window lengths."""
        lengths = np.asarray(self.windows, dtype=np.float64)
        if not len(lengths) or not lengths[0] > 0.0 or not np.all(np.diff(lengths) > 0.0):
            raise MethodError(f"`windows` must be positive and increasing [s]; got {self.windows}")

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "oe"

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
        lengths = admissible_lengths(problem, self.windows)
        candidates = initial_candidates(objective, model)
        start = best_initial_iterate(objective, candidates, lengths[0])
        result = continue_over_lengths(objective, start, lengths)
        return self._make_fit(objective, model, start, result)

    def _make_fit(
        self, objective: ShootingObjective, model: DampingModel, start: Iterate, result: Iterate
    ) -> Fit:
        return build_fit(objective, model, self, start, result)


@dataclass(frozen=True)
class Recommended(OutputError):  # noqa: N818 (output error is a method, not an exception)
    """Output error with two-fold cross-validation against the weak form.

    The log is cut into blocks that alternate between two halves. The estimate of
    :class:`OutputError` is updated by one step on either half and replayed over the blocks of the
    other half, and so is the weak-form estimate of that half. If the weak form has a significantly
    lower error, it is the result. The difference of the estimates of both halves widens the
    confidence intervals.

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

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "recommended"

    def _make_fit(
        self, objective: ShootingObjective, model: DampingModel, start: Iterate, result: Iterate
    ) -> Fit:
        excess, half_difference = _cross_validate(objective, model, result)
        if _is_significant(excess):
            result = start
        return build_fit(objective, model, self, start, result, half_difference)


def _is_significant(excess: FloatArray) -> bool:
    """Return whether a mean over blocks is more than three standard errors above zero."""
    standard_error = np.std(excess, ddof=1) / np.sqrt(len(excess))
    return bool(excess.mean() > SIGNIFICANCE * standard_error)


def _cross_validate(
    objective: ShootingObjective, model: DampingModel, result: Iterate
) -> tuple[FloatArray, FloatArray]:
    """Return the excess replay error over the weak form on test blocks, and half the difference.

    The excess (n_blocks,) is of mean square errors over the variance of each velocity, each error
    clipped at one. The difference is that of the estimates from both halves.
    """
    problem = objective.problem
    blocks, excess, estimates = _split_blocks(problem), [], []
    velocity_std = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
    velocity_std[velocity_std == 0.0] = 1.0
    halves = objective.restrict(blocks[::2]), objective.restrict(blocks[1::2])
    for training, test in (halves, halves[::-1]):
        windows = [training.windows(length) for length in result.window_lengths]
        candidates = initial_candidates(training, model)
        weak_form = best_initial_iterate(training, candidates, windows[0].length)
        pairs = zip(result.linearisations, windows, strict=True)
        linearisations = tuple(previous._replace(windows=new) for previous, new in pairs)
        iterate = replace(result, linearisations=linearisations, damping=MIN_DAMPING)
        iterate = training.move(iterate, result.coefficients)
        iterate = minimise(training, iterate, FINAL_TOLERANCE, max_iterations=1)
        test_windows, errors = test.windows(np.inf), []
        for coefficients in (weak_form.coefficients, iterate.coefficients):
            residuals = np.clip(test_windows.residuals(coefficients) / velocity_std, -1.0, 1.0)
            square = np.mean(residuals**2, axis=1)
            total = np.add.reduceat(square, test_windows.spans[:, 0])
            errors.append(total / np.diff(test_windows.spans, axis=1).ravel())
        excess.append(errors[1] - errors[0])
        estimates.append(iterate.coefficients)
    return np.concatenate(excess), (estimates[0] - estimates[1]) / 2.0


def _split_blocks(problem: Problem) -> IntArray:
    """Return the bounds of an even number of blocks of each segment."""
    blocks: list[tuple[int, int]] = []
    for start, stop in problem.segments.tolist():
        time = problem.inputs.time[start:stop]
        n = 2 * max(round((time[-1] - time[0]) / HALF_BLOCK_LENGTH / 2.0), 1)
        edges = start + np.searchsorted(time, np.linspace(time[0], time[-1], n + 1)[1:-1])
        blocks += zip([start, *edges.tolist()], [*edges.tolist(), stop], strict=True)
    return np.array(blocks, dtype=np.int64)


def _remark(start: Iterate, result: Iterate) -> str:
    """Return a sentence on the window lengths and the prior of the result."""
    if result is start:
        return (
            "This is the weak-form estimate: the output-error estimate has a larger "
            "cross-validated replay error."
        )
    lengths = ", ".join(
        "entire segments" if np.isinf(length) else f"{length:g} s"
        for length in result.window_lengths
    )
    return (
        f"The minimisation started from the weak form; window lengths: {lengths}; prior strength "
        f"relative to the residuals: {result.prior_strength:.2g}."
    )


def build_fit(
    objective: ShootingObjective,
    model: DampingModel,
    method: Method,
    start: Iterate,
    result: Iterate,
    half_difference: FloatArray | None = None,
) -> Fit:
    """Build the fit of an iterate; intervals allow for its shift and the difference of halves."""
    problem, coefficients = objective.problem, result.coefficients
    windows, residual_std, *_ = result.linearisations[0]
    factor = windows.qr_factor(coefficients, residual_std)
    span = column_span(factor[:, :-1], model.labels)
    uncertainty = jackknife_uncertainty(objective, result)
    if uncertainty is not None and half_difference is not None:
        axes = objective.entries[1]
        uncertainty = uncertainty.rescale(_inflation(uncertainty, half_difference, axes))
    if uncertainty is not None and start is not result:
        uncertainty = uncertainty.inflate(
            coefficients - start.coefficients, "the shift from the weak-form to this estimate"
        )
    idle = {label for group in problem.undetermined(model) for label in group}
    status = Status.RANK_DEFICIENT if span.aliased else Status.OK
    return make_fit(
        problem,
        model,
        method,  # exactly zero, not the solver's 1e-17
        np.where([label in idle for label in model.labels], 0.0, coefficients),
        uncertainty=uncertainty,
        rank=span.rank,
        aliased=span.aliased,
        status=status if result.converged or result is start else Status.STOPPED,
        remarks=(_remark(start, result),),
    )


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
def jackknife_uncertainty(objective: ShootingObjective, result: Iterate) -> Uncertainty | None:
    """Return the jackknife covariance of one Gauss-Newton step, plus the prior variance.

    All replicates share one linearisation and the full prior. With Hessian H, the prior adds
    ``σ_κ² (λ/p)² H⁻²``: the variance of directions that the data do not determine.
    """
    n = min(MAX_BLOCKS, len(result.linearisations[0].windows.bounds))
    if n < MIN_BLOCKS:
        return None
    scale, p = objective.scale, len(objective.scale)
    column_scale = np.append(scale, 1.0)
    normals: FloatArray = np.zeros((n, p + 1, p + 1))
    for windows, residual_std, *_ in result.linearisations:
        count = len(result.linearisations) * len(windows.samples) * len(residual_std)
        blocks = windows.block_normal_matrices(result.coefficients, residual_std, n)
        normals += blocks / count
    normals *= column_scale[:, None] * column_scale
    prior = result.prior_strength / p
    remaining, x = leave_one_out_sums(normals), result.coefficients / scale
    hessians = remaining[:, :-1, :-1] + prior * np.eye(p)
    steps = np.linalg.solve(hessians, (remaining[:, :-1, -1] - prior * x)[:, :, None])[:, :, 0]
    uncertainty = jackknife(steps * scale, objective.problem.duration)
    hessian = normals.sum(axis=0)[:-1, :-1] + prior * np.eye(p)
    prior_root = prior * np.linalg.inv(hessian) * scale[:, None]
    variance = result.prior_variance * (prior_root @ prior_root.T)
    noise = uncertainty.covariance
    return replace(uncertainty, covariance=noise + variance, noise=noise)

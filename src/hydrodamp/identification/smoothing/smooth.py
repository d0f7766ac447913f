"""Smoothing and least squares in turn: measured velocities are noisy in the terms, too."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import lapack

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, empty_fit, fitted
from hydrodamp.identification.regression.least_squares import LeastSquares
from hydrodamp.identification.rows.derivative import SavitzkyGolay
from hydrodamp.identification.rows.rank import Span, spanned
from hydrodamp.identification.smoothing.noise import Noise, sensor_noise
from hydrodamp.identification.smoothing.smoother import Pass, first_disturbance
from hydrodamp.identification.smoothing.track import Track
from hydrodamp.identification.smoothing.transition import Steps, by_coefficients
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.replay import LIMIT
from hydrodamp.simulation.status import Status

_BLOCK = 512
"""Steps whitened at once: bounds the memory of large models."""

_PANEL = 8
"""Inner block of the LAPACK factorisation."""

_CONVERGED = 1.0
"""Passes end where minus twice the log-likelihood changes by less: half a unit of it is
what one coefficient gains by chance."""


_ABOUT = 1.1
"""A later pass is the more likely one: it is kept while its mean square error in replay
is at most this many times the least."""


@dataclass(frozen=True)
class Estimate:
    """What one pass came to."""

    coefficients: FloatArray
    span: Span[str]
    noise: Noise
    replay: float


@dataclass(frozen=True)
class Smoothed:
    """Least squares on smoothed motion, smoothed again with its result, and so on.

    Parameters
    ----------
    passes : int
        How often at most.

    Raises
    ------
    MethodError
        If there is no pass.

    Examples
    --------
    >>> Smoothed().key
    'smooth'
    """

    passes: int = 20

    def __post_init__(self) -> None:
        """Refuse what would do nothing."""
        if not isinstance(self.passes, int | np.integer) or self.passes < 1:
            raise MethodError(f"`passes` must be a whole number, at least 1; got {self.passes}")

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "smooth"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms; needs no acceleration.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            With the covariance that the noise levels give it. The remarks state the
            levels, and which pass was kept.
        """
        free = model.restricted_to(problem.vehicle.axes)
        problem.columns.require(free)
        if not free.n_coefficients:
            return empty_fit(problem, free, self.key, Status.EMPTY)
        if Steps.of(problem).n < max(len(terms) for terms in free.terms):
            return empty_fit(problem, free, self.key, Status.TOO_FEW_SAMPLES)
        estimates = list(_passes(problem, free, self.passes))
        if not estimates:
            return empty_fit(problem, free, self.key, Status.FAILED)
        kept = _kept(estimates)
        return fitted(
            problem,
            free,
            self,
            kept.coefficients,
            covariance=kept.span.coefficients @ kept.span.coefficients.T,
            rank=kept.span.rank,
            aliased=kept.span.aliased,
            remarks=_remarks(estimates, kept),
        )


def _passes(problem: Problem, model: DampingModel, most: int) -> Iterator[Estimate]:
    """Fit and smooth in turn, until the likelihood stands still or a step runs away."""
    steps, loudest, track = Steps.of(problem), sensor_noise(problem), Track.recorded(problem)
    start = LeastSquares(SavitzkyGolay()).identify(problem, model).damping
    noise = loudest.disturbed(first_disturbance(problem, problem.matrix(start)))
    coefficients, before = np.zeros(model.n_coefficients), np.inf
    try:
        for _ in range(most):
            matrix = problem.columns.with_unknown(problem.columns.entries(model), coefficients)
            here = Pass.along(problem, steps, matrix, track, noise)
            span, coefficients = _refitted(here, model, matrix, coefficients)
            matrix = problem.columns.with_unknown(problem.columns.entries(model), coefficients)
            here = Pass.along(problem, steps, matrix, track, noise)
            weights = here.weights()
            deviance, track = here.deviance(weights), here.smoothed(weights)
            yield Estimate(coefficients, span, noise, _replay_error(problem, matrix, track))
            if abs(before - deviance) < _CONVERGED:
                return
            noise, before = here.explained(weights, loudest), deviance
    except np.linalg.LinAlgError:
        return


def _refitted(
    here: Pass, model: DampingModel, matrix: FloatArray, coefficients: FloatArray
) -> tuple[Span[str], FloatArray]:
    """Generalised least squares on the steps of a pass."""
    triangle = np.zeros((len(coefficients) + 1,) * 2, order="F")
    previous: FloatArray | None = None
    for first in range(0, here.linear.steps.n, _BLOCK):
        chosen = np.arange(first, min(first + _BLOCK, here.linear.steps.n))
        rows = _rows(here, model, matrix, coefficients, chosen)
        white = here.errors.whiten(rows, first * here.linear.steps.width, previous)
        previous = white[1 - len(here.errors.factor) :].copy()
        triangle = _folded(triangle, white)
    if not np.all(np.isfinite(triangle)):
        raise np.linalg.LinAlgError("the rows are not finite")
    triangle = np.triu(triangle)
    span = spanned(triangle[:, :-1], model.labels)
    return span, span.coefficients @ (span.directions.T @ triangle[:, -1])


def _folded(triangle: FloatArray, rows: FloatArray) -> FloatArray:
    """Triangle of the QR factorisation of a triangle on top of rows; both are overwritten."""
    panel = min(_PANEL, len(triangle))
    result: FloatArray = lapack.dtpqrt(
        0, panel, triangle, rows, overwrite_a=True, overwrite_b=True
    )[0]
    return result


def _rows(
    here: Pass,
    model: DampingModel,
    matrix: FloatArray,
    coefficients: FloatArray,
    chosen: IntArray,
) -> FloatArray:
    """Rows ``[B r]`` of some steps, r being what they lack without the coefficients."""
    problem, entries = here.problem, here.problem.columns.entries(model)
    parameters = np.column_stack(entries).astype(np.int32)
    inputs, steps = here.track.inputs(problem), here.linear.steps
    slope = by_coefficients(problem, steps, matrix, inputs, chosen, parameters)
    if not problem.propulsion_known:
        slope[:, :, [term.needs_propulsion for terms in model.terms for term in terms]] = 0.0
    target = here.missing[chosen] + slope @ coefficients
    return np.concatenate([slope, target[..., None]], axis=2).reshape(-1, slope.shape[2] + 1)


def _replay_error(problem: Problem, matrix: FloatArray, track: Track) -> float:
    """Open loop from the smoothed start of each segment: noise of one sample decides nothing."""
    plant, free = problem.columns.plant, problem.vehicle.free
    inputs = track.inputs(problem)
    velocity, diverged = kernels.replay(plant, matrix, inputs, problem.segments, limit=LIMIT)
    if np.any(diverged >= 0):
        return float("inf")
    recorded = problem.inputs.velocity[:, free]
    variance = recorded.var(axis=0)
    error = np.mean(np.square(velocity[:, free] - recorded), axis=0)
    return float(np.mean(error / np.where(variance > 0.0, variance, 1.0)))


def _kept(estimates: list[Estimate]) -> Estimate:
    """Return the last that replays the log about as well as the best."""
    best = min(estimate.replay for estimate in estimates)
    return next(one for one in reversed(estimates) if one.replay <= _ABOUT * best)


def _remarks(estimates: list[Estimate], kept: Estimate) -> tuple[str, ...]:
    place = next(k for k, estimate in enumerate(estimates, 1) if estimate is kept)
    found = f"Noise found: {kept.noise}."
    if not np.isfinite(kept.replay):
        return (found, f"No pass of {len(estimates)} replays the log; the last one is given.")
    share = 100.0 * np.sqrt(kept.replay)
    return (
        found,
        f"Pass {place} of {len(estimates)} is given, the last that replays the log about as well "
        f"as the best, to {share:.3g} % of the standard deviation of each velocity, root mean "
        "square.",
    )

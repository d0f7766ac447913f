"""Recursive least squares that neither winds up nor bursts when nothing is excited."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differences import mean_square
from hydrodamp.identification.fit import Fit, empty_fit, fitted
from hydrodamp.identification.online import first_guess, with_log
from hydrodamp.identification.triangle import spanned
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Estimate, Recursion
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Columns, Problem, stamp
from hydrodamp.simulation.status import Status


class RecursiveAdaptation(NamedTuple):
    """Recursive least squares bound to a plant and a model: all that a step needs."""

    columns: Columns
    model: DampingModel
    recursion: Recursion
    start: Estimate


class RecursiveState(NamedTuple):
    """Where recursive least squares stands.

    Attributes
    ----------
    adaptation : RecursiveAdaptation
        Plant, model and settings.
    estimate : Estimate
        Coefficients, information and noise.
    block : ndarray
        The block of time under way.
    last : Sample
        The sample it was made with.
    """

    adaptation: RecursiveAdaptation
    estimate: Estimate
    block: FloatArray
    last: Sample

    @property
    def damping(self) -> Damping:
        """The present estimate, with the vehicle it belongs to."""
        bound = self.adaptation
        vehicle = stamp(bound.columns.vehicle)
        return Damping(bound.model, self.estimate.coefficients, vehicle=vehicle)

    def restarted(self, sample: Sample) -> RecursiveState:
        """Return the state at the first sample after a gap: a new block, all that was known.

        Parameters
        ----------
        sample : Sample
            The first one after the gap.

        Returns
        -------
        state : RecursiveState
            A new one.
        """
        empty = frozen(np.zeros_like(self.block))
        return RecursiveState(self.adaptation, self.estimate, empty, sample)


@dataclass(frozen=True)
class RecursiveLeastSquares:
    """Least squares sample by sample, with directional forgetting.

    Parameters
    ----------
    block : float
        Length of a block of time [s]; a row spans two. Longer ones average more noise
        away, shorter ones keep quicker motions.
    memory : float
        Time after which most of what was known along a direction is replaced, if that
        is excited all the while [s]; infinite for a vehicle that does not change.
    prior : float
        How many rows of each term's usual size the start is worth.
    start : Damping, optional
        Coefficients to start from, such as a published set; the paper's start by
        default.

    Raises
    ------
    MethodError
        If a setting is out of range.

    Examples
    --------
    >>> RecursiveLeastSquares().key
    'rls'
    """

    block: float = 1.0
    memory: float = 600.0
    prior: float = 1.0
    start: Damping | None = None

    def __post_init__(self) -> None:
        """Refuse settings that make no sense."""
        for name in ("block", "prior"):
            given = getattr(self, name)
            demand(0.0 < given < np.inf, name, "positive and finite", given)
        least = f"at least one block of {self.block} s"
        demand(self.memory >= self.block, "memory", least, self.memory)

    key = "rls"

    def bind(self, source: Problem | Columns, model: DampingModel) -> RecursiveAdaptation:
        """Bind the settings to a plant and a model; the prior follows the problem's log."""
        problem = with_log(source, "size of each term")
        columns = problem.columns
        free = model.restricted_to(columns.vehicle.axes)
        rows, axes = columns.entries(free)
        size = self.block * np.sqrt(self.prior * mean_square(problem)[rows - columns.n_known])
        if not np.all(np.isfinite(size)):
            raise MethodError(
                "a term's mean square is not finite: look for absurd numbers in the log."
            )
        known = columns.with_unknown((rows, axes), np.zeros(len(rows)))
        unit = np.divide(1.0, size, out=np.zeros(len(size)), where=size > 0.0)
        forgetting = -float(np.expm1(-self.block / self.memory))
        recursion = Recursion(columns.plant, rows, axes, known, unit, self.block, forgetting)
        start = recursion.before(first_guess(free, self.start))
        return RecursiveAdaptation(columns, free, recursion, start)

    def init(
        self, source: Problem | Columns, model: DampingModel, sample: Sample
    ) -> RecursiveState:
        """Start online at the first sample of a run.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; a problem, such as one of last week's dive.
        model : DampingModel
            Which terms.
        sample : Sample
            The first one; see :func:`hydrodamp.identification.online.observe`.

        Returns
        -------
        state : RecursiveState
            At the start, nothing known.
        """
        bound = self.bind(source, model)
        block = core.new_block(bound.columns.plant)
        return RecursiveState(bound, bound.start, block, sample)

    def step(self, state: RecursiveState, sample: Sample) -> RecursiveState:
        """Return the state one sample later; the given one stays as it is.

        Parameters
        ----------
        state : RecursiveState
            From :meth:`init`, an earlier step, or ``state.restarted(sample)``
            after a gap.
        sample : Sample
            The next one.

        Returns
        -------
        state : RecursiveState
            A new one; its estimate is the same until a block is full.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        bound, estimate, block, last = state
        block, row = core.block_step(bound.recursion, block, last, sample)
        if row is not None:
            estimate = core.absorb(bound.recursion, estimate, row)
        return RecursiveState(bound, estimate, block, sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Go through the log once and return the last estimate.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            With covariance; its rank counts the directions the data tell more of than
            the prior. ``BY_PRIOR`` where that is not all of them, ``TOO_FEW_SAMPLES``
            where no segment has two blocks.
        """
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        estimate = core.recur(bound.recursion, bound.start, problem.inputs, problem.segments)
        if not estimate.rows.any():
            return empty_fit(problem, bound.model, self.key, Status.TOO_FEW_SAMPLES)
        covariances, ranks, aliased = zip(
            *(_known(bound, estimate, axis) for axis in range(6)), strict=True
        )
        rank = sum(ranks)
        return fitted(
            problem,
            bound.model,
            self,
            estimate.coefficients,
            covariance=block_diag(*covariances),
            rank=rank,
            aliased=tuple(group for groups in aliased for group in groups),
            status=Status.OK if rank == bound.model.n_coefficients else Status.BY_PRIOR,
        )


def _known(
    bound: RecursiveAdaptation, estimate: Estimate, axis: int
) -> tuple[FloatArray, int, tuple[tuple[str, ...], ...]]:
    """Return covariance, rank and aliased labels of one axis."""
    recursion = bound.recursion
    part, information = recursion.of(axis, estimate.information)
    names = bound.model.labels[part]
    values, vectors = np.linalg.eigh(information)
    told = values >= 1.0  # the information of the prior is the identity
    scaled = recursion.unit[part, None] * vectors
    covariance = estimate.noise[axis] * (scaled / (1.0 + np.maximum(values, 0.0))) @ scaled.T
    directions = vectors[:, told].T if told.any() else np.zeros((1, len(names)))
    aliased = spanned(directions, names, np.ones(len(names))).aliased
    return covariance, int(told.sum()), aliased

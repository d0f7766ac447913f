"""Recursive least squares that neither winds up nor bursts when nothing is excited."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, empty_fit, fitted
from hydrodamp.identification.online.adaptation import Bound, first_guess
from hydrodamp.identification.online.gains import with_log
from hydrodamp.identification.online.recursive_state import RecursiveAdaptation, RecursiveState
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.identification.rows.velocity_noise import mean_square
from hydrodamp.kernels.inputs import Sample
from hydrodamp.kernels.recursion import Estimate, Recursion, block_size
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status


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
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise MethodError(
                    f"`{name}` must be positive and finite; got {getattr(self, name)}"
                )
        if not self.memory >= self.block:
            raise MethodError(
                f"`memory` must be at least one block of {self.block} s; got {self.memory}"
            )

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "rls"

    def bind(self, source: Problem | Columns, model: DampingModel) -> RecursiveAdaptation:
        """Bind the settings to a plant and a model.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; a problem, for the prior follows the log.
        model : DampingModel
            Which terms.

        Returns
        -------
        adaptation : RecursiveAdaptation
            What a step needs, on a log or live.

        Raises
        ------
        MethodError
            If there is no log.
        """
        problem = with_log(source, "size of each term")
        bound = Bound.to(problem.columns, model)
        rows = bound.entries.rows - problem.columns.n_known
        size = self.block * np.sqrt(self.prior * mean_square(problem)[rows])
        if not np.all(np.isfinite(size)):
            raise MethodError(
                "a term's mean square is not finite: look for absurd numbers in the log."
            )
        unit = np.where(size > 0.0, 1.0 / np.where(size > 0.0, size, 1.0), 0.0)
        forgetting = -float(np.expm1(-self.block / self.memory))
        recursion = Recursion(bound.entries, unit, self.block, forgetting)
        return RecursiveAdaptation(bound, recursion, first_guess(bound.model, self.start))

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
            The first one; see :func:`hydrodamp.identification.online.sample_by_sample.observe`.

        Returns
        -------
        state : RecursiveState
            At the start, nothing known.
        """
        adaptation = self.bind(source, model)
        bound = adaptation.bound
        block = np.zeros(block_size(bound.columns.plant.n_terms))
        return RecursiveState(
            adaptation, Estimate.before(bound.entries, adaptation.start), block, sample
        )

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
            A new one.
        """
        return state.advanced(sample)

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
        adaptation = self.bind(problem, model)
        bound, recursion = adaptation.bound, adaptation.recursion
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        before = Estimate.before(bound.entries, adaptation.start)
        estimate = kernels.recur(
            bound.columns.plant, recursion, before, problem.inputs, problem.segments
        ).estimate
        if not estimate.rows.any():
            return empty_fit(problem, bound.model, self.key, Status.TOO_FEW_SAMPLES)
        known = [known_of(adaptation, estimate, axis) for axis in range(6)]
        rank = sum(part.rank for part in known)
        covariance = block_diag(*(part.covariance for part in known))
        return fitted(
            problem,
            bound.model,
            self,
            estimate.coefficients,
            covariance=covariance,
            rank=rank,
            aliased=tuple(group for part in known for group in part.aliased),
            status=Status.OK if rank == bound.model.n_coefficients else Status.BY_PRIOR,
        )


@dataclass(frozen=True)
class Known:
    """What an estimate tells of one axis."""

    covariance: FloatArray
    rank: int
    aliased: tuple[tuple[str, ...], ...]


def known_of(adaptation: RecursiveAdaptation, estimate: Estimate, axis: int) -> Known:
    """Return what an estimate tells of one axis."""
    entries = adaptation.bound.entries
    part = entries.of(axis)
    information = entries.squares(estimate.information)[axis]
    names = adaptation.bound.model.labels[part]
    values, vectors = np.linalg.eigh(information)
    told = values >= 1.0
    scaled = adaptation.recursion.unit[part, None] * vectors
    covariance = estimate.noise[axis] * (scaled / (1.0 + np.maximum(values, 0.0))) @ scaled.T
    directions = vectors[:, told].T if told.any() else np.zeros((1, len(names)))
    aliased = spanned(directions, names, np.ones(len(names))).aliased
    return Known(covariance, int(told.sum()), aliased)

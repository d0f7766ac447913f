"""Recursive least squares live: one pure step a sample."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.identification.online.adaptation import Bound
from hydrodamp.identification.online.sample_by_sample import require_later
from hydrodamp.kernels.inputs import Sample
from hydrodamp.kernels.recursion import Estimate, Recursion
from hydrodamp.models.damping import Damping


@dataclass(frozen=True)
class RecursiveAdaptation:
    """Recursive least squares bound to a plant and a model: all that a step needs."""

    bound: Bound
    recursion: Recursion
    start: FloatArray


@dataclass(frozen=True)
class RecursiveState:
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
        return self.adaptation.bound.damping(self.estimate.coefficients)

    def advanced(self, sample: Sample) -> RecursiveState:
        """Return the state one sample later.

        Parameters
        ----------
        sample : Sample
            Later than the last one.

        Returns
        -------
        state : RecursiveState
            A new one; its estimate is the same until a block is full.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        require_later(self.last, sample)
        bound, recursion = self.adaptation.bound, self.adaptation.recursion
        plant, entries = bound.columns.plant, bound.entries
        block, row = kernels.block_step(
            plant, entries, recursion.block, self.block, self.last, sample
        )
        estimate = self.estimate if row is None else kernels.absorb(recursion, self.estimate, row)
        return RecursiveState(self.adaptation, estimate, block, sample)

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
        return replace(self, block=frozen(np.zeros_like(self.block)), last=sample)

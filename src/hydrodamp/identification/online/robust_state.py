"""The robust identifier live: one pure step a sample."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import frozen
from hydrodamp.identification.online.adaptation import RobustAdaptation
from hydrodamp.identification.online.sample_by_sample import require_later
from hydrodamp.kernels.inputs import Sample
from hydrodamp.kernels.robustness import Adapting
from hydrodamp.models.damping import Damping


@dataclass(frozen=True)
class RobustState:
    """Where a robust identifier stands.

    Attributes
    ----------
    adaptation : RobustAdaptation
        Plant, model and settings.
    adapting : Adapting
        Coefficients, velocity error and the sums of the mean.
    last : Sample
        The sample it was made with.
    """

    adaptation: RobustAdaptation
    adapting: Adapting
    last: Sample

    @property
    def damping(self) -> Damping:
        """The present estimate, with the vehicle it belongs to."""
        return self.adaptation.bound.damping(self.adapting.coefficients)

    @property
    def mean(self) -> Damping:
        """The mean estimate over time since the start or :meth:`averaging`."""
        return self.adaptation.bound.damping(self.adapting.mean)

    def advanced(self, sample: Sample) -> RobustState:
        """Return the state one sample later.

        Parameters
        ----------
        sample : Sample
            Later than the last one.

        Returns
        -------
        state : RobustState
            A new one.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        require_later(self.last, sample)
        bound, robustness = self.adaptation.bound, self.adaptation.robustness
        plant = bound.columns.plant
        moved = kernels.robust_step(plant, robustness, self.adapting, self.last, sample)
        for array in (moved.coefficients, moved.error, moved.total):
            array.setflags(write=False)
        return RobustState(self.adaptation, moved, sample)

    def restarted(self, sample: Sample) -> RobustState:
        """Return the state at the first sample after a gap: no error, same coefficients.

        Parameters
        ----------
        sample : Sample
            The first one after the gap.

        Returns
        -------
        state : RobustState
            A new one.
        """
        still = replace(self.adapting, error=frozen(np.zeros(6)))
        return replace(self, adapting=still, last=sample)

    def averaging(self) -> RobustState:
        """Return the same state with a mean that begins here."""
        none = frozen(np.zeros_like(self.adapting.total))
        return replace(self, adapting=replace(self.adapting, total=none, duration=0.0))

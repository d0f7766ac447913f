"""From coefficients an online method has come to, to the nearest ones that dissipate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.dissipation.dissipative_set import project_dissipative
from hydrodamp.identification.dissipation.operating_box import operating_box
from hydrodamp.identification.dissipation.power import worst_power
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem


class Projection(Protocol):
    """A way to nearby coefficients: any callable of this form."""

    def __call__(self, problem: Problem, damping: Damping, metric: FloatArray) -> Damping:
        """Return coefficients near to the given ones, as the metric measures."""
        ...


@dataclass(frozen=True)
class OntoDissipative:
    """The nearest damping that takes power everywhere on the box the log was sailed in.

    Damping that does so already stays as it is.
    """

    def __call__(self, problem: Problem, damping: Damping, metric: FloatArray) -> Damping:
        """Project."""
        box = operating_box(problem)
        if worst_power(damping, box).power <= 0.0:
            return damping
        return project_dissipative(damping, box, metric)


def inverted(gain: FloatArray) -> FloatArray:
    """Invert a gain matrix on the coefficients that move; zero rows stay zero."""
    live = np.diag(gain) > 0.0
    unit = np.sqrt(np.where(live, np.diag(gain), 1.0))
    filled = gain / np.outer(unit, unit) + np.diag(~live).astype(np.float64)
    inverse = np.linalg.inv(filled) / np.outer(unit, unit)
    return np.asarray(np.where(np.outer(live, live), 0.5 * (inverse + inverse.T), 0.0))


def joined(blocks: Sequence[FloatArray]) -> FloatArray:
    """Return one metric of all axes; what no block measures counts as the rest on average."""
    metric: FloatArray = np.asarray(block_diag(*blocks))
    diagonal = np.diag(metric)
    measured = diagonal > 0.0
    unmeasured = float(diagonal[measured].mean()) if measured.any() else 1.0
    return np.asarray(metric + np.diag(np.where(measured, 0.0, unmeasured)))

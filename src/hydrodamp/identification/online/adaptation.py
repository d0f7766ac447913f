"""An adaptive identifier bound to a plant and a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITY_OF
from hydrodamp.kernels.entries import Entries
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.stamp import stamp


@dataclass(frozen=True)
class Adaptation:
    """An identifier bound to a plant and a model: all that a step needs."""

    columns: Columns
    model: DampingModel
    entries: tuple[np.ndarray, np.ndarray]
    a: FloatArray
    gamma: FloatArray

    def start(self) -> FloatArray:
        """Return the paper's start: −1 on the diagonal linear terms, 0 elsewhere."""
        return self.columns.with_unknown(self.entries, first_guess(self.model))


@dataclass(frozen=True)
class Bound:
    """A recursive method bound to a plant and a model."""

    columns: Columns
    model: DampingModel
    entries: Entries

    @classmethod
    def to(cls, columns: Columns, model: DampingModel) -> Bound:
        """Bind to the free axes of a vehicle."""
        free = model.restricted_to(columns.vehicle.axes)
        rows, axes = columns.entries(free)
        known = columns.with_unknown((rows, axes), np.zeros(len(rows)))
        return cls(columns, free, Entries(rows, axes, known))

    def damping(self, coefficients: FloatArray, covariance: FloatArray | None = None) -> Damping:
        """Return the damping of some coefficients, with the vehicle it belongs to."""
        vehicle = stamp(self.columns.vehicle)
        return Damping(self.model, coefficients, covariance=covariance, vehicle=vehicle)


def first_guess(model: DampingModel, known: Damping | None = None) -> FloatArray:
    """Return the paper's start: −1 on the diagonal linear terms, 0 elsewhere."""
    if known is not None:
        return known.onto(model)
    values = [
        -1.0 if str(term) == VELOCITY_OF[AXES[axis]] else 0.0
        for axis, terms in enumerate(model.terms)
        for term in terms
    ]
    return np.array(values)

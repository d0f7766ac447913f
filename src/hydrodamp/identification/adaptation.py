"""An adaptive identifier bound to a plant and a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITY_OF
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.columns import Columns


@dataclass(frozen=True)
class Adaptation:
    """An identifier bound to a plant and a model: all that a step needs.

    Attributes
    ----------
    columns : Columns
        Equation 1 as one table.
    model : DampingModel
        Whose entries move.
    entries : tuple of ndarray
        Rows and axes of the table where they stand.
    a : ndarray, shape (6,)
        Error gain of each axis.
    gamma : ndarray, shape (n_columns, 6)
        Adaptation gain of each entry; zero where it does not move.
    """

    columns: Columns
    model: DampingModel
    entries: tuple[np.ndarray, np.ndarray]
    a: FloatArray
    gamma: FloatArray

    def start(self) -> FloatArray:
        """Return the paper's start: −1 on the diagonal linear terms, 0 elsewhere."""
        values = [
            -1.0 if str(term) == VELOCITY_OF[AXES[axis]] else 0.0
            for axis, terms in enumerate(self.model.terms)
            for term in terms
        ]
        return self.columns.with_unknown(self.entries, np.array(values))

"""An adaptive identifier bound to a plant and a model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES, VELOCITY_OF
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.robustness import Robustness
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.stamp import stamp


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
        return self.columns.with_unknown(self.entries, first_guess(self.model))


@dataclass(frozen=True)
class Bound:
    """A robust or recursive method bound to a plant and a model.

    Attributes
    ----------
    columns : Columns
        Equation 1 as one table.
    model : DampingModel
        Whose coefficients move; restricted to the free axes.
    entries : Entries
        Where they stand in the table.
    """

    columns: Columns
    model: DampingModel
    entries: Entries

    @classmethod
    def to(cls, columns: Columns, model: DampingModel) -> Bound:
        """Bind to the free axes of a vehicle.

        Parameters
        ----------
        columns : Columns
            Equation 1 as one table.
        model : DampingModel
            Which terms.

        Returns
        -------
        bound : Bound
            All other coefficients are taken as known.
        """
        free = model.restricted_to(columns.vehicle.axes)
        rows, axes = columns.entries(free)
        known = columns.with_unknown((rows, axes), np.zeros(len(rows)))
        return cls(columns, free, Entries(rows, axes, known))

    def damping(self, coefficients: FloatArray, covariance: FloatArray | None = None) -> Damping:
        """Return the damping of some coefficients, with the vehicle it belongs to."""
        vehicle = stamp(self.columns.vehicle)
        return Damping(self.model, coefficients, covariance=covariance, vehicle=vehicle)


@dataclass(frozen=True)
class RobustAdaptation:
    """A robust identifier bound to a plant and a model: all that a step needs.

    Attributes
    ----------
    bound : Bound
        Plant and model.
    robustness : Robustness
        Gain matrices and what makes them robust.
    """

    bound: Bound
    robustness: Robustness


def first_guess(model: DampingModel, known: Damping | None = None) -> FloatArray:
    """Return the paper's start: −1 on the diagonal linear terms, 0 elsewhere.

    Parameters
    ----------
    model : DampingModel
        Which terms.
    known : Damping, optional
        To start from in its place; 0 where it lacks a term.

    Returns
    -------
    coefficients : ndarray, shape (n_coefficients,)
        In the order of the model's labels.
    """
    if known is not None:
        return known.onto(model)
    values = [
        -1.0 if str(term) == VELOCITY_OF[AXES[axis]] else 0.0
        for axis, terms in enumerate(model.terms)
        for term in terms
    ]
    return np.array(values)

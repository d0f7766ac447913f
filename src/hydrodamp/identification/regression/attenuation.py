"""How far noise in the regressors moves a linear estimate."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.instruments import around, without
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.models.model import DampingModel

APART = 1.5
"""How far the instruments are [s]: longer than the noise of a sensor is taken to be alike, and
no longer than a vehicle takes to change its motion."""


NOISY_TERMS = f"noise in the terms themselves, by instruments {APART:g} s away"
"""What :func:`attenuation` makes room for."""


def attenuation(rows: Rows, model: DampingModel, lag: float = APART) -> FloatArray:
    """Return how far each coefficient moves when only what is foretold of the terms counts."""
    parts = [_shift(rows, model, axis, lag) for axis, terms in enumerate(model.terms) if terms]
    return np.concatenate(parts) if parts else np.zeros(0)


def _shift(rows: Rows, model: DampingModel, axis: int, lag: float) -> FloatArray:
    columns = rows.design[:, [rows.basis.index(term) for term in model.terms[axis]]]
    near, known = around(rows, columns, lag)
    if np.count_nonzero(known) <= near.shape[1]:
        return np.zeros(columns.shape[1])
    here, target = columns[known], rows.target[known, axis]
    foretold = here - without(here, near[known])
    return _solved(foretold, target) - _solved(here, target)


def _solved(design: FloatArray, target: FloatArray) -> FloatArray:
    span = spanned(design, range(design.shape[1]))
    coefficients: FloatArray = span.coefficients @ (span.directions.T @ target)
    return coefficients

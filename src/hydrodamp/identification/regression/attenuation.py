"""How far noise in the regressors moves a linear estimate.

Terms are evaluated at measured velocities. Their noise draws coefficients towards zero where
it is not small against the motion, and no residual shows it. Instruments do: two-stage least
squares (J. D. Sargan, "The Estimation of Economic Relationships using Instrumental Variables",
1958, doi:10.2307/1907619) on what the rows some time before and after foretell of the terms is
free of the noise, though it scatters more. How far it is from the estimate is how far the
estimate may be off.
"""

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
    """Return how far each coefficient moves when only what is foretold of the terms counts.

    Parameters
    ----------
    rows : Rows
        With columns for all terms of the model.
    model : DampingModel
        Restricted to the free axes.
    lag : float
        How far before and after the instruments are [s], and twice that.

    Returns
    -------
    shift : ndarray, shape (n_coefficients,)
        By two-stage less by plain least squares, on the same rows. Zero on an axis with
        fewer rows than instruments.

    Examples
    --------
    >>> from hydrodamp.basis.basis import Basis
    >>> from hydrodamp.models.model import DampingModel
    >>> model = DampingModel.from_table({"X": "u"}, key="drag")
    >>> rng, time = np.random.default_rng(0), np.arange(0.0, 400.0, 0.1)
    >>> surge, noise = np.sin(0.5 * time), 0.5 * rng.normal(size=4000)
    >>> target = np.outer(-10.0 * surge, [1.0, 0, 0, 0, 0, 0])
    >>> rows = Rows(Basis(model.terms[0]), (surge + noise)[:, None], target, 0 * time, time)
    >>> bool(-4.0 < attenuation(rows, model)[0] < -3.0)
    True
    """
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

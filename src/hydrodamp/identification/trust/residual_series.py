"""Residuals as a series in time: correlation at every lag, and spectrum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.models.damping import Damping

_SHARE = 4
"""Lags reach to this part of the longest segment."""

_LAGS = 40
"""Lags at most."""

_FREQUENCIES = 129
"""Frequencies of a spectrum."""


@dataclass(frozen=True, eq=False)
class ResidualSeries:
    """What one axis leaves over, in time."""

    lag: FloatArray
    correlation: FloatArray
    frequency: FloatArray
    density: FloatArray


def white_reach(n: int) -> float:
    """Return how large a correlation of white residuals gets, at nineteen lags of twenty."""
    return 1.96 / float(np.sqrt(n))


def left_over(rows: Rows, damping: Damping) -> FloatArray:
    """Return what a damping leaves of each axis of some rows."""
    explained = np.zeros_like(rows.target)
    matrix = damping.matrix
    for axis, terms in enumerate(damping.model.terms):
        columns = [rows.basis.index(term) for term in terms]
        weights = [matrix[axis, damping.model.basis.index(term)] for term in terms]
        explained[:, axis] = rows.design[:, columns] @ np.array(weights)
    return rows.target - explained


def series(residuals: FloatArray, segment: IntArray, spacing: float) -> ResidualSeries:
    """Return correlation and spectrum of residuals, never across a join."""
    longest = int(np.bincount(segment).max(initial=0)) if len(segment) else 0
    if longest < _SHARE:
        raise MethodError(
            f"at least {_SHARE} residuals of one segment are needed for a correlation; got "
            f"{longest}: give a longer log"
        )
    lags = np.arange(min(_LAGS, longest // _SHARE) + 1)
    lag: FloatArray = lags.astype(np.float64) * spacing
    n = len(residuals)
    covariance = np.array([_covariance(residuals, segment, lag) / n for lag in lags.tolist()])
    frequency = np.linspace(0.0, 0.5 / spacing, _FREQUENCIES)
    waves = np.cos(2.0 * np.pi * np.outer(frequency, lag))
    weights = np.where(lags == 0, 1.0, 2.0) * _parzen(lags / (lags[-1] + 1.0)) * covariance
    return ResidualSeries(
        lag=lag,
        correlation=covariance / covariance[0] if covariance[0] > 0.0 else 0.0 * covariance,
        frequency=frequency,
        density=np.maximum(2.0 * spacing * waves @ weights, 0.0),
    )


def _covariance(residuals: FloatArray, segment: IntArray, lag: int) -> float:
    stop = len(residuals) - lag
    same = segment[lag:] == segment[:stop]
    return float(residuals[lag:][same] @ residuals[:stop][same])


def _parzen(share: FloatArray) -> FloatArray:
    inner = 1.0 - 6.0 * share**2 * (1.0 - share)
    return np.where(share <= 0.5, inner, 2.0 * (1.0 - share) ** 3)

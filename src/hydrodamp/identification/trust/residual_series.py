"""Residuals as a series in time: correlation at every lag, and spectrum."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.support import chosen_support
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem

#: Lags reach to this part of the longest segment.
_SHARE = 4

#: Lags at most.
_LAGS = 40

#: Frequencies of a spectrum.
_FREQUENCIES = 129


@dataclass(frozen=True, eq=False)
class ResidualSeries:
    """What one axis leaves over, in time."""

    lag: FloatArray
    correlation: FloatArray
    frequency: FloatArray
    density: FloatArray
    #: How large a correlation of white residuals gets, at nineteen lags of twenty.
    white: float


def residual_series(
    problem: Problem, dampings: Sequence[Damping], support: float | None = None
) -> list[dict[str, ResidualSeries]]:
    """Return what each damping leaves over on the axes of its terms, under test functions."""
    length = chosen_support(problem).length if support is None else support
    rows = WeakEquations(length, overlap=1, windows=()).rows(problem)
    found = []
    for damping in dampings:
        left, terms = left_over(rows, damping), zip(AXES, damping.model.terms, strict=True)
        found.append(
            {
                axis: series(left[:, place], rows.segment, length)
                for place, (axis, own) in enumerate(terms)
                if own
            }
        )
    return found


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
        white=1.96 / float(np.sqrt(n)),
    )


def _covariance(residuals: FloatArray, segment: IntArray, lag: int) -> float:
    stop = len(residuals) - lag
    same = segment[lag:] == segment[:stop]
    return float(residuals[lag:][same] @ residuals[:stop][same])


def _parzen(share: FloatArray) -> FloatArray:
    inner = 1.0 - 6.0 * share**2 * (1.0 - share)
    return np.where(share <= 0.5, inner, 2.0 * (1.0 - share) ** 3)

"""Coefficients that err together: the correlation of estimates, and the pairs to be told."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray

ALIKE = 0.9
"""Correlation from which two coefficients are said to be known better together than apart."""


class Pair(NamedTuple):
    """Two coefficients, by their places in the model, and the correlation of their errors."""

    first: int
    second: int
    correlation: float


def correlation(covariance: FloatArray) -> FloatArray:
    """Return the correlation of estimates."""
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = np.where((deviation > 0.0) & np.isfinite(deviation), deviation, np.nan)
    found: FloatArray = np.clip(covariance / np.outer(known, known), -1.0, 1.0)
    return found


def correlated_pairs(covariance: FloatArray, least: float = 0.0) -> list[Pair]:
    """Return the pairs of coefficients whose errors are correlated."""
    found = np.nan_to_num(np.triu(correlation(covariance), 1))
    first, second = np.nonzero((np.abs(found) >= least) & (found != 0.0))
    values = found[first, second]
    order = np.argsort(-np.abs(values), kind="stable")
    places = zip(first[order].tolist(), second[order].tolist(), strict=True)
    return [Pair(i, j, value) for (i, j), value in zip(places, values[order].tolist(), strict=True)]

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
    """Return the correlation of estimates.

    Parameters
    ----------
    covariance : ndarray, shape (n, n)
        Of the coefficients.

    Returns
    -------
    correlation : ndarray, shape (n, n)
        From -1 to 1; NaN where a variance is zero or not finite.

    Examples
    --------
    >>> correlation(np.array([[4.0, 3.0], [3.0, 9.0]])).tolist()
    [[1.0, 0.5], [0.5, 1.0]]
    """
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = np.where((deviation > 0.0) & np.isfinite(deviation), deviation, np.nan)
    found: FloatArray = np.clip(covariance / np.outer(known, known), -1.0, 1.0)
    return found


def correlated_pairs(covariance: FloatArray, least: float = 0.0) -> list[Pair]:
    """Return the pairs of coefficients whose errors are correlated.

    Parameters
    ----------
    covariance : ndarray, shape (n, n)
        Of the coefficients.
    least : float, optional
        Absolute correlation from which a pair counts, beside being more than zero.

    Returns
    -------
    pairs : list of Pair
        The most correlated first.

    Examples
    --------
    >>> correlated_pairs(np.array([[4.0, 3.0], [3.0, 9.0]]))
    [Pair(first=0, second=1, correlation=0.5)]
    """
    found = np.nan_to_num(np.triu(correlation(covariance), 1))
    first, second = np.nonzero((np.abs(found) >= least) & (found != 0.0))
    values = found[first, second]
    order = np.argsort(-np.abs(values), kind="stable")
    places = zip(first[order].tolist(), second[order].tolist(), strict=True)
    return [Pair(i, j, value) for (i, j), value in zip(places, values[order].tolist(), strict=True)]

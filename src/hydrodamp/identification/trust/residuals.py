"""Residuals of a regression: how they are correlated in time, and how many are far out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from hydrodamp.arrays import FloatArray, IntArray

_LAGS = 10
"""Lags that the test of Ljung and Box asks about, on long series."""

_PER_LAG = 5
"""Samples for each lag, on short ones."""

_NORMAL = 1.482602218505602
"""The standard deviation of a normal distribution over its median absolute deviation."""

FAR = 4.0
"""Robust standard deviations from which a residual is an outlier: 6 in 100 000 of normal ones."""


@dataclass(frozen=True)
class Whiteness:
    """How a residual is like the one before.

    Attributes
    ----------
    p : float or None
        Of G. M. Ljung and G. E. P. Box (1978), doi:10.1093/biomet/65.2.297: the
        probability that white residuals would look as correlated as these. None for
        residuals that are too few or all zero.
    neighbours : float
        Correlation of neighbours, -1 to 1.
    time : float
        Integrated autocorrelation time [s]: residuals this far apart count as
        independent.
    """

    p: float | None
    neighbours: float
    time: float


def whiteness(series: FloatArray, segment: IntArray, spacing: float) -> Whiteness:
    """Test residuals for correlation in time, never across a join.

    Parameters
    ----------
    series : ndarray, shape (m,)
        Residuals of rows that share no sample, in the order of time.
    segment : ndarray of int, shape (m,)
        Number of the segment of each, never falling.
    spacing : float
        Time from one to the next [s].

    Returns
    -------
    whiteness : Whiteness
        On 10 lags, fewer for short series.

    Examples
    --------
    >>> noise = np.random.default_rng(0).normal(size=400)
    >>> one = np.zeros(400, dtype=int)
    >>> whiteness(noise, one, 1.0).p > 0.05, whiteness(noise.cumsum(), one, 1.0).p < 0.001
    (True, True)
    """
    lags = min(_LAGS, len(series) // _PER_LAG)
    power = float(series @ series)
    if lags < 1 or power <= 0.0:
        return Whiteness(None, 0.0, spacing)
    pairs, correlation = _correlations(series / np.sqrt(power), segment, lags)
    statistic = len(series) * (len(series) + 2.0) * float(np.sum(correlation**2 / pairs))
    positive = correlation[: np.argmax(np.append(correlation, -1.0) <= 0.0)]
    return Whiteness(
        p=float(chdtrc(lags, statistic)),
        neighbours=float(correlation[0]),
        time=spacing * (1.0 + 2.0 * float(positive.sum())),
    )


def outlier_share(series: FloatArray) -> float:
    """Return the share of residuals beyond four robust standard deviations.

    Parameters
    ----------
    series : ndarray, shape (m,)
        Residuals.

    Returns
    -------
    share : float
        0 to 1. The robust deviation is 1.4826 times the median absolute one, which is
        that of a normal distribution.

    Examples
    --------
    >>> outlier_share(np.array([-1.0, 1.0, -2.0, 2.0, 0.5, -0.5, 0.0, 90.0]))
    0.125
    """
    if not len(series):
        return 0.0
    distance = np.abs(series - np.median(series))
    return float(np.mean(distance > FAR * _NORMAL * np.median(distance)))


def _correlations(
    series: FloatArray, segment: IntArray, lags: int
) -> tuple[FloatArray, FloatArray]:
    """Return pairs and correlation at lags from one on; the series has unit norm."""
    pairs, correlation = np.ones(lags), np.zeros(lags)
    for lag in range(1, lags + 1):
        same = segment[lag:] == segment[:-lag]
        pairs[lag - 1] = max(int(np.count_nonzero(same)), 1)
        correlation[lag - 1] = float(series[lag:][same] @ series[:-lag][same])
    return pairs, correlation

"""Residuals of a regression: how they are correlated in time, and how many are far out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from hydrodamp.arrays import FloatArray, IntArray

#: Lags that the test of Ljung and Box asks about, on long series.
_LAGS = 10

#: Samples for each lag, on short ones.
_PER_LAG = 5

#: The standard deviation of a normal distribution over its median absolute deviation.
_NORMAL = 1.482602218505602

#: Robust standard deviations from which a residual is an outlier: 6 in 100 000 of normal ones.
FAR = 4.0


@dataclass(frozen=True)
class Whiteness:
    """How a residual is like the one before."""

    p: float | None
    neighbours: float
    time: float


def whiteness(series: FloatArray, segment: IntArray, spacing: float) -> Whiteness:
    """Test residuals for correlation in time, never across a join."""
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
    """Return the share of residuals beyond four robust standard deviations."""
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

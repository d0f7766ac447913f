"""How many independent samples a correlated series counts as."""

from __future__ import annotations

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from hydrodamp.arrays import FloatArray, IntArray

#: Lags are summed up to this many correlation times: A. Sokal, "Monte Carlo Methods in Statistical
#: Mechanics" (1997), doi:10.1007/978-1-4899-0319-8_6, section 3.
_TIMES = 5.0

#: Lags with fewer pairs than this share of the samples are too uncertain to sum.
_PAIRS = 0.5


def effective_samples(series: FloatArray, segment: IntArray) -> float:
    """Return the number of independent samples with the same information on a mean."""
    n = len(series)
    covariance = autocovariance(series, segment)
    if len(covariance) < 2 or not covariance[0] > 0.0:
        return float(n)
    times = 1.0 + 2.0 * np.cumsum(covariance[1:] / covariance[0])
    lags = np.arange(1, len(times) + 1)
    long_enough = np.flatnonzero(lags >= _TIMES * times)
    time = times[long_enough[0]] if len(long_enough) else times[-1]
    return float(n / min(max(time, 1.0), n))


def autocovariance(series: FloatArray, segment: IntArray) -> FloatArray:
    """Return the mean product of samples a lag apart, within segments."""
    if not len(series):
        return np.zeros(1)
    parts = np.split(series - series.mean(), np.flatnonzero(np.diff(segment)) + 1)
    lengths = np.array([len(part) for part in parts])
    lags = np.arange(lengths.max())
    pairs = np.maximum(lengths[:, None] - lags, 0).sum(axis=0)
    kept = int(np.count_nonzero(pairs >= _PAIRS * len(series)))
    products = np.zeros(len(lags))
    for part in parts:
        products[: len(part)] += _products(part)
    covariance: FloatArray = products[:kept] / pairs[:kept]
    return covariance


def _products(part: FloatArray) -> FloatArray:
    """Return the sums of products at all lags, by way of the power spectrum."""
    size = next_fast_len(2 * len(part), real=True)
    power = np.abs(rfft(part, size)) ** 2
    return np.asarray(irfft(power, size)[: len(part)], dtype=np.float64)

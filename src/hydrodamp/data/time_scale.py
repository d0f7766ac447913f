"""Time scale of a motion: the correlation time of its velocities.

With the autocovariance ``R_i(h) = ⟨ν_i(t) ν_i(t + h)⟩`` of each velocity about its mean, the
correlation time of a velocity is the first lag h at which ``R_i(h) = R_i(0)/e``; that of a motion
is the median over its velocities. It stretches with the unit of time and with √λ under Froude
similitude, so windows, blocks and gaps in its multiples suit a vehicle of any size.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray

#: Samples of a block of lags, and of a segment from which blocks are used.
_BLOCK, _LONG_SERIES = 8192, 1 << 16


def motion_time_scale(time: FloatArray, velocity: FloatArray, bounds: IntArray) -> float:
    """Return the correlation time [s] of the velocities (n, k) within segments of given bounds.

    A velocity that never moves has none; a motion without one has the median sampling step.
    """
    steps = np.concatenate([np.diff(time[start:stop]) for start, stop in bounds])
    step = float(np.median(steps)) if len(steps) else 1.0
    covariance = _early_autocovariance(velocity, bounds)
    if covariance is None:
        covariance = _autocovariance(velocity, bounds)
    scales = [_crossing(each) * step for each in covariance.T if each[0] > 0.0]
    return float(np.median(scales)) if scales else step


def _autocovariance(values: FloatArray, bounds: IntArray) -> FloatArray:
    """Return the autocovariance (lags, k) about the means of the segments, summed over them."""
    longest = int(np.diff(bounds, axis=1).max(initial=1))
    total = np.zeros((longest, values.shape[1]))
    for start, stop in bounds:
        segment = _centre(values[start:stop])
        n = stop - start
        spectrum = np.abs(np.fft.rfft(segment, _fast_length(2 * n), axis=0)) ** 2
        total[:n] += np.fft.irfft(spectrum, _fast_length(2 * n), axis=0)[:n]
    return total


def _early_autocovariance(values: FloatArray, bounds: IntArray) -> FloatArray | None:
    """Return the autocovariance at the first lags of a long series, if it falls to 1/e in these.

    A segment is correlated in blocks with itself: transforms of blocks are far faster.
    """
    if int(np.diff(bounds, axis=1).max(initial=1)) < _LONG_SERIES:
        return None
    spectrum = np.zeros((values.shape[1], _BLOCK + 1), dtype=np.complex128)
    for start, stop in bounds:
        for column, series in enumerate(_centre(values[start:stop]).T):
            padded = np.concatenate((series, np.zeros(-len(series) % _BLOCK + _BLOCK)))
            blocks = padded.reshape(-1, _BLOCK)
            first = np.fft.rfft(blocks[:-1], 2 * _BLOCK)
            both = np.fft.rfft(np.hstack((blocks[:-1], blocks[1:])))
            spectrum[column] += np.sum(first.conj() * both, axis=0)
    covariance = np.fft.irfft(spectrum, axis=1)[:, :_BLOCK].T
    falls = covariance.min(axis=0) < np.exp(-1.0) * covariance[0]
    return covariance if bool(np.all(falls | (covariance[0] <= 0.0))) else None


def _centre(values: FloatArray) -> FloatArray:
    """Return values about their means, constant columns free of rounding."""
    centred = np.asarray(values - values.mean(axis=0))
    centred[:, np.ptp(values, axis=0) == 0.0] = 0.0
    return centred


def _fast_length(n: int) -> int:
    return 1 << (int(n) - 1).bit_length()


def _crossing(covariance: FloatArray) -> float:
    """Return the first lag [samples], interpolated, at which a covariance is 1/e of its first."""
    ratio = covariance / covariance[0] - np.exp(-1.0)
    below = np.flatnonzero(ratio < 0.0)
    if not len(below):
        return float(len(covariance))
    lag = int(below[0])
    return lag - 1.0 + float(ratio[lag - 1] / (ratio[lag - 1] - ratio[lag]))

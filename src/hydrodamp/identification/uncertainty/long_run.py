"""Covariance of a sum whose parts are alike for a while: coloured noise, overlapping rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.sparse import csr_array

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.errors import MethodError
from hydrodamp.identification.uncertainty.tapered_blocks import ROUGHNESS, blocks_of, since_start

_BINS = 2048
"""Scores are gathered into about this many bins before their correlation is looked at."""

_TIMES = 5.0
"""Lags are summed up to this many correlation times: A. Sokal, "Monte Carlo Methods in
Statistical Mechanics" (1997), doi:10.1007/978-1-4899-0319-8_6, section 3."""

_FREEDOM = 0.4
"""Degrees of freedom wanted of T independent parts, over T^(2/3); Lazarus et al., section 1."""


@dataclass(frozen=True, eq=False)
class LongRun:
    """The covariance of a sum of correlated scores."""

    covariance: FloatArray
    degrees_of_freedom: float
    n_blocks: int
    block: float


def long_run(
    scores: FloatArray, segment: IntArray, time: FloatArray, block: float | None = None
) -> LongRun:
    """Return the covariance of the sum of correlated scores."""
    values = _finite(scores, len(time))
    length = block_length(values, segment, time) if block is None else block
    blocks = blocks_of(segment, time, length)
    return LongRun(
        frozen(blocks.covariance(values)), blocks.degrees_of_freedom, blocks.n, blocks.length
    )


def block_length(scores: FloatArray, segment: IntArray, time: FloatArray) -> float:
    """Return how long blocks should be."""
    values = _finite(scores, len(time))
    duration = float(since_start(segment, time)[1].sum())
    correlation = correlation_time(values, segment, time)
    freedom = max(_FREEDOM * (duration / correlation) ** (2.0 / 3.0), 1.0)
    return float(duration / (freedom * ROUGHNESS))


def correlation_time(scores: FloatArray, segment: IntArray, time: FloatArray) -> float:
    """Return the time over which scores are alike: the integral of their autocorrelation."""
    bins, width = _binned(scores, segment, time)
    size = next_fast_len(2 * max(len(part) for part in bins), real=True)
    products = sum(irfft(np.abs(rfft(part, size, axis=0)) ** 2, size, axis=0) for part in bins)
    covariance = np.asarray(products)[: size // 4 + 1]
    kept = covariance[0] > 0.0
    if not kept.any():
        return width
    correlation = np.mean(covariance[:, kept] / covariance[0, kept], axis=1)
    times = 1.0 + 2.0 * np.cumsum(correlation[1:])
    enough = np.flatnonzero(np.arange(1, len(times) + 1) >= _TIMES * times)
    last = times[enough[0]] if len(enough) else times.max(initial=1.0)
    return width * max(float(last), 1.0)


def _binned(
    scores: FloatArray, segment: IntArray, time: FloatArray
) -> tuple[list[FloatArray], float]:
    """Sum scores over bins of equal time; return them by segment, and their width."""
    since, spans = since_start(segment, time)
    number = np.unique(segment, return_inverse=True)[1]
    rows = max(len(time) - len(spans), 1)
    width = float(spans.sum()) / min(rows, _BINS)
    place = np.floor(since / width + 1e-6).astype(np.int64)
    counts = np.zeros(len(spans), dtype=np.int64)
    np.maximum.at(counts, number, place + 1)
    ends = np.cumsum(counts)
    whole = (ends - counts)[number] + place
    gather = csr_array(
        (np.ones(len(time)), (whole, np.arange(len(time)))), shape=(int(ends[-1]), len(time))
    )
    return np.split(np.asarray(gather @ scores), ends[:-1]), width


def _finite(scores: FloatArray, n_rows: int) -> FloatArray:
    if scores.ndim != 2 or len(scores) != n_rows:
        raise MethodError(f"`scores` must have shape ({n_rows}, p); got {scores.shape}")
    if not np.all(np.isfinite(scores)):
        row = int(np.flatnonzero(~np.isfinite(scores).all(axis=1))[0])
        raise MethodError(f"`scores` must be finite; row {row} is not")
    return scores

"""Hashes of short runs of velocities, by which data of one recording are recognised."""

from __future__ import annotations

import numpy as np

from hydrodamp.data.log import Log

#: Samples under one hash: fewer can be equal by chance where sensors have a coarse resolution.
DIGEST_SAMPLES = 8

#: Hashes of a log that its fits store, evenly spaced, and one more for the end of each segment.
MAX_DIGESTS = 256


#: Odd multiplier of the hash, 2^64 over the golden ratio.
_MULTIPLIER = np.uint64(0x9E3779B97F4A7C15)


def velocity_digests(log: Log, stride: int = 1) -> list[np.ndarray]:
    """Return by segment the hashes of the runs that begin at every ``stride``-th sample."""
    weights = np.cumprod(np.full(DIGEST_SAMPLES, _MULTIPLIER))
    samples = _mix(_mix(log.velocity.view(np.uint64)) @ weights[: log.velocity.shape[1]])
    digests = []
    for start, stop in log.bounds.tolist():
        last = stop - DIGEST_SAMPLES
        rows = np.append(np.arange(start, last, stride), last)
        runs = np.add.outer(rows[rows >= start], np.arange(DIGEST_SAMPLES))
        digests.append(_mix(samples[runs] @ weights))
    return digests


def _mix(values: np.ndarray) -> np.ndarray:
    """Return a 64-bit hash of each integer."""
    values = values * _MULTIPLIER
    return np.asarray((values ^ values >> np.uint64(32)) * _MULTIPLIER)

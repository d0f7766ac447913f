"""Delete-one-block jackknife of coefficients.

``Cov = (n − 1)/n Σ_b (κ₍b₎ − κ̄)(κ₍b₎ − κ̄)ᵀ`` of the n estimates κ₍b₎ without block b. It allows for
any dependence within a block: R. G. Miller (1974), doi:10.1093/biomet/61.1.1.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.fit import Uncertainty

#: Blocks below which a covariance is not estimated, and blocks at most.
MIN_BLOCKS, MAX_BLOCKS = 4, 32


def leave_one_out_sums(values: FloatArray) -> FloatArray:
    """Return the sums over the first axis without each element, free of cancellation."""
    before, after = np.cumsum(values, axis=0), np.cumsum(values[::-1], axis=0)[::-1]
    return np.concatenate([after[1:2], before[:-2] + after[2:], before[-2:-1]])


def jackknife(
    estimates: FloatArray, duration: float, leverage: FloatArray | None = None
) -> Uncertainty:
    """Return the uncertainty of estimates (n, p) without one of n blocks of a duration [s] each."""
    n = len(estimates)
    deviations = estimates - np.mean(estimates, axis=0)
    return Uncertainty(
        covariance=(n - 1) / n * (deviations.T @ deviations),
        degrees_of_freedom=n - 1,
        method="the delete-one-block jackknife",
        block=duration / n,
        n_blocks=n,
        leverage=leverage,
    )

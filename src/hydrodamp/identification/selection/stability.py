"""How often a column is chosen when half of the data is left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.selection.error_reduction import forward


def frequencies(
    blocks: FloatArray, most: int, pairs: int, seed: int = 0, first: Sequence[int] = ()
) -> FloatArray:
    """Return the share of half samples on which each column is chosen."""
    rng = np.random.default_rng(seed)
    count = np.zeros(blocks.shape[1] - 1)
    half = len(blocks) // 2
    for _ in range(pairs):
        drawn = rng.permutation(len(blocks))
        for part in (drawn[:half], drawn[half:]):
            count[forward(blocks[part].sum(axis=0), most, first).order] += 1.0
    return count / (2.0 * pairs)

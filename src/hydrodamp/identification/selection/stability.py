"""How often a column is chosen when half of the data is left out.

Stability selection: N. Meinshausen and P. Bühlmann (2010),
doi:10.1111/j.1467-9868.2010.00740.x, with complementary pairs of halves: R. D. Shah and
R. J. Samworth (2013), doi:10.1111/j.1467-9868.2011.01034.x. What is drawn are whole
blocks, for neighbouring samples are alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.selection.error_reduction import forward


def frequencies(
    blocks: FloatArray, most: int, pairs: int, seed: int = 0, first: Sequence[int] = ()
) -> FloatArray:
    """Return the share of half samples on which each column is chosen.

    Parameters
    ----------
    blocks : ndarray, shape (n_blocks, p + 1, p + 1)
        Normal matrix of each block, the target last; at least two blocks.
    most : int
        How many columns are chosen each time.
    pairs : int
        How many pairs of complementary halves are drawn.
    seed : int
        Of the draw.
    first : sequence of int
        Columns that are always taken.

    Returns
    -------
    share : ndarray, shape (p,)
        Between zero and one.
    """
    rng = np.random.default_rng(seed)
    count = np.zeros(blocks.shape[1] - 1)
    half = len(blocks) // 2
    for _ in range(pairs):
        drawn = rng.permutation(len(blocks))
        for part in (drawn[:half], drawn[half:]):
            count[forward(blocks[part].sum(axis=0), most, first).order] += 1.0
    return count / (2.0 * pairs)

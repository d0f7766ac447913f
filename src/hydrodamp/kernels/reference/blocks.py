"""Rows of a regression that needs no acceleration, from two neighbouring blocks of time.

The steps M (nu_{k+1} - nu_k) = h (f + K xi) are weighted with a hat, which rises over the
first block and falls over the second, and summed: y_i = kappa_i . phi on each axis. A
hat's slope is a constant on each block, so momentum enters by its mean over either
block: single readings, and their noise, do not. The weight of a step is the hat's at
mid-step, so data that satisfy the steps satisfy the rows exactly, on any clock.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.kernels.arguments import check_samples, floats, positive
from hydrodamp.kernels.entries import Entries
from hydrodamp.kernels.fitting import fitting
from hydrodamp.kernels.inputs import Sample
from hydrodamp.kernels.plant import Plant
from hydrodamp.kernels.recursion import block_size
from hydrodamp.kernels.reference.identifier import Steps, steps_of


def block_step(
    plant: Plant,
    entries: Entries,
    length: float,
    block: FloatArray,
    previous: Sample,
    current: Sample,
) -> tuple[FloatArray, FloatArray | None]:
    """Add the step from the previous sample to the current one to a block.

    Parameters
    ----------
    plant : Plant
        Mass matrix, free axes, terms.
    entries : Entries
        Which coefficients are known.
    length : float
        Of a block [s], rounded to whole steps.
    block : ndarray, shape (2 + 3 (n_terms + 6),)
        The block under way; zero at the start of a segment. Its clock [s], whether
        another went before, then sum, first moment and the half that has risen.
    previous, current : Sample
        The samples at both ends of the step.

    Returns
    -------
    block : ndarray
        The block after it, a new array.
    row : ndarray, shape (n_terms + 6,) or None
        Where that fills a second block: the terms, and behind them what they are to
        explain on each axis, momentum [N s] and angular momentum [N m s].

    Raises
    ------
    ProblemError
        If a shape does not fit the plant.
    """
    fitting(plant, entries, np.zeros(entries.n))
    positive(length, "length")
    block = floats(block, (block_size(plant.n_terms),), "block")
    check_samples(plant, previous, current)
    return added(entries, length, block, steps_of(plant, previous, current), 0)


def added(
    entries: Entries, length: float, block: FloatArray, steps: Steps, k: int
) -> tuple[FloatArray, FloatArray | None]:
    """Add one step of a record to a block.

    Parameters
    ----------
    entries, length, block
        See :func:`block_step`.
    steps : Steps
        The record turned into steps.
    k : int
        Which of them.

    Returns
    -------
    block, row
        See :func:`block_step`.
    """
    h, xi = float(steps.h[k]), steps.xi[k]
    part = np.concatenate([h * xi, steps.gain[k] - h * (steps.forcing[k] + xi @ entries.known)])
    elapsed, has_risen = block[0] + h, block[1] > 0.0
    total, moment, risen = block[2:].reshape(3, -1)
    total, moment = total + part, moment + (block[0] + h / 2.0) * part
    if elapsed + h / 2.0 < length:
        return np.concatenate([[elapsed, block[1]], total, moment, risen]), None
    rising, zero = moment / elapsed, np.zeros_like(total)
    row = risen + (total - rising) if has_risen else None
    return np.concatenate([[0.0, 1.0], zero, zero, rising]), row

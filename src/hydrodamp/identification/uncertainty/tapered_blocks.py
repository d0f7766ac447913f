"""Overlapping blocks of time that fade at both ends."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import MethodError

ROUGHNESS = 0.5866
"""Integral of the squared lag window of a half sine, over the length of a block: a duration
over this and the length is the number of degrees of freedom."""

_OVERLAP = 8
"""Blocks that cover an instant."""

_LEAST_LEFT = 0.1
"""A direction of which the fit took more than the rest of this is taken to have lost so much."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """Overlapping blocks of time that fade at both ends, none across a join."""

    weights: csr_array[np.float64, tuple[int, int]]
    length: float
    n: int

    def covariance(self, scores: FloatArray) -> FloatArray:
        """Return the covariance of the sum of all scores."""
        sums = np.asarray(self.weights @ scores)
        covariance: FloatArray = sums.T @ sums
        return covariance

    @property
    def degrees_of_freedom(self) -> float:
        """How many independent blocks there are: (tr G)^2 / tr G^2 with their overlaps G."""
        overlaps = self.weights @ self.weights.T
        return float(overlaps.diagonal().sum() ** 2 / (overlaps.multiply(overlaps)).sum())

    def taken(self, directions: FloatArray) -> FloatArray:
        """Return what a fit takes from the variance of its own scores."""
        pointer, place, value = self.weights.indptr, self.weights.indices, self.weights.data
        taken = np.zeros((directions.shape[1],) * 2)
        for first, last in itertools.pairwise(pointer.tolist()):
            here = directions[place[first:last]]
            share = here.T @ (here * value[first:last, None])
            taken += share @ share
        return taken

    def restoring(self, directions: FloatArray) -> FloatArray:
        """Return the matrix that gives the scores of residuals the variance of the errors'."""
        lost, axes = np.linalg.eigh(self.taken(directions))
        restoring: FloatArray = (axes / np.sqrt(np.maximum(1.0 - lost, _LEAST_LEFT))) @ axes.T
        return restoring


def blocks_of(segment: IntArray, time: FloatArray, length: float) -> Blocks:
    """Divide rows into overlapping blocks with half-sine weights."""
    if not length > 0.0:
        raise MethodError(f"`block` must be positive [s]; got {length}")
    hop = length / _OVERLAP
    since, spans = since_start(segment, time)
    numbers = np.unique(segment, return_inverse=True)[1]
    count = np.floor(spans / hop).astype(np.int64) + _OVERLAP
    base = np.concatenate([[0], np.cumsum(count)[:-1]])[numbers]
    latest = np.floor(since / hop)
    turn = np.arange(_OVERLAP)
    phase = (since / hop - latest)[:, None] + turn
    weight = np.sin(np.pi * phase / _OVERLAP) * np.sqrt(2.0 / _OVERLAP)
    block = (base + latest.astype(np.int64))[:, None] + (_OVERLAP - 1 - turn)
    row = np.repeat(np.arange(len(time)), _OVERLAP)
    shape = (int(count.sum()), len(time))
    weights = csr_array((weight.ravel(), (block.ravel(), row)), shape=shape)
    return Blocks(weights, float(length), max(round(float(spans.sum()) / length), 1))


def since_start(segment: IntArray, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return each row's time since its segment began, and how long each segment is."""
    _check(segment, time)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(segment)) + 1])
    lengths = np.diff(np.append(starts, len(time)))
    since = time - np.repeat(time[starts], lengths)
    spans = since[starts + lengths - 1]
    step = spans.sum() / max(len(time) - len(starts), 1) or 1.0
    return since, spans + step


def _check(segment: IntArray, time: FloatArray) -> None:
    if not len(time) or len(segment) != len(time):
        raise MethodError(
            "`segment` and `time` need one entry a row and at least one row; got "
            f"{len(segment)} and {len(time)}"
        )

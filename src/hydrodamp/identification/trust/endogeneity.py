"""Whether the regressors are tied to the noise: the test of Durbin, Wu and Hausman."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import fdtrc

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.rows.equations import Rows
from hydrodamp.identification.rows.instruments import ROUNDING, around, without
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.identification.uncertainty.long_run import correlation_time

_PER_DIRECTION = 5
"""Stretches for each direction tested: with fewer, only those directions of the columns
are tested that are foretold worst."""

_FORETOLD = 1e-3
"""Directions are left out of which a smaller share than this is not foretold."""

_LAGS = 3.0
"""Least length of a stretch, in lags."""

_TIMES = 5.0
"""Least length of a stretch, in correlation times of the products."""


@dataclass(frozen=True)
class Endogeneity:
    """Whether, and how far, a regression is biased by noise in its regressors."""

    p: float
    shift: float


def endogeneity(
    rows: Rows, columns: FloatArray, controls: FloatArray, target: FloatArray, lag: float
) -> Endogeneity | None:
    """Test whether regressors are tied to the noise of a regression."""
    every = np.hstack([columns, controls])
    near, known = around(rows, every, lag)
    if np.count_nonzero(known) <= near.shape[1]:
        return None
    here, every, near = columns[known], every[known], near[known]
    left = without(target[known], every)
    directions = _directions(without(without(here, near), every), here)
    p = _hotelling(_scores(rows.taken(np.flatnonzero(known)), directions * left[:, None], lag))
    return None if p is None else Endogeneity(p, _shift(every, near, target[known]))


def _directions(surprise: FloatArray, columns: FloatArray) -> FloatArray:
    """Return unit combinations of what was not foretold, the largest share first."""
    length = np.linalg.norm(columns, axis=0)
    scaled = surprise / np.where(length > 0.0, length, 1.0)
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    kept: FloatArray = left[:, singular > _FORETOLD]
    return kept


def _scores(rows: Rows, products: FloatArray, lag: float) -> FloatArray:
    """Sum products over stretches, of as many directions as there are stretches for."""
    alike = correlation_time(products - products.mean(axis=0), rows.segment, rows.time)
    length = max(_LAGS * lag, _TIMES * alike)
    number = _stretches(rows, length)
    scores = np.zeros((number[-1] + 1, products.shape[1]))
    np.add.at(scores, number, products)
    return scores[:, : len(scores) // _PER_DIRECTION]


def _stretches(rows: Rows, length: float) -> IntArray:
    """Return the number of the stretch of time that each row is in."""
    number = np.zeros(rows.n, dtype=np.int64)
    count = 0
    for segment in np.unique(rows.segment):
        here = rows.segment == segment
        since = rows.time[here] - rows.time[here][0]
        pieces = max(int(since[-1] / length), 1)
        width = max(since[-1], ROUNDING) / pieces
        number[here] = count + np.minimum((since / width).astype(np.int64), pieces - 1)
        count += pieces
    return number


def _hotelling(scores: FloatArray) -> float | None:
    """Return the p-value of the mean of some vectors being zero."""
    count, size = scores.shape
    if not size:
        return None
    mean = scores.mean(axis=0)
    spread = np.cov(scores, rowvar=False).reshape(size, size)
    squared = count * float(mean @ np.linalg.pinv(spread, hermitian=True) @ mean)
    ratio = squared * (count - size) / (size * (count - 1.0))
    return float(fdtrc(size, count - size, max(ratio, 0.0)))


def _shift(every: FloatArray, near: FloatArray, target: FloatArray) -> float:
    """Compare what least squares explains with what instruments let the columns explain."""
    names = range(every.shape[1])
    direct = spanned(every, names)
    foretold = spanned(every - without(every, near), names)
    plain = every @ (direct.coefficients @ (direct.directions.T @ target))
    careful = every @ (foretold.coefficients @ (foretold.directions.T @ target))
    size = float(np.linalg.norm(plain))
    return float(np.linalg.norm(careful - plain)) / size if size > 0.0 else 0.0

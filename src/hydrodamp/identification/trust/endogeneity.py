"""Whether the regressors are tied to the noise: the test of Durbin, Wu and Hausman.

Noise in a regressor is a part of it that the rows before and after, which share no sample
with a row, do not foretell. Least squares is unbiased only if what they do not foretell
has nothing to do with what is left over (J. A. Hausman, "Specification Tests in
Econometrics", 1978, doi:10.2307/1913827, in the form of the score; R. Davidson and J. G.
MacKinnon, "Econometric Theory and Methods", 2004, section 8.7). The products of both are
summed over stretches of time, and the sums are asked whether their mean is zero
(Hotelling's T²): errors may be alike within a stretch. Rows on both sides are taken,
because a push on the vehicle shows in what comes after, and what both sides do not foretell
has little to do with it.

A long log finds a bias that is too small to matter. So the test comes with its size: how
far the wrench that the terms explain moves when only what is foretold counts.
"""

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
    """Whether, and how far, a regression is biased by noise in its regressors.

    Attributes
    ----------
    p : float
        The probability that exact regressors would look as tied to the noise as these.
    shift : float
        Root mean square by which the explained wrench moves when only what is foretold
        of the regressors counts, over that of the wrench.
    """

    p: float
    shift: float


def endogeneity(
    rows: Rows, columns: FloatArray, controls: FloatArray, target: FloatArray, lag: float
) -> Endogeneity | None:
    """Test whether regressors are tied to the noise of a regression.

    Parameters
    ----------
    rows : Rows
        Say the segment and the time of each row.
    columns : ndarray, shape (m, k)
        Regressors in question.
    controls : ndarray, shape (m, c)
        Further columns that explain the target, so that misfit is not taken for noise.
    target : ndarray, shape (m,)
        What is regressed [N, N m].
    lag : float
        How far before and after the instruments are [s], and twice that: at least as long
        as a row's test function, and longer than the noise is correlated.

    Returns
    -------
    endogeneity : Endogeneity or None
        None where the log is too short to tell, or there is nothing to test.

    Examples
    --------
    >>> from hydrodamp.basis.basis import Basis
    >>> rng, time = np.random.default_rng(0), np.arange(4000.0)
    >>> true, noise = np.sin(0.05 * time)[:, None], rng.normal(size=(4000, 1))
    >>> target = true[:, 0] + 0.1 * rng.normal(size=4000)
    >>> rows = Rows(Basis(()), np.zeros((4000, 0)), np.zeros((4000, 6)), 0 * time.astype(int), time)
    >>> found = endogeneity(rows, true + noise, np.zeros((4000, 0)), target, lag=3.0)
    >>> found.p < 0.001, found.shift > 1.0
    (True, True)
    """
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

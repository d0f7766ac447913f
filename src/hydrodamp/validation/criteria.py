"""Information criteria on effective samples: does a further coefficient earn its place."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import MethodError, ModelError, did_you_mean
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.residuals import lagged_products, left_over
from hydrodamp.identification.rows import Rows
from hydrodamp.identification.triangle import Triangle, solve_axis
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel

#: Akaike's, the same corrected for few samples, and Schwarz's.
CRITERIA = ("aic", "aicc", "bic")

# Lags are summed up to this many correlation times: A. Sokal, "Monte Carlo Methods in Statistical
# Mechanics" (1997), doi:10.1007/978-1-4899-0319-8_6, section 3.
_TIMES = 5.0

# Lags with fewer pairs than this share of the samples are too uncertain to sum.
_PAIRS = 0.5

#: Residual below which a fit is exact, as a share of the target.
_SMALLEST = np.finfo(np.float64).eps


@dataclass(frozen=True)
class Criterion:
    """What the criteria say of one fit; lower is better, only differences count."""

    model: str
    method: str
    rank_by_axis: tuple[int, ...]
    aic: float | None
    aicc: float | None
    bic: float | None

    @property
    def rank(self) -> int:
        """Parameters counted, summed over axes."""
        return sum(self.rank_by_axis)


@dataclass(frozen=True)
class Criteria:
    """Criteria of several fits on the same rows.

    Attributes
    ----------
    rows : tuple of Criterion
        In the order of the fits.
    n_rows : int
        Rows of the regression.
    n_effective : dict of str to float
        How many independent ones they count as, by axis.
    """

    rows: tuple[Criterion, ...]
    n_rows: int
    n_effective: dict[str, float]

    def best(self, criterion: str = "aicc") -> Criterion:
        """Return the fit with the lowest value of a criterion.

        Parameters
        ----------
        criterion : {"aicc", "aic", "bic"}
            Which one.

        Returns
        -------
        row : Criterion
            The first of equal ones.

        Raises
        ------
        MethodError
            If the criterion is unknown, or no fit has a finite value of it.
        """
        if criterion not in CRITERIA:
            near = did_you_mean(criterion, CRITERIA)
            raise MethodError(f"unknown criterion '{criterion}'.{near} Known: {' '.join(CRITERIA)}")
        ranked = [row for row in self.rows if math.isfinite(_value(row, criterion))]
        if not ranked:
            raise MethodError(
                f"no fit has a finite {criterion}: nothing was identified, or every model has "
                "more coefficients than effective samples. Give a longer log or smaller models."
            )
        return min(ranked, key=lambda row: _value(row, criterion))


def criteria(rows: Rows, fits: Iterable[Fit]) -> Criteria:
    """Compute AIC, AICc and BIC of several fits from the residuals of the same rows.

    Gaussian residuals, coupled across axes: with n of effective samples, twice the
    negative log-likelihood is ``Σ nᵢ log σᵢ² + n̄ log det C`` up to a constant, where C is
    the correlation across axes and n̄ the mean of nᵢ. Each axis counts its rank and
    one variance.

    Parameters
    ----------
    rows : Rows
        The regression; the same for all fits, such as ``Differenced().rows(problem)``.
    fits : iterable of Fit
        By any methods. For one that does not minimise the residuals the criteria say
        how likely its own numbers are.

    Returns
    -------
    criteria : Criteria
        Axes whose target is zero throughout do not count. None of this sees whether
        a replay diverges.

    Raises
    ------
    ModelError
        If a fit has terms that are not among the columns of the rows.
    MethodError
        If there is no fit.
    """
    asked = tuple(fits)
    if not asked:
        raise MethodError("criteria compare fits; none was given")
    free = np.flatnonzero(np.any(rows.target != 0.0, axis=0))
    if not len(free):
        raise MethodError("the rows have nothing to explain: there is none, or all targets are 0")
    target = rows.target[:, free]
    left = [_residual(rows, fit.damping)[:, free] if fit.status.usable else None for fit in asked]
    count = _effective(rows, [rest for rest in left if rest is not None], target)
    triangle, scale = rows.triangle(), np.sqrt(np.mean(target**2, axis=0))
    found = [
        _criterion(fit, _ranks(triangle, fit.model, free), _deviance(rest, scale, count), count)
        for fit, rest in zip(asked, left, strict=True)
    ]
    by_axis = dict(zip((AXES[axis] for axis in free), count.tolist(), strict=True))
    return Criteria(tuple(found), rows.n, by_axis)


def _residual(rows: Rows, damping: Damping) -> FloatArray:
    """Return what the coefficients leave over of the target, force [N] and moment [N m]."""
    model = damping.model
    missing = [str(term) for term in model.basis if term not in rows.basis]
    if missing:
        raise ModelError(
            f"model '{model.key}' has terms these rows have no column for: {' '.join(missing)}. "
            "Name the model when the log is prepared."
        )
    return left_over(rows, damping)


def _log_sizes(rest: FloatArray, scale: FloatArray) -> tuple[FloatArray, float]:
    """Return ``log σᵢ²`` of each axis and ``log det C``."""
    size = np.maximum(np.sqrt(np.mean(rest**2, axis=0)), _SMALLEST * scale)
    unit = rest / size
    spectrum = np.linalg.eigvalsh(unit.T @ unit / len(unit))
    return 2.0 * np.log(size), float(np.log(np.maximum(spectrum, _SMALLEST)).sum())


def _deviance(rest: FloatArray | None, scale: FloatArray, count: FloatArray) -> float | None:
    if rest is None:
        return None
    sizes, coupling = _log_sizes(rest, scale)
    return float(count @ sizes + count.mean() * coupling)


def _effective(rows: Rows, left: Sequence[FloatArray], target: FloatArray) -> FloatArray:
    """Return the effective samples of each axis, of the smallest residuals there are."""
    scale = np.sqrt(np.mean(target**2, axis=0))
    even = np.full(target.shape[1], float(rows.n))
    smallest = min(left, key=lambda rest: _deviance(rest, scale, even) or 0.0, default=target)
    return np.array([effective_samples(column, rows.segment) for column in smallest.T])


def _ranks(triangle: Triangle, model: DampingModel, free: IntArray) -> tuple[int, ...]:
    return tuple(solve_axis(triangle, model.terms[axis], axis).span.rank for axis in free.tolist())


def _criterion(
    fit: Fit, ranks: tuple[int, ...], deviance: float | None, count: FloatArray
) -> Criterion:
    if deviance is None:
        return Criterion(fit.model.key, fit.method, ranks, None, None, None)
    parameters = np.array(ranks) + 1.0
    spare = count - parameters - 1.0
    corrected = np.where(
        spare > 0.0, parameters * count / np.where(spare > 0.0, spare, 1.0), np.inf
    )
    return Criterion(
        model=fit.model.key,
        method=fit.method,
        rank_by_axis=ranks,
        aic=deviance + 2.0 * float(parameters.sum()),
        aicc=deviance + 2.0 * float(corrected.sum()),
        bic=deviance + float(parameters @ np.log(count)),
    )


def _value(row: Criterion, criterion: str) -> float:
    value: float | None = getattr(row, criterion)
    return math.inf if value is None else value


def effective_samples(series: FloatArray, segment: IntArray) -> float:
    """Return the number of independent samples with the same information on a mean."""
    n = len(series)
    if n < 2:
        return float(n)
    lengths = np.bincount(segment - segment[0])
    pairs = np.maximum(lengths[:, None] - np.arange(lengths.max()), 0).sum(axis=0)
    last = int(np.count_nonzero(pairs >= _PAIRS * n)) - 1
    centred, lags, time = series - series.mean(), 0, 1.0
    while lags < last:
        lags = min(max(2 * lags, 32), last)
        count, products = lagged_products(centred, segment, lags)
        if not products[0] > 0.0:
            break
        covariance = products / count
        times = 1.0 + 2.0 * np.cumsum(covariance[1:] / covariance[0])
        enough = np.flatnonzero(np.arange(1, lags + 1) >= _TIMES * times)
        time = float(times[enough[0]] if len(enough) else times[-1])
        if len(enough):
            break
    return n / min(max(time, 1.0), n)

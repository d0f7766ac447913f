"""Information criteria on effective samples: does a further coefficient earn its place."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.covariance import Bins
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.residuals import left_over
from hydrodamp.identification.rows import Rows
from hydrodamp.identification.triangle import solve_axis

#: Akaike's, the same corrected for few samples, and Schwarz's.
CRITERIA = ("aic", "aicc", "bic")

#: Residual below which a fit is exact, as a share of the target.
_SMALLEST = np.finfo(np.float64).eps


@dataclass(frozen=True)
class Criterion:
    """What the criteria say of one fit; lower is better, only differences count."""

    model: str
    method: str
    aic: float | None
    aicc: float | None
    bic: float | None


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
    TermError
        If a fit has terms that are not among the columns of the rows.
    MethodError
        If the rows have nothing to explain.
    """
    asked = tuple(fits)
    free = np.flatnonzero(np.any(rows.target != 0.0, axis=0))
    if not len(free):
        raise MethodError("the rows have nothing to explain: there is none, or all targets are 0")
    target = rows.target[:, free]
    scale, even = np.sqrt(np.mean(target**2, axis=0)), np.full(len(free), float(rows.n))
    left = [left_over(rows, fit.damping)[:, free] if fit.status.usable else None for fit in asked]
    smallest = min(
        (rest for rest in left if rest is not None),
        key=lambda rest: _deviance(rest, scale, even),
        default=target,
    )
    bins = Bins.of(rows.segment, rows.time, rows.n)
    sums = bins.sums(smallest - smallest.mean(axis=0))
    count = bins.duration / np.array([bins.correlation_time(one[:, None]) for one in sums.T])
    triangle, found = rows.triangle(), []
    for fit, rest in zip(asked, left, strict=True):
        values: tuple[float | None, ...] = (None, None, None)
        if rest is not None:
            ranks = [solve_axis(triangle, fit.model.terms[k], k).span.rank for k in free.tolist()]
            values = _criteria(_deviance(rest, scale, count), np.array(ranks) + 1.0, count)
        found.append(Criterion(fit.model.key, fit.method, *values))
    by_axis = dict(zip((AXES[axis] for axis in free), count.tolist(), strict=True))
    return Criteria(tuple(found), rows.n, by_axis)


def _deviance(rest: FloatArray, scale: FloatArray, count: FloatArray) -> float:
    """Return ``Σ nᵢ log σᵢ² + n̄ log det C``."""
    size = np.maximum(np.sqrt(np.mean(rest**2, axis=0)), _SMALLEST * scale)
    unit = rest / size
    spectrum = np.linalg.eigvalsh(unit.T @ unit / len(unit))
    coupling = np.log(np.maximum(spectrum, _SMALLEST)).sum()
    return float(count @ (2.0 * np.log(size)) + count.mean() * coupling)


def _criteria(
    deviance: float, parameters: FloatArray, count: FloatArray
) -> tuple[float, float, float]:
    """Return AIC, AICc and BIC."""
    spare = count - parameters - 1.0
    corrected = float((parameters * count / spare).sum()) if np.all(spare > 0.0) else math.inf
    return (
        deviance + 2.0 * float(parameters.sum()),
        deviance + 2.0 * corrected,
        deviance + float(parameters @ np.log(count)),
    )

"""Residual analysis of a weak-form regression: autocorrelation and share of outliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, mad_std
from hydrodamp.basis.term import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression_rows import Rows, residuals
from hydrodamp.identification.weak_form import WeakRegression, select_support
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem

#: Robust standard deviations beyond which a residual is an outlier: 6 in 100 000 of normal ones.
OUTLIER_THRESHOLD = 4.0

#: Share of outliers [1] that is reported: more than 100 times that of normal residuals.
MAX_OUTLIER_SHARE = 0.01

# Quantile of |√n r₁| [1] for white residuals: two-sided test at the 1 % level.
_WHITE_QUANTILE = 2.58

# Lags of an autocorrelation at most, and residuals of a segment for each lag.
_MAX_LAGS, _RESIDUALS_PER_LAG = 40, 4


def diagnose(problem: Problem, damping: Damping) -> tuple[str, ...]:
    """Test the residuals of a damping for autocorrelation and outliers.

    Residuals are those of the weak form with adjacent test functions that share no sample, so the
    test functions do not correlate them.

    Parameters
    ----------
    problem : Problem
        Vehicle and log, prepared for the terms of the damping.
    damping : Damping
        Damping whose residuals are tested.

    Returns
    -------
    remarks : tuple of str
        One sentence for significant autocorrelation, one for outliers.

    Examples
    --------
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign = reenact(duration=60.0)
    >>> problem = prepare(campaign.vehicle, campaign.train, catalog["fossen"])
    >>> print(diagnose(problem, Damping(catalog["fossen"], [-1.0] * 12))[0][:35])
    Residuals are autocorrelated on X (
    """
    free = damping.model.restricted_to(problem.vehicle.axes)
    rows, length = residual_rows(problem)
    correlated, outlying = [], []
    for axis, values in _axis_residuals(rows, Damping(free, damping.onto(free))).items():
        first = float(autocorrelation(values, rows.segment, 1)[1])
        if abs(first) * np.sqrt(rows.n) > _WHITE_QUANTILE:
            correlated.append(f"{axis} ({first:.2f})")
        if (share := outlier_share(values)) > MAX_OUTLIER_SHARE:
            outlying.append(f"{axis} ({100.0 * share:.1f} %)")
    remarks = []
    if correlated:
        remarks.append(
            f"Residuals are autocorrelated on {', '.join(correlated)} at a lag of {length:.2g} s: "
            "confidence intervals for white residuals would be too narrow."
        )
    if outlying:
        remarks.append(
            f"Many residuals are outliers, beyond {OUTLIER_THRESHOLD:g} robust standard "
            f"deviations, on {', '.join(outlying)}: the model lacks terms, or the log has errors."
        )
    return tuple(remarks)


def _axis_residuals(rows: Rows, damping: Damping) -> dict[str, FloatArray]:
    """Return the residuals of each axis with terms."""
    columns = zip(AXES, damping.model.terms, residuals(rows, damping).T, strict=True)
    return {axis: values for axis, terms, values in columns if terms}


def residual_rows(problem: Problem) -> tuple[Rows, float]:
    """Return weak-form rows that share no sample, and their distance [s]."""
    length = select_support(problem)[0]
    return WeakRegression(length, overlap=1, windows=()).rows(problem), length


def outlier_share(series: FloatArray) -> float:
    """Return the share of residuals beyond four robust standard deviations."""
    if not len(series):
        return 0.0
    deviations = series - np.median(series)
    outlying = np.abs(deviations) > OUTLIER_THRESHOLD * mad_std(deviations)
    return float(np.mean(outlying))


def autocorrelations(
    problem: Problem, dampings: Sequence[Damping]
) -> tuple[FloatArray, float, list[dict[str, FloatArray]]]:
    """Return lags [s], the 95 % bound of white residuals, and the autocorrelation of each damping.

    Autocorrelations are by axis, for the axes with terms.
    """
    rows, length = residual_rows(problem)
    longest = int(np.bincount(rows.segment).max(initial=0))
    if longest < _RESIDUALS_PER_LAG:
        raise MethodError(
            f"at least {_RESIDUALS_PER_LAG} residuals of one segment are needed for a "
            f"correlation; got {longest}: give a longer log"
        )
    n_lags = min(_MAX_LAGS, longest // _RESIDUALS_PER_LAG)
    correlations = [
        {
            axis: autocorrelation(values, rows.segment, n_lags)
            for axis, values in _axis_residuals(rows, damping).items()
        }
        for damping in dampings
    ]
    return length * np.arange(n_lags + 1.0), 1.96 / float(np.sqrt(rows.n)), correlations


def autocorrelation(series: FloatArray, segment: IntArray, max_lag: int) -> FloatArray:
    """Return the autocorrelation at lags 0 to ``max_lag``, within segments."""
    products = np.zeros(max_lag + 1)
    for values in np.split(series, np.flatnonzero(np.diff(segment)) + 1):
        for lag in range(min(max_lag + 1, len(values))):
            products[lag] += values[lag:] @ values[: len(values) - lag]
    return np.asarray(products / (products[0] or 1.0))

"""What a regression leaves over: white or correlated in time, and how many outliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, mad_std
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression_rows import Rows, residuals
from hydrodamp.identification.weak_form import WeakRegression, select_support
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem

#: Robust standard deviations from which a residual is an outlier: 6 in 100 000 of normal ones.
OUTLIER_THRESHOLD = 4.0

#: Share of outliers worth a sentence: more than 100 times that of normal residuals.
MAX_OUTLIER_SHARE = 0.01

# Neighbours of white residuals are less correlated, but for 1 % of the series.
_WHITE = 2.58

# Lags of a drawn correlation at most, and the share of a segment that they reach to.
_LAGS, _SHARE = 40, 4


def diagnose(problem: Problem, damping: Damping) -> tuple[str, ...]:
    """Examine what a damping leaves of a log.

    Residuals are those of the weak form under test functions that follow each other and
    share no sample, so that no correlation is of their making.

    Parameters
    ----------
    problem : Problem
        Vehicle and log, prepared for the terms of the damping.
    damping : Damping
        Whose residuals to examine.

    Returns
    -------
    remarks : tuple of str
        What to know and to do, a sentence a kind of trouble: correlation, outliers.

    Examples
    --------
    >>> from hydrodamp.models.catalog import catalog
    >>> from hydrodamp.simulation.campaign.reenact import reenact
    >>> from hydrodamp.simulation.problem import prepare
    >>> campaign = reenact(duration=60.0)
    >>> problem = prepare(campaign.vehicle, campaign.train, catalog["fossen"])
    >>> print(diagnose(problem, Damping(catalog["fossen"], [-1.0] * 12))[0][:39])
    Residuals are correlated in time on X (
    """
    free = damping.model.restricted_to(problem.vehicle.axes)
    rows, length = residual_rows(problem)
    left, coloured, spiked = residuals(rows, Damping(free, damping.onto(free))), [], []
    for axis, terms, values in zip(AXES, free.terms, left.T, strict=True):
        near = float(autocorrelation(values, rows.segment, 1)[1])
        if terms and abs(near) * np.sqrt(rows.n) > _WHITE:
            coloured.append(f"{axis} ({near:.2f})")
        if terms and (share := outlier_share(values)) > MAX_OUTLIER_SHARE:
            spiked.append(f"{axis} ({100.0 * share:.1f} %)")
    white = (
        f"Residuals are correlated in time on {', '.join(coloured)}, those {length:.2g} s apart: "
        "intervals for white residuals would be wrong."
    )
    outlying = (
        f"Many residuals are beyond {OUTLIER_THRESHOLD:g} robust standard deviations on "
        f"{', '.join(spiked)}: what the model lacks shows there, or what the log has wrong."
    )
    return (*([white] if coloured else []), *([outlying] if spiked else []))


def residual_rows(problem: Problem) -> tuple[Rows, float]:
    """Return rows of the weak form that share no sample, and how far apart they are [s]."""
    length = select_support(problem)[0]
    return WeakRegression(length, overlap=1, windows=()).rows(problem), length


def outlier_share(series: FloatArray) -> float:
    """Return the share of residuals beyond four robust standard deviations."""
    if not len(series):
        return 0.0
    distance = np.abs(series - np.median(series))
    return float(np.mean(distance > OUTLIER_THRESHOLD * mad_std(distance)))


def autocorrelations(
    problem: Problem, dampings: Sequence[Damping]
) -> tuple[FloatArray, float, list[dict[str, FloatArray]]]:
    """Return lags [s], how large a correlation white residuals reach, and those of each damping.

    By axes of its terms. White residuals stay below at nineteen lags of twenty.
    """
    rows, length = residual_rows(problem)
    longest = int(np.bincount(rows.segment).max(initial=0))
    if longest < _SHARE:
        raise MethodError(
            f"at least {_SHARE} residuals of one segment are needed for a correlation; got "
            f"{longest}: give a longer log"
        )
    most = min(_LAGS, longest // _SHARE)
    found = [
        {
            axis: autocorrelation(left, rows.segment, most)
            for axis, terms, left in zip(AXES, one.model.terms, residuals(rows, one).T, strict=True)
            if terms
        }
        for one in dampings
    ]
    return length * np.arange(most + 1.0), 1.96 / float(np.sqrt(rows.n)), found


def autocorrelation(series: FloatArray, segment: IntArray, most: int) -> FloatArray:
    """Return the autocorrelation at lags 0 to ``most``, never across a join."""
    products = np.zeros(most + 1)
    for part in np.split(series, np.flatnonzero(np.diff(segment)) + 1):
        for lag in range(min(most + 1, len(part))):
            products[lag] += part[lag:] @ part[: len(part) - lag]
    return np.asarray(products / (products[0] or 1.0))

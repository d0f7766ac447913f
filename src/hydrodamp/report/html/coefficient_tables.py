"""The coefficients of each fit with their intervals, drawn beside the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.basis.axes import AXES
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Identifiability
from hydrodamp.models.labels import coefficient_unit
from hydrodamp.report.correlated import ALIKE, correlated_pairs
from hydrodamp.report.known import LITTLE, LITTLE_MEANING, RULE, how_known, reach_of
from hydrodamp.report.numbers import NOTHING, coefficient
from hydrodamp.validation.comparison import Row

MOST = 2500
"""Coefficients listed in all, whole fits at a time; the files have every one."""

WIDTH = 160.0
"""Of an interval's drawing; zero and the value stand at fixed places in it."""

_NAMED = 6
"""Pairs that are named, the most correlated first."""

_ZERO, _VALUE = 40.0, 100.0


@dataclass(frozen=True)
class Interval:
    """Where a 95 % interval reaches, on a line from zero to the value and beyond."""

    low: float
    high: float
    cut: bool
    sure: bool


@dataclass(frozen=True)
class Coefficient:
    """A line of the table."""

    label: str
    value: str
    error: str
    span: str
    unit: str
    known: str
    interval: Interval | None


@dataclass(frozen=True)
class CoefficientTable:
    """The coefficients of a fit."""

    model: str
    method: str
    title: str
    heading: str
    lines: tuple[Coefficient, ...]
    sentences: tuple[str, ...]

    @property
    def known(self) -> bool:
        """Whether there are intervals."""
        return any(line.interval is not None for line in self.lines)


def coefficient_tables(
    rows: Sequence[Row], chosen: Row | None = None, grades: Identifiability | None = None
) -> tuple[CoefficientTable, ...]:
    """Return the coefficients of some rows."""
    tables: list[CoefficientTable] = []
    listed = 0
    for row in rows:
        if not row.fit.status.usable:
            continue
        listed += row.n_coefficients
        if tables and listed > MOST:
            break
        tables.append(_table(row.fit, grades if row is chosen else None))
    return tuple(tables)


def _table(fit: Fit, grades: Identifiability | None) -> CoefficientTable:
    heading, known = how_known(fit, grades)
    rule = (() if grades is None else (RULE,)) + (LITTLE_MEANING,) * (LITTLE in known.values())
    units = [
        coefficient_unit(axis, term)
        for axis, terms in zip(AXES, fit.model.terms, strict=True)
        for term in terms
    ]
    return CoefficientTable(
        model=fit.model.key,
        method=fit.method,
        title=fit.model.title,
        heading=heading,
        lines=tuple(
            _line(label, value, error, reach_of(fit), unit, known.get(label, NOTHING))
            for (label, value), error, unit in zip(
                fit.damping.as_dict().items(), _errors(fit), units, strict=True
            )
        ),
        sentences=(fit.status.value, *fit.sentences, *_correlated(fit), *rule),
    )


def _correlated(fit: Fit) -> tuple[str, ...]:
    """Name the estimates that err together."""
    covariance, labels = fit.damping.covariance, fit.model.labels
    pairs = [] if covariance is None else correlated_pairs(covariance, ALIKE)
    if not pairs:
        return ()
    named = [f"{labels[i]} with {labels[j]} ({value:+.2f})" for i, j, value in pairs[:_NAMED]]
    many = "1 pair of estimates is" if len(pairs) == 1 else f"{len(pairs)} pairs of estimates are"
    return (
        f"{many} correlated beyond {ALIKE:g}, and better known together than apart; the most: "
        f"{', '.join(named)}.",
    )


def _errors(fit: Fit) -> list[float | None]:
    covariance = fit.damping.covariance
    if covariance is None:
        return [None] * fit.model.n_coefficients
    return [float(np.sqrt(v)) if v >= 0.0 else None for v in np.diag(covariance)]


def _line(
    label: str, value: float, error: float | None, times: float, unit: str, known: str
) -> Coefficient:
    half = None if error is None else times * error
    span = NOTHING
    if half is not None:
        span = f"{coefficient(value - half)} to {coefficient(value + half)}"
    return Coefficient(
        label=label,
        value=coefficient(value),
        error=coefficient(error),
        span=span,
        unit=unit,
        known=known,
        interval=None if half is None else _interval(value, half),
    )


def _interval(value: float, half: float) -> Interval | None:
    """Return the interval in shares of the value, so that all lines read alike."""
    if value == 0.0 or not np.isfinite(value):
        return None
    share = half / abs(value) * (_VALUE - _ZERO)
    low, high = _VALUE - share, _VALUE + share
    return Interval(
        low=round(max(low, 0.0), 1),
        high=round(min(high, WIDTH), 1),
        cut=low < 0.0 or high > WIDTH,
        sure=low > _ZERO,
    )

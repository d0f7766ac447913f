"""Diagnostics of the selected fit: identifiability, residual whiteness, passivity and prediction.

Of the row that a comparison selects: grades of its coefficients, confidence band of its replay, RMS
error by prediction horizon, tests of its residuals and the maximum damping power νᵀτ(ν).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, mad_std
from hydrodamp.basis.term import AXES
from hydrodamp.errors import HydrodampError, MethodError
from hydrodamp.identification.dissipativity import (
    OperatingBox,
    PowerMaximum,
    energy_injection_warnings,
    join_ranges,
    max_damping_power,
    operating_box,
    range_exceedance_warnings,
    velocity_ranges,
)
from hydrodamp.identification.estimated_vehicle import estimated_vehicle, with_estimated_vehicle
from hydrodamp.identification.fit import Fit, correlation
from hydrodamp.identification.fit_files import Key
from hydrodamp.identification.identifiability import Identifiability, grade_fit
from hydrodamp.identification.predicted_error import PredictionBand, predict_error
from hydrodamp.identification.regression import Rows, residuals
from hydrodamp.identification.weak_form import WeakRegression, select_support
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.replay import HorizonScore, horizon_scores
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.vehicle.vehicle import Vehicle

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
    residuals_of = [_axis_residuals(rows, damping).items() for damping in dampings]
    correlations = [
        {axis: autocorrelation(values, rows.segment, n_lags) for axis, values in series}
        for series in residuals_of
    ]
    return length * np.arange(n_lags + 1.0), 1.96 / float(np.sqrt(rows.n)), correlations


def autocorrelation(series: FloatArray, segment: IntArray, max_lag: int) -> FloatArray:
    """Return the autocorrelation at lags 0 to ``max_lag``, within segments."""
    products = np.zeros(max_lag + 1)
    for values in np.split(series, np.flatnonzero(np.diff(segment)) + 1):
        for lag in range(min(max_lag + 1, len(values))):
            products[lag] += values[lag:] @ values[: len(values) - lag]
    return np.asarray(products / (products[0] or 1.0))


T = TypeVar("T")

MAX_BAND_STEP = 0.05  # s; longest integration step of the replays of a prediction band
MAX_BAND_WORK = 4e6  # steps times coefficients; about 1 s of work on one core
MAX_METHODS = 4  # replays in one figure


@dataclass(frozen=True)
class Findings:
    """Diagnostics of one row; `failures` maps a diagnostic that is missing to the reason."""

    row: Row | None = None
    problem: Problem | None = None
    rows: tuple[Row, ...] = ()  # the selected row, and the best row of each other method
    identifiability: Identifiability | None = None
    band: PredictionBand | None = None
    horizons: Mapping[Key, Sequence[HorizonScore]] = field(default_factory=dict)
    residual_tests: tuple[str, ...] = ()
    box: OperatingBox | None = None
    power: PowerMaximum | None = None
    failures: Mapping[str, str] = field(default_factory=dict)


def find_selected_row(comparison: Comparison) -> Row | None:
    """Return the row that diagnostics describe: the selected one, or the only usable one."""
    if any(row.rms is not None for row in comparison.rows):
        return comparison.select().row
    is_single = len(comparison.rows) == 1 and comparison.rows[0].fit.status.usable
    return comparison.rows[0] if is_single else None


def diagnose_comparison(
    comparison: Comparison,
    problem: Problem,
    graded: Mapping[Key, Identifiability | str] | None = None,
) -> Findings:
    """Compute all diagnostics of the selected row but its identifiability, where it is known."""
    row = find_selected_row(comparison)
    if row is None:
        return Findings()
    fit, vehicle, failures = row.fit, problem.vehicle, dict[str, str]()
    problem = with_estimated_vehicle(problem.extend_to(fit.model), fit)
    known = (graded or {}).get((row.model, row.method))

    def grade() -> Identifiability:
        if isinstance(known, str):
            raise MethodError(known)
        return known or grade_fit(problem, fit)

    def attempt(name: str, compute: Callable[[], T]) -> T | None:
        try:
            return compute()
        except HydrodampError as error:
            failures[name] = str(error)
            return None

    rows, box = best_by_method(comparison, row), operating_box(problem)
    has_terms = bool(row.n_coefficients)
    return Findings(
        row,
        problem,
        rows,
        attempt("grades", grade) if has_terms else None,
        replay_band(vehicle, row),
        attempt("horizons", lambda: _horizon_errors(comparison, vehicle, rows)) or {},
        attempt("residuals", lambda: diagnose(problem, fit.damping)) or (),
        box,
        attempt("power", lambda: max_damping_power(fit.damping, box)),
        failures,
    )


def best_by_method(comparison: Comparison, selected: Row) -> tuple[Row, ...]:
    """Return a row, then the row with the least relative error of every other method."""
    best, names = {selected.method: selected}, comparison.select().velocities
    scored = [(row, row.blocks) for row in comparison.rows if row.rms is not None]
    pairs = [(row, errors) for row, errors in scored if errors is not None]
    for row, _ in sorted(pairs, key=lambda pair: pair[1].relative_error(names)):
        best.setdefault(row.method, row)
    return tuple(best.values())[:MAX_METHODS]


def _horizon_errors(
    comparison: Comparison, vehicle: Vehicle, rows: Sequence[Row]
) -> dict[Key, tuple[HorizonScore, ...]]:
    run, unit = rows[0].trajectory, comparison.rate_unit
    if run is None:
        return {}
    return {
        (row.model, row.method): horizon_scores(
            estimated_vehicle(vehicle, row.fit),
            row.fit.damping,
            run.log,
            attitude=run.attitude,
            rate_unit=unit,
        )
        for row in rows
    }


def replay_band(vehicle: Vehicle, row: Row) -> PredictionBand | None:
    """Return the 95 % band of a replay; None without standard errors or if it takes too long."""
    run, covariance = row.trajectory, row.fit.damping.covariance
    if run is None or run.attitude != "measured" or covariance is None:
        return None
    work = max(run.log.n, run.log.duration / MAX_BAND_STEP) * len(covariance)
    if not 0.0 < work <= MAX_BAND_WORK or not np.isfinite(covariance).all():
        return None
    return predict_error(vehicle, row.fit, run.log)


def replay_warnings(comparison: Comparison) -> Iterator[str]:
    """Yield warnings of extrapolation, of divergence and of energy injection near the log."""
    is_scored = any(row.rms is not None for row in comparison.rows)
    selected = comparison.select().row if is_scored else None
    tested: dict[str, tuple[float, float]] = {}
    for row in comparison.rows:
        if not tested and (run := row.trajectory) is not None:
            tested = velocity_ranges(run.log.velocity, run.axes)
            yield from range_exceedance_warnings(row.fit.training_range, tested)
        name = f"{row.model} by {row.method}"
        ranges = join_ranges(row.fit.training_range, tested)
        if row.score.divergence_text:
            warnings = energy_injection_warnings(row.fit.damping, ranges, "Its")
            yield " ".join((f"{name} diverged in {row.score.divergence_text}.", *warnings))
        elif row is selected:
            yield from energy_injection_warnings(row.fit.damping, ranges, f"{name}: its")


def correlated_pairs(
    fit: Fit, is_open: Sequence[bool], threshold: float
) -> list[tuple[str, str, float]]:
    """Return pairs of coefficients of one axis, one of them open, with a high correlation."""
    covariance, labels = fit.damping.covariance, fit.model.labels
    if covariance is None:
        return []
    axes, values = np.array([k[0] for k in labels]), correlation(covariance)
    high = np.abs(values) >= threshold
    high &= np.logical_or.outer(is_open, is_open) & (axes[:, None] == axes)
    pairs = np.argwhere(np.triu(high, 1)).tolist()
    listed = [(labels[i], labels[j], float(values[i, j])) for i, j in pairs]
    return sorted(listed, key=lambda pair: -abs(pair[2]))

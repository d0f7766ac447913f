"""A cross-validation as tables: error by fold, and by horizon beside information criteria."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hydrodamp.identification.fit import Fit
from hydrodamp.report.document import Document
from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import NOTHING, error_size
from hydrodamp.simulation.horizons import HorizonScore, HorizonScores
from hydrodamp.validation.criteria import CRITERIA, Criteria, Criterion
from hydrodamp.validation.crossvalidation import CrossValidation, ValidatedRow
from hydrodamp.validation.front import front

ON_FRONT = "*"
"""Stands beside a row that no other beats in both error and number of coefficients."""

_SHOWN = {"aicc": "AICc", "bic": "BIC"}


def fold_grid(table: CrossValidation) -> Grid:
    """Return the errors on held-out folds, a row for each model and method."""
    best = {id(row) for row in front(table)}
    return Grid(
        title=f"Held out in turn: {len(table.held_out)} folds, RMS in m/s and {table.rate_unit}/s",
        header=("model", "n", "method", "RMS", "spread", "no error", "front"),
        rows=tuple(_fold_row(row, id(row) in best) for row in table.rows),
        align="lrlrrrl",
        notes=(
            "RMS is the mean over the folds that have one; a row with folds without is not chosen.",
            *((str(table.choice()),) if front(table) else ()),
        ),
    )


def _fold_row(row: ValidatedRow, on_front: bool) -> tuple[str, ...]:
    lost = row.rms_by_fold.count(None)
    return (
        row.model,
        str(row.n_coefficients),
        row.method,
        error_size(row.rms_of_finished),
        error_size(row.spread),
        f"{lost} of {len(row.folds)}" if lost else "",
        ON_FRONT if on_front else "",
    )


def horizon_grid(
    fits: Sequence[Fit], scores: Sequence[HorizonScores | None], found: Criteria
) -> Grid:
    """Return the errors by horizon of fits to the whole log, and the criteria."""
    names = next(([_name(one) for one in some.scores] for some in scores if some), [])
    lowest = {key: min(_value(row, key) for row in found.rows) for key in _SHOWN}
    rows = [
        (
            fit.model.key,
            fit.method,
            *(_errors(some, len(names))),
            *(_above(_value(row, key), lowest[key]) for key in _SHOWN),
        )
        for fit, some, row in zip(fits, scores, found.rows, strict=True)
    ]
    counts = ", ".join(f"{axis} {count:.0f}" for axis, count in found.n_effective.items())
    return Grid(
        title="Fitted to the whole log: RMS when restarted every so often, and criteria",
        header=("model", "method", *names, *(f"{name} +" for name in _SHOWN.values())),
        rows=tuple(rows),
        align="ll" + "r" * (len(names) + len(_SHOWN)),
        notes=(
            "These errors are those of the log fitted to; what generalises stands above. Where "
            "windows diverged, their share stands in place of the error.",
            f"Criteria are of the weak form, lower is better; its {found.n_rows} rows count as "
            f"independent ones: {counts}.",
        ),
    )


def _errors(scores: HorizonScores | None, count: int) -> list[str]:
    if scores is None:
        return [NOTHING] * count
    return [_error(one) for one in scores.scores]


def _error(found: HorizonScore) -> str:
    """Return the error, or the share of the windows that diverged."""
    if found.n_diverged:
        return f"{max(100.0 * found.diverged_share, 1.0):.0f} % off"
    return error_size(found.score.rms)


def _name(found: HorizonScore) -> str:
    return found.horizon if isinstance(found.horizon, str) else found.name


def _value(row: Criterion, key: str) -> float:
    given: float | None = getattr(row, key)
    return math.inf if given is None else given


def _above(value: float, lowest: float) -> str:
    return f"{value - lowest:.0f}" if math.isfinite(value) else NOTHING


def validation_document(
    table: CrossValidation,
    fits: Sequence[Fit],
    scores: Sequence[HorizonScores | None],
    found: Criteria,
) -> Document:
    """Return all of it as strict JSON."""
    chosen = table.choice() if front(table) else None
    return {
        "held_out": [list(names) for names in table.held_out],
        "folds": [
            {
                "model": row.model,
                "method": row.method,
                "n_coefficients": row.n_coefficients,
                "rms": row.rms,
                "rms_by_fold": list(row.rms_by_fold),
                "diverged_share": row.diverged_share,
            }
            for row in table.rows
        ],
        "whole": [
            {
                "model": fit.model.key,
                "method": fit.method,
                "rms_by_horizon": {one.name: one.score.rms for one in some.scores} if some else {},
                **{key: _number(getattr(row, key)) for key in CRITERIA},
            }
            for fit, some, row in zip(fits, scores, found.rows, strict=True)
        ],
        "choice": None if chosen is None else str(chosen),
    }


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None

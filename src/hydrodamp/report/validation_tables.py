"""A cross-validation as tables and as a document: error by fold, by horizon, and criteria."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hydrodamp.identification.fit import Fit
from hydrodamp.report.grid import Column, Grid, error_size
from hydrodamp.simulation.score import HorizonScore, HorizonScores
from hydrodamp.validation.choice import front
from hydrodamp.validation.criteria import CRITERIA, Criteria
from hydrodamp.validation.crossvalidation import CrossValidation


def fold_grid(table: CrossValidation) -> Grid:
    """Return the errors on held-out folds, a row for each model and method."""
    best = {id(row) for row in front(table)}
    return Grid(
        title=f"Held out in turn: {len(table.held_out)} folds, RMS in m/s and {table.rate_unit}/s",
        columns=(
            Column("model", number=False),
            Column("n"),
            Column("method", number=False),
            Column("RMS", form=error_size),
            Column("spread", form=error_size),
            Column("no error"),
            Column("front", number=False),
        ),
        rows=tuple(
            (
                *(row.model, row.n_coefficients, row.method, row.rms_of_finished, row.spread),
                f"{lost} of {len(row.folds)}" if (lost := row.rms_by_fold.count(None)) else "",
                "*" if id(row) in best else "",
            )
            for row in table.rows
        ),
        notes=(
            "RMS is the mean over the folds that have one; a row with folds without is not chosen.",
            *((str(table.choice()),) if best else ()),
            *(("* no other row has both a lower error and fewer coefficients.",) if best else ()),
        ),
    )


def horizon_grid(
    fits: Sequence[Fit], scores: Sequence[HorizonScores | None], found: Criteria
) -> Grid:
    """Return the errors by horizon of fits to the whole log, and the criteria."""
    names = next(([_horizon(one) for one in some.scores] for some in scores if some), [])
    shown = {"aicc": "AICc +", "bic": "BIC +"}
    lowest = {
        key: min((getattr(row, key) for row in found.rows if _is_finite(row, key)), default=0.0)
        for key in shown
    }
    counts = ", ".join(f"{axis} {count:.0f}" for axis, count in found.n_effective.items())
    return Grid(
        title="Fitted to the whole log: RMS when restarted every so often, and criteria",
        columns=(
            Column("model", number=False),
            Column("method", number=False),
            *(Column(name, form=error_size) for name in names),
            *(Column(name) for name in shown.values()),
        ),
        rows=tuple(
            (
                *(fit.model.key, fit.method),
                *([None] * len(names) if some is None else map(_restarted, some.scores)),
                *(
                    f"{getattr(row, key) - lowest[key]:.0f}" if _is_finite(row, key) else None
                    for key in shown
                ),
            )
            for fit, some, row in zip(fits, scores, found.rows, strict=True)
        ),
        notes=(
            "These errors are those of the log fitted to; what generalises stands above. Where "
            "windows diverged, their share stands in place of the error.",
            f"Criteria are of the weak form, lower is better; its {found.n_rows} rows count as "
            f"independent ones: {counts}.",
        ),
    )


def _is_finite(row: object, key: str) -> bool:
    value = getattr(row, key)
    return value is not None and math.isfinite(value)


def _horizon(found: HorizonScore) -> str:
    return found.horizon if isinstance(found.horizon, str) else found.name


def _restarted(found: HorizonScore) -> float | str | None:
    """Return the error, or the share of the windows that diverged."""
    if found.n_diverged:
        return f"{max(100.0 * found.diverged_share, 1.0):.0f} % off"
    return found.score.rms


def validation_document(
    table: CrossValidation,
    fits: Sequence[Fit],
    scores: Sequence[HorizonScores | None],
    found: Criteria,
) -> dict[str, object]:
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
                **{key: getattr(row, key) if _is_finite(row, key) else None for key in CRITERIA},
            }
            for fit, some, row in zip(fits, scores, found.rows, strict=True)
        ],
        "choice": None if chosen is None else str(chosen),
    }

"""A cross-validation as tables and as a document: error by fold, by horizon, and criteria."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hydrodamp.identification.fit import Fit
from hydrodamp.report.grid import Grid, error_size
from hydrodamp.simulation.score import HorizonScore, HorizonScores
from hydrodamp.validation.choice import front
from hydrodamp.validation.criteria import CRITERIA, Criteria
from hydrodamp.validation.crossvalidation import CrossValidation


def fold_grid(table: CrossValidation) -> Grid:
    """Return the errors on held-out folds, a row for each model and method."""
    best = [f"{row.model} by {row.method}" for row in front(table)]
    rows = []
    for row in table.rows:
        lost = row.rms_by_fold.count(None)
        errors = error_size(row.rms_of_finished), error_size(row.spread)
        without = f"{lost} of {len(row.folds)}" if lost else ""
        rows.append((row.model, row.n_coefficients, row.method, *errors, without))
    notes = [
        "RMS is the mean over the folds that have one; a row with folds without is not chosen."
    ]
    if best:
        notes += [
            str(table.choice()),
            f"No row has both a lower error and fewer coefficients than: {', '.join(best)}.",
        ]
    title = f"Held out in turn: {len(table.held_out)} folds, RMS in m/s and {table.rate_unit}/s"
    header = ("model", "n", "method", "RMS", "spread", "no error")
    return Grid.of_words(title, header, "lrlrrr", rows, notes)


def horizon_grid(
    fits: Sequence[Fit], scores: Sequence[HorizonScores | None], found: Criteria
) -> Grid:
    """Return the errors by horizon of fits to the whole log, and the criteria."""
    names = next(([_horizon(one) for one in some.scores] for some in scores if some), [])
    lowest = {
        key: min((getattr(row, key) for row in found.rows if _is_finite(row, key)), default=0.0)
        for key in ("aicc", "bic")
    }
    rows = []
    for fit, some, row in zip(fits, scores, found.rows, strict=True):
        errors = [None] * len(names) if some is None else map(_restarted, some.scores)
        above = (
            f"{getattr(row, key) - least:.0f}" if _is_finite(row, key) else None
            for key, least in lowest.items()
        )
        rows.append((fit.model.key, fit.method, *errors, *above))
    counts = ", ".join(f"{axis} {count:.0f}" for axis, count in found.n_effective.items())
    notes = (
        "These errors are those of the log fitted to; what generalises stands above. Where "
        "windows diverged, their share stands in place of the error.",
        f"Criteria are of the weak form, lower is better; its {found.n_rows} rows count as "
        f"independent ones: {counts}.",
    )
    title = "Fitted to the whole log: RMS when restarted every so often, and criteria"
    header = ("model", "method", *names, "AICc +", "BIC +")
    return Grid.of_words(title, header, "ll" + "r" * (len(names) + 2), rows, notes)


def _is_finite(row: object, key: str) -> bool:
    value = getattr(row, key)
    return value is not None and math.isfinite(value)


def _horizon(found: HorizonScore) -> str:
    return found.horizon if isinstance(found.horizon, str) else found.name


def _restarted(found: HorizonScore) -> str:
    """Return the error, or the share of the windows that diverged."""
    if found.n_diverged:
        return f"{max(100.0 * found.diverged_share, 1.0):.0f} % off"
    return error_size(found.score.rms)


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

"""Tables of a cross-validation, and its JSON document."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from hydrodamp.identification.dissipativity import energy_injection_warnings
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.fit_files import adequacy_document
from hydrodamp.report.comparison_tables import ROW, format_horizon_error
from hydrodamp.report.documents import WindowsDocument, selection_document
from hydrodamp.report.narrative import describe_forms
from hydrodamp.report.table import Column, Table, error_size
from hydrodamp.report.verdict_tables import selection_table
from hydrodamp.simulation.replay import HorizonScore
from hydrodamp.validation.cross_validation import CrossValidation, ValidatedRow
from hydrodamp.validation.selection import pareto_front
from hydrodamp.validation.workflow import Validation


def error_table(table: CrossValidation) -> Table:
    """Return the rows by error over all folds."""
    summary = selection_table(table.rows, table.select(), table.rate_unit)
    return replace(summary, notes=(*summary.notes, *describe_forms(table.rows)))


def detail_tables(result: Validation) -> Iterator[Table]:
    """Yield the errors by fold, over prediction windows of each fold, and by horizon."""
    yield fold_table(result.table)
    yield from window_tables(result.table)
    if result.fits:
        yield horizon_table(result.fits, result.scores)


def window_tables(table: CrossValidation) -> Iterator[Table]:
    """Yield the errors over prediction windows by held-out fold, if they were computed."""
    windows = [(row, [fold.windows for fold in row.folds]) for row in table.rows]
    name = next((each.name for _, scores in windows for each in scores if each), "")
    if name:
        cells = [
            (row.model, row.method, *(each and format_horizon_error(each) for each in scores))
            for row, scores in windows
        ]
        columns = (*ROW, *(Column(str(k + 1)) for k in range(len(table.held_out))))
        title = f"RMS over windows of {name} by held-out fold, in m/s and {table.rate_unit}/s"
        yield Table(title, columns, tuple(cells))


def fold_table(table: CrossValidation) -> Table:
    """Return the cross-validation errors, a row for each model and method."""
    best = [f"{row.model} by {row.method}" for row in pareto_front(table)]
    failed = [row for row in table.rows if row.failed_folds]
    notes = [f"{row.model} by {row.method} lost {', '.join(row.failed_folds)}." for row in failed]
    if best:
        notes.append(f"Pareto front (error, coefficients): {', '.join(best)}.")
    columns = [*ROW, *(Column(str(k + 1), form=error_size) for k in range(len(table.held_out)))]
    cells = ((row.model, row.method, *row.rms_by_fold) for row in table.rows)
    title = f"RMS by held-out fold, in m/s and {table.rate_unit}/s"
    return Table(title, tuple(columns), tuple(cells), tuple(notes))


def horizon_table(fits: Sequence[Fit], scores: Sequence[Sequence[HorizonScore] | None]) -> Table:
    """Return the errors by prediction horizon of fits to the entire log."""
    names = next(([score.name for score in horizons] for horizons in scores if horizons), [])
    note = (
        "Errors on the training data; the cross-validation above estimates the prediction error. "
        '"% off" is the share of windows that diverged.'
    )
    rows, notes = [], [note]
    for fit, horizons in zip(fits, scores, strict=True):
        errors = [None] * len(names) if horizons is None else map(format_horizon_error, horizons)
        rows.append((fit.model.key, fit.method, *errors))
        if horizons and any(score.n_diverged for score in horizons):
            subject = f"{fit.model.key} by {fit.method}: its"
            notes += energy_injection_warnings(fit.damping, fit.training_range, subject)
    title = "RMS error of fits to the entire log by prediction horizon"
    return Table.of_words(title, ("model", "method", *names), "ll" + "r" * len(names), rows, notes)


def validation_document(result: Validation) -> dict[str, object]:
    """Return a cross-validation and errors by horizon as a JSON document."""
    table = result.table
    of_row = ("model", "method", "n_coefficients", "rms", "standard_error", "rms_by_fold")
    return {
        "format": "hydrodamp-validation",
        "version": 1,
        "verdict": selection_document(table),
        "held_out": table.held_out,
        "folds": [
            {key: getattr(row, key) for key in of_row}
            | {"lost": row.failed_folds, "adequacy": adequacy_document(row.adequacy)}
            | _windows(row)
            for row in table.rows
        ],
        "whole": [
            {
                "model": fit.model.key,
                "method": fit.method,
                "rms_by_horizon": {score.name: score.score.rms for score in horizons or ()},
            }
            for fit, horizons in zip(result.fits, result.scores, strict=True)
        ],
    }


def _windows(row: ValidatedRow) -> dict[str, object]:
    """Return the errors over prediction windows of each fold, if they were computed."""
    windows = [fold.windows and WindowsDocument.of(fold.windows).model_dump() for fold in row.folds]
    return {"windows": windows} if any(windows) else {}

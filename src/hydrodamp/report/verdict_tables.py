"""Verdict on a comparison or cross-validation, and the table of its rows, as text tables."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from hydrodamp.identification.grades import count_determined
from hydrodamp.report.table import Column, Table, error_size, percent
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.status import Status
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.selection import Candidate, Ranked, margin
from hydrodamp.validation.verdict import Verdict

MAX_ROWS = 9  # rows of a table on screen: the catalogue, and a model of the user


def verdict_table(verdict: Verdict, notes: Iterable[str] = ()) -> Table:
    """Return a verdict, with further sentences, as text to be wrapped."""
    return Table("", (), (), (*verdict.lines, *notes))


def best_by_model(
    rows: Iterable[Candidate], selected: Candidate | None
) -> list[tuple[Candidate, BlockErrors]]:
    """Return the selected row and the best of each other model; diverged rows come last."""
    scored = [(row, row.blocks) for row in rows if row.blocks is not None]
    best: dict[str, tuple[Candidate, BlockErrors]] = {}

    def order(pair: tuple[Candidate, BlockErrors]) -> tuple[bool, float]:
        return bool(pair[0].divergences), pair[1].rms

    for pair in sorted(scored, key=lambda pair: (pair[0] is not selected, *order(pair))):
        best.setdefault(pair[0].model, pair)
    return sorted(best.values(), key=order)


def selection_cells(
    comparison: Comparison, selected: Row | None
) -> list[tuple[Row, str, list[str]]]:
    """Return the best row of each model with error and fits as text."""
    return [
        (
            row,
            f"{rms if isinstance(rms, str) else error_size(rms)}{margin(deviation)}",
            [*map(percent, fits)],
        )
        for row, errors in best_by_model(comparison.rows, selected)
        for rms, deviation, fits in [_errors(row, errors)]
    ]


def _errors(
    row: Ranked, errors: BlockErrors
) -> tuple[float | str, float | None, list[float | None]]:
    """Return error, its standard error and the fit of each velocity; after a divergence none."""
    if row.divergences:
        return Status.DIVERGED.word, None, [None] * len(errors.names)
    return errors.rms, errors.standard_error, [*errors.fit_by_axis.values()]


def selection_table(
    rows: Iterable[Ranked], selected: Ranked, rate_unit: str, data: str = "held-out data"
) -> Table:
    """Return the rows by error, with error and fit by velocity; the best method of each model."""
    scored = [row for row in rows if row.blocks is not None]
    best = best_by_model(scored, selected)
    several = len({row.method for row in scored}) > 1
    names = best[0][1].names if best else ()
    columns = [Column("model", number=False)]
    columns += [Column("method", number=False)] if several else []
    columns += [Column("n"), Column("det."), Column("RMS", form=error_size)]
    columns += [Column("±", form=partial(error_size, decimals=3))]
    columns += [Column(f"{name} %", form=percent) for name in names]
    cells = [_cells(row, errors, several, row is selected) for row, errors in best[:MAX_ROWS]]
    notes = []
    if len(best) < len(scored) or len(best) > MAX_ROWS:
        notes.append(f"{len(scored) - len(cells)} more rows: `--verbose`.")
    title = f"Error (m/s and {rate_unit}/s mixed) and fit in % on {data}; * selected"
    return Table(title, tuple(columns), tuple(cells), tuple(notes))


def _cells(
    row: Ranked, errors: BlockErrors, several: bool, is_selected: bool
) -> tuple[object, ...]:
    mark = " *" if is_selected else ""
    rms, deviation, fits = _errors(row, errors)
    return (
        f"{row.model}{mark}",
        *((row.method,) if several else ()),
        row.n_coefficients,
        count_determined(row.grades),
        rms,
        deviation,
        *fits,
    )

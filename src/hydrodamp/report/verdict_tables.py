"""Verdict on a comparison or cross-validation, and the table of its rows, as text tables."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from functools import partial

from hydrodamp.identification.grades import count_determined
from hydrodamp.report.table import Column, Table, error_size, percent
from hydrodamp.simulation.block_errors import BlockErrors
from hydrodamp.status import Status
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.selection import (
    Candidate,
    Ranked,
    Selection,
    margin,
    relative_percent,
)
from hydrodamp.validation.verdict import Verdict

MAX_ROWS = 9  # rows of a table on screen: the catalogue, and a model of the user


def verdict_table(verdict: Verdict, notes: Iterable[str] = ()) -> Table:
    """Return a verdict, with further sentences, as text to be wrapped."""
    return Table("", (), (), (*verdict.lines, *notes))


def best_by_model(
    rows: Iterable[Candidate], selection: Selection[Candidate] | None
) -> list[tuple[Candidate, BlockErrors]]:
    """Return the selected row and the best of each other model; diverged rows come last."""
    scored = [(row, row.blocks) for row in rows if row.blocks is not None]
    best: dict[str, tuple[Candidate, BlockErrors]] = {}
    selected = None if selection is None else selection.row
    names = () if selection is None else selection.velocities

    def order(pair: tuple[Candidate, BlockErrors]) -> tuple[bool, float]:
        return bool(pair[0].divergences), pair[1].relative_error(names)

    for pair in sorted(scored, key=lambda pair: (pair[0] is not selected, *order(pair))):
        best.setdefault(pair[0].model, pair)
    return sorted(best.values(), key=order)


def selection_cells(comparison: Comparison) -> list[tuple[Row, str, list[str]]]:
    """Return the best row of each model with relative error and fits as text."""
    if all(row.blocks is None for row in comparison.rows):
        return []
    selection = comparison.select()
    return [
        (
            row,
            f"{error if isinstance(error, str) else percent(error)}{margin(deviation)}",
            [*map(percent, fits)],
        )
        for row, errors in best_by_model(comparison.rows, selection)
        for error, deviation, _, fits in [_errors(row, errors, selection.velocities)]
    ]


def _errors(
    row: Ranked, errors: BlockErrors, names: Collection[str]
) -> tuple[float | str, float | None, float | None, list[float | None]]:
    """Return relative error, its standard error, equation 24 and the fits; none if diverged."""
    if row.divergences:
        return Status.DIVERGED.word, None, None, [None] * len(errors.names)
    return *relative_percent(errors, names), errors.rms, [*errors.fit_by_axis.values()]


def selection_table(
    rows: Iterable[Candidate],
    selection: Selection[Candidate],
    rate_unit: str,
    data: str = "held-out data",
) -> Table:
    """Return the rows by error, with error and fit by velocity; the best method of each model."""
    scored = [row for row in rows if row.blocks is not None]
    best = best_by_model(scored, selection)
    several = len({row.method for row in scored}) > 1
    names = best[0][1].names if best else ()
    columns = [Column("model", number=False)]
    columns += [Column("method", number=False)] if several else []
    columns += [Column("n"), Column("det."), Column("error", form=partial(error_size, decimals=1))]
    columns += [Column("±", form=partial(error_size, decimals=1))]
    columns += [Column(name, form=percent) for name in names]
    columns += [Column("eq. 24", form=error_size)]
    cells = [_cells(row, errors, several, selection) for row, errors in best[:MAX_ROWS]]
    counted = " ".join(selection.velocities)
    notes = [
        "n, det.: coefficients, and how many the training data determine.",
        f"error: of {counted}, in % of the motion, without the noise; at least the noise.",
    ]
    if len(best) < len(scored) or len(best) > MAX_ROWS:
        notes.append(f"{len(scored) - len(cells)} more rows: `--verbose`.")
    title = f"Error and fit in % on {data}; eq. 24 in m/s and {rate_unit}/s mixed; * selected"
    return Table(title, tuple(columns), tuple(cells), tuple(notes))


def _cells(
    row: Candidate, errors: BlockErrors, several: bool, selection: Selection[Candidate]
) -> tuple[object, ...]:
    mark = " *" if row is selection.row else ""
    error, deviation, rms, fits = _errors(row, errors, selection.velocities)
    return (
        f"{row.model}{mark}",
        *((row.method,) if several else ()),
        row.n_coefficients,
        count_determined(row.grades),
        error,
        deviation,
        *fits,
        rms,
    )

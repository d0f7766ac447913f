"""A comparison as tables: models against methods, by axis, and row by row."""

from __future__ import annotations

import math

from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import NOTHING, error_size, percent
from hydrodamp.report.remarks import remarks
from hydrodamp.simulation.status import Status
from hydrodamp.validation.choice import LowestError
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.validation.paper import PRINTED_COLUMN, TABLE_I, beside_paper

ABREAST = 3
"""Methods side by side in a table of 80 columns."""

UNSETTLED = "~"
"""Stands before the error of a fit that has not settled."""

_PRINTED = {"ls": "paper LS", "ai": "paper AI"}
_INSTEAD = {
    Status.DIVERGED: "diverged",
    Status.TOO_FEW_SAMPLES: "too few",
    Status.REFUSED: "refused",
    Status.FAILED: "failed",
}


def comparison_grids(comparison: Comparison) -> tuple[Grid, ...]:
    """Return all tables that a reader of a comparison should see."""
    return (*summary_grids(comparison), *axis_grids(comparison))


def summary_grids(comparison: Comparison) -> tuple[Grid, ...]:
    """Return the errors of models (down) by methods (across)."""
    methods = comparison.methods
    pages = max(math.ceil(len(methods) / ABREAST), 1)
    share = math.ceil(len(methods) / pages)
    parts = [methods[k * share : (k + 1) * share] for k in range(pages)]
    notes = [()] * (pages - 1) + [remarks(comparison)]
    return tuple(
        _summary(comparison, part, below) for part, below in zip(parts, notes, strict=True)
    )


def axis_grids(comparison: Comparison) -> tuple[Grid, ...]:
    """Return error and fit by velocity, a table a method."""
    grids = (_by_axis(comparison, method) for method in comparison.methods)
    return tuple(grid for grid in grids if grid.rows)


def row_grid(comparison: Comparison) -> Grid:
    """Return every row with all its numbers in full precision, for other programs."""
    unit = comparison.rate_unit
    names = _velocities(comparison)
    header = (
        *("model", "method", "n_coefficients", "rank", f"rms_{unit}", "paper_rms"),
        *(f"rms_{name}" for name in names),
        *(f"fit_{name}" for name in names),
        *("status", "diverged_at"),
    )
    rows = tuple(_exact(row, names) for row in comparison.rows)
    return Grid("", header, rows, "ll" + "r" * (4 + 2 * len(names)) + "ll")


def printed_error(row: Row) -> float | None:
    """Return the error that the paper prints for a row's model and method."""
    column = PRINTED_COLUMN.get(row.method)
    printed = TABLE_I.get(row.model)
    return getattr(printed, column) if column and printed else None


def _summary(comparison: Comparison, methods: tuple[str, ...], notes: tuple[str, ...]) -> Grid:
    found = {(row.model, row.method): row for row in reversed(comparison.rows)}
    ranked = any(row.fit.rank is not None for row in found.values() if row.method in methods)
    printed = _printed_columns(comparison, methods)
    header = (
        *("model", "n", *(("rank",) if ranked else ())),
        *methods,
        *(_PRINTED[column] for column in printed),
    )
    rows = []
    for model in comparison.models:
        mine = [found.get((model, method)) for method in methods]
        rows.append(
            (
                *_names(model, mine, found, ranked),
                *map(_cell, mine),
                *(_printed_cell(model, column) for column in printed),
            )
        )
    return Grid(
        title=f"RMS velocity error on the test data, m/s and {comparison.rate_unit}/s mixed",
        header=header,
        rows=tuple(rows),
        align="l" + "r" * (len(header) - 1),
        notes=notes,
        best=_best(comparison, methods, header),
        dim=frozenset(range(len(header) - len(printed), len(header))),
    )


def _names(
    model: str,
    mine: list[Row | None],
    found: dict[tuple[str, str], Row],
    ranked: bool,
) -> tuple[str, ...]:
    any_row = next(row for (key, _), row in found.items() if key == model)
    ranks = [row.fit.rank for row in mine if row is not None and row.fit.rank is not None]
    rank = (str(ranks[0]) if ranks else NOTHING,) if ranked else ()
    return (model, str(any_row.fit.model.n_coefficients), *rank)


def _printed_columns(comparison: Comparison, methods: tuple[str, ...]) -> tuple[str, ...]:
    if not beside_paper(comparison):
        return ()
    return tuple(dict.fromkeys(PRINTED_COLUMN[m] for m in methods if m in PRINTED_COLUMN))


def _printed_cell(model: str, column: str) -> str:
    return f"{getattr(TABLE_I[model], column):.2f}" if model in TABLE_I else NOTHING


def _cell(row: Row | None) -> str:
    if row is None:
        return NOTHING
    if row.status in _INSTEAD:
        return _INSTEAD[row.status]
    mark = UNSETTLED if row.status is Status.NOT_SETTLED else ""
    return mark + error_size(row.rms)


def _best(
    comparison: Comparison, methods: tuple[str, ...], header: tuple[str, ...]
) -> frozenset[tuple[int, int]]:
    """Return the cell of the lowest error of each method, among fits that have settled."""
    cells = set()
    for method in methods:
        scored = [row for row in comparison.rows if row.method == method and row.settled]
        if scored:
            lowest = LowestError().ranked(scored)[0]
            cells.add((comparison.models.index(lowest.model), header.index(method)))
    return frozenset(cells)


def _by_axis(comparison: Comparison, method: str) -> Grid:
    names = _velocities(comparison)
    scored = [row for row in comparison.rows if row.method == method and row.rms is not None]
    unit = comparison.rate_unit
    return Grid(
        title=f"{method} by axis: RMS error of {_units(names, unit)}, then fit in %",
        header=("model", *(word for name in names for word in (name, "%"))),
        rows=tuple((row.model, *_axis_cells(row, names)) for row in scored),
        align="l" + "rr" * len(names),
        dim=frozenset(range(2, 2 * len(names) + 1, 2)),
    )


def _units(names: tuple[str, ...], unit: str) -> str:
    linear = " ".join(name for name in names if name in VELOCITIES[:3])
    angular = " ".join(name for name in names if name in VELOCITIES[3:])
    words = ((linear, "m/s"), (angular, f"{unit}/s"))
    return ", ".join(f"{some} in {of}" for some, of in words if some)


def _axis_cells(row: Row, names: tuple[str, ...]) -> tuple[str, ...]:
    score = row.score
    angular = 2 if score.rate_unit == "deg" else 4
    return tuple(
        word
        for name in names
        for word in (
            error_size(score.rms_by_axis.get(name), 3 if name in VELOCITIES[:3] else angular),
            percent(score.fit_by_axis.get(name)),
        )
    )


def _velocities(comparison: Comparison) -> tuple[str, ...]:
    known = {name for row in comparison.rows for name in row.score.rms_by_axis}
    return tuple(name for _, name in zip(AXES, VELOCITIES, strict=True) if name in known)


def _exact(row: Row, names: tuple[str, ...]) -> tuple[str, ...]:
    score, fit = row.score, row.fit
    numbers = (
        *(fit.model.n_coefficients, fit.rank, row.rms, printed_error(row)),
        *(score.rms_by_axis.get(name) for name in names),
        *(score.fit_by_axis.get(name) for name in names),
    )
    when = "; ".join(f"{name} {time:g}" for name, time in score.diverged)
    words = ("" if number is None else repr(number) for number in numbers)
    return (row.model, row.method, *words, row.status.word, when)

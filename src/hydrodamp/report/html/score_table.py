"""The table of a report: a row a fit, with something to sort by in every cell."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.report.comparison_grids import UNSETTLED, printed_error
from hydrodamp.report.numbers import NOTHING, error_size, percent
from hydrodamp.simulation.status import Status
from hydrodamp.validation.comparison import Comparison, Row
from hydrodamp.validation.paper import beside_paper


@dataclass(frozen=True)
class Cell:
    """What a reader sees and what the column is sorted by."""

    text: str
    key: str


@dataclass(frozen=True)
class Column:
    """A column's head."""

    name: str
    title: str
    numeric: bool = True


@dataclass(frozen=True)
class Line:
    """A row of the table."""

    method: str
    cells: tuple[Cell, ...]
    chosen: bool


@dataclass(frozen=True)
class ScoreTable:
    """The table."""

    columns: tuple[Column, ...]
    lines: tuple[Line, ...]


def ranked(rows: Iterable[Row]) -> list[Row]:
    """Return rows with the one to take first."""

    def place(row: Row) -> tuple[bool, bool, float, int]:
        rms = row.rms if row.rms is not None else float("inf")
        return (row.rms is None, not row.settled, rms, row.n_coefficients)

    return sorted(rows, key=place)


def score_table(comparison: Comparison) -> ScoreTable:
    """Return all rows of a comparison with their errors."""
    names = velocities(comparison)
    printed = beside_paper(comparison)
    order = sorted(comparison.rows, key=lambda r: (r.rms is None, r.rms or 0.0, r.n_coefficients))
    best = ranked(comparison.rows)[0] if comparison.rows else None
    return ScoreTable(
        columns=tuple(_columns(comparison, names, printed)),
        lines=tuple(Line(row.method, _cells(row, names, printed), row is best) for row in order),
    )


def velocities(comparison: Comparison) -> tuple[str, ...]:
    """Return the velocities that have an error."""
    known = {name for row in comparison.rows for name in row.score.rms_by_axis}
    return tuple(name for name in VELOCITIES if name in known)


def _columns(comparison: Comparison, names: tuple[str, ...], printed: bool) -> Iterable[Column]:
    rate = f"{comparison.rate_unit}/s"
    yield Column("Model", "damping model", numeric=False)
    yield Column("Method", "how it was identified", numeric=False)
    yield Column("n", "number of coefficients")
    yield Column("Rank", "coefficients that the data tell apart, summed over axes")
    yield Column("RMS", f"RMS velocity error of the open-loop replay, m/s and {rate} mixed, eq. 24")
    yield Column("Outcome", "what became of the fit and its replay", numeric=False)
    if printed:
        yield Column("Paper", "the error that Table I of the paper prints")
    for name in names:
        unit = "m/s" if name in "uvw" else rate
        yield Column(name, f"RMS error of {name}, {unit}")
        yield Column(f"{name} %", f"fit of {name}: 100 is exact, 0 no better than its mean")


def _cells(row: Row, names: tuple[str, ...], printed: bool) -> tuple[Cell, ...]:
    rank = row.fit.rank
    mark = UNSETTLED if row.rms is not None and row.status is Status.NOT_SETTLED else ""
    cells = [
        Cell(row.model, row.model.casefold()),
        Cell(row.method, row.method.casefold()),
        Cell(str(row.n_coefficients), str(row.n_coefficients)),
        Cell(NOTHING if rank is None else str(rank), "" if rank is None else str(rank)),
        Cell(mark + error_size(row.rms), _key(row.rms)),
        Cell(row.status.word, row.status.word),
    ]
    if printed:
        error = printed_error(row)
        cells.append(Cell(error_size(error, 2), _key(error)))
    for name in names:
        error, share = row.score.rms_by_axis.get(name), row.score.fit_by_axis.get(name)
        cells += [Cell(error_size(error), _key(error)), Cell(percent(share), _key(share))]
    return tuple(cells)


def _key(value: float | None) -> str:
    return "" if value is None else repr(float(value))

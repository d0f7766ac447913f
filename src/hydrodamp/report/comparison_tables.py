"""Tables of a comparison, a replay and a cross-validation, and the latter as JSON."""

from __future__ import annotations

import math
import string
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, compress
from os.path import commonprefix

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.report.narrative import describe_data, limits, remarks, status_remarks
from hydrodamp.report.table import Column, Table, error_size, percent
from hydrodamp.report.verdict_tables import selection_table
from hydrodamp.simulation.replay import HorizonScore, Score
from hydrodamp.status import Status
from hydrodamp.validation.compare import (
    PAPER_COLUMN,
    PAPER_TABLE_I,
    Comparison,
    Row,
    is_paper_campaign,
)
from hydrodamp.validation.selection import relative_errors

MAX_METHODS = 3  # columns of methods in a table of 80 characters
MAX_BRIEF_METHODS = 4  # in one without ranks
MAX_SEGMENTS = 6  # columns of segments in a table of 80 characters
ROW = (
    Column("model", number=False, meaning="damping model"),
    Column("method", number=False, meaning="identification method"),
)
_paper_error = partial(error_size, decimals=2)
_PRINTED = {"ls": "paper LS", "ai": "paper AI"}


def detail_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return the errors by segment, axis and prediction horizon."""
    return (*segment_tables(comparison), *axis_tables(comparison), *horizon_tables(comparison))


def segment_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return the errors by test segment, if there are several and they fit in a table."""
    replayed = [row for row in comparison.rows if row.trajectory]
    segments = list(replayed[0].score.rms_by_segment) if replayed else []
    if not 1 < len(segments) <= MAX_SEGMENTS:
        return ()
    cells = tuple(
        (row.model, row.method, *map(row.score.rms_by_segment.get, segments)) for row in replayed
    )
    shared = commonprefix(segments).rstrip(string.ascii_letters + string.digits)  # noqa: RUF071
    names = [segment.removeprefix(shared) for segment in segments]
    columns = *ROW, *(Column(name, form=error_size) for name in names)
    of = f", {shared}…" if shared else ""
    return (Table(f"RMS velocity error by test segment{of}", columns, cells),)


def horizon_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return the fit percentages over prediction windows, if they were computed."""
    scored = [(row, row.windows) for row in comparison.rows if row.windows]
    if not scored:
        return ()
    names = list(scored[0][1].score.fit_by_axis)
    errors = Column("RMS", form=error_size), *(Column(name, form=percent) for name in names)
    cells = tuple(
        (row.model, row.method, format_horizon_error(at), *map(at.score.fit_by_axis.get, names))
        for row, at in scored
    )
    note = (
        'Fit is 100 (1 - rmse / std of the log). Windows start at measured states; "% off" is the '
        "share of windows that diverged."
    )
    title = f"Fit in % over windows of {scored[0][1].name}"
    return (Table(title, (*ROW, *errors), cells, (note,)),)


def summary_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return the errors of models (down) by methods (across), a few methods to a table."""
    methods = comparison.methods
    pages = math.ceil(len(methods) / MAX_METHODS) or 1
    groups = np.array_split(np.array(methods, dtype=object), pages)
    *tables, last = (summary_table(comparison, group.tolist()) for group in groups)
    return (*tables, replace(last, notes=tuple(remarks(comparison))))


def brief_table(comparison: Comparison) -> Table:
    """Return the table on screen: a row for each model, with all methods if there are several."""
    methods = comparison.methods
    is_single = len(methods) == 1 and not is_paper_campaign(comparison)
    if is_single or len(methods) > MAX_BRIEF_METHODS:
        data = describe_data(comparison)
        table = selection_table(comparison.rows, comparison.select(), comparison.rate_unit, data)
        return replace(table, notes=(*table.notes, *limits(comparison)))
    table = summary_table(comparison, methods)
    is_shown = [column.name != "rank" for column in table.columns]
    columns = tuple(compress(table.columns, is_shown))
    cells = tuple(tuple(compress(row, is_shown)) for row in table.rows)
    notes = (*limits(comparison), *status_remarks(comparison, [Status.NOT_CONVERGED]))
    return replace(table, columns=columns, rows=cells, notes=notes, best=frozenset())


def summary_table(comparison: Comparison, methods: Sequence[str]) -> Table:
    by_key = {(row.model, row.method): row for row in reversed(comparison.rows)}
    sizes = {row.model: row.n_coefficients for row in comparison.rows}
    paper_columns = [PAPER_COLUMN[m] for m in methods if m in PAPER_COLUMN]
    paper_names = list(dict.fromkeys(paper_columns)) if is_paper_campaign(comparison) else []
    columns = [Column("model", number=False), Column("n"), Column("rank")]
    columns += [Column(method, form=error_size) for method in methods]
    columns += [Column(_PRINTED[name], form=_paper_error) for name in paper_names]
    rows = []
    for model, n in sizes.items():
        model_rows = [by_key.get((model, method)) for method in methods]
        ranks = (row.fit.rank for row in model_rows if row is not None and row.fit.rank is not None)
        paper = (getattr(PAPER_TABLE_I.get(model), name, None) for name in paper_names)
        rows.append((model, n, next(ranks, None), *map(_error, model_rows), *paper))
    best = set()
    for column, method in enumerate(methods, start=3):
        of_method = [row for row in comparison.rows if row.method == method and row.converged]
        scored = [(row.rms, row.model) for row in of_method if row.rms is not None]
        if scored:
            best.add(([*sizes].index(min(scored)[1]), column))
    data = describe_data(comparison)
    title = f"RMS velocity error on the {data}, m/s and {comparison.rate_unit}/s mixed"
    return Table(title, tuple(columns), tuple(rows), best=frozenset(best))


def _error(row: Row | None) -> float | str | None:
    """Return the error of a row, with "~" if the fit has not converged, or its status."""
    if row is None:
        return None
    if row.status is Status.NOT_CONVERGED:
        return f"~{error_size(row.rms)}"
    return row.status.word.removesuffix(" samples") if row.rms is None else row.rms


def score_table(comparison: Comparison, rows: Sequence[Row], title: str = "") -> Table:
    """Return all numbers of rows of a comparison."""
    unit, has_paper = f"{comparison.rate_unit}/s", is_paper_campaign(comparison)
    names = list(comparison.rows[0].score.rms_by_axis) if comparison.rows else []
    columns = [
        *ROW,
        Column("n", meaning="number of coefficients", key="n_coefficients"),
        Column("rank", meaning="number of combinations of coefficients that the data determine"),
        Column(
            "error %",
            form=partial(error_size, decimals=1),
            meaning="relative error: mean error of the velocities that the test excites, in % of "
            "their motion, without the noise",
            key="relative_error",
        ),
        Column(
            "RMS",
            form=error_size,
            meaning=f"RMS velocity error of the open-loop replay, m/s and {unit} mixed, eq. 24",
            key=f"rms_{comparison.rate_unit}",
        ),
        Column("status", number=False, meaning="outcome of the fit and its replay"),
    ]
    if has_paper:
        meaning = "RMS error in Table I of the paper"
        columns.append(Column("paper", form=_paper_error, meaning=meaning, key="paper_rms"))
    for name in names:
        columns += _axis_columns(name, unit)
    errors = relative_errors(replace(comparison, rows=tuple(rows)))
    cells = (score_row(row, each, names, has_paper) for row, each in zip(rows, errors, strict=True))
    return Table(title, tuple(columns), tuple(cells))


def _axis_columns(name: str, rate: str) -> tuple[Column, Column]:
    unit = "m/s" if name in VELOCITIES[:3] else rate
    form = partial(error_size, decimals=4 if unit == "rad/s" else 3)
    error = f"RMS error of {name}, {unit}"
    share = f"fit of {name}: 100 % is exact, 0 % is no better than the mean of the log"
    return (
        Column(name, form=form, meaning=error, key=f"rms_{name}"),
        Column(f"{name} %", form=percent, meaning=share, key=f"fit_{name}"),
    )


def score_row(
    row: Row, relative: float, names: Sequence[str], has_paper: bool
) -> tuple[object, ...]:
    paper = getattr(PAPER_TABLE_I.get(row.model), PAPER_COLUMN.get(row.method, ""), None)
    error = relative if math.isfinite(relative) else None
    values = row.model, row.method, row.n_coefficients, row.fit.rank, error, row.rms
    return *values, row.status.word, *((paper,) if has_paper else ()), *_by_axis(row, names)


def _by_axis(row: Row, names: Iterable[str]) -> Iterator[float | None]:
    for name in names:
        yield row.score.rms_by_axis.get(name)
        yield row.score.fit_by_axis.get(name)


def axis_tables(comparison: Comparison) -> tuple[Table, ...]:
    """Return error and fit by velocity, one table per method."""
    unit, tables = f"{comparison.rate_unit}/s", []
    for method in comparison.methods:
        rows = [row for row in comparison.rows if row.method == method and row.rms is not None]
        if rows:
            names = list(rows[0].score.rms_by_axis)
            by_axis = [_axis_columns(name, unit) for name in names]
            columns = chain.from_iterable((error, replace(fit, name="%")) for error, fit in by_axis)
            title = f"{method} by axis: RMS error (m/s, {unit}), fit in %"
            cells = tuple((row.model, *_by_axis(row, names)) for row in rows)
            tables.append(Table(title, (Column("model", number=False), *columns), cells))
    return tuple(tables)


def replay_table(
    title: str,
    score: Score,
    predicted: Mapping[str, float | None] | None = None,
    extrapolated: Collection[str] = (),
) -> Table:
    """Return error, fit and predicted error of a replay by velocity, and the total error."""
    rate = f"{score.rate_unit}/s"
    rows = []
    for name, error in score.rms_by_axis.items():
        unit = "m/s" if name in VELOCITIES[:3] else rate
        cells = name, error_size(error), unit, percent(score.fit_by_axis[name])
        remark = " extrapolation" if name in extrapolated else ""
        rows.append((*cells, *([error_size(predicted[name]) + remark] if predicted else [])))
    rows.append(("all", error_size(score.rms), f"m/s, {rate}", *["-"] * (len(rows[0]) - 3)))
    notes = (score.status.value,) if score.diverged else ()
    columns = ("velocity", "RMS error", "unit", "fit %", *["predicted (95 %)"] * bool(predicted))
    return Table.of_words(title, columns, "lrlrr"[: len(columns)], rows, notes)


def format_horizon_error(score: HorizonScore) -> str:
    """Return the error, or the share of windows that diverged."""
    if score.n_diverged:
        return f"{max(100.0 * score.diverged_share, 1.0):.0f} % off"
    return error_size(score.score.rms)

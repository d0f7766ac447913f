"""Report of a batch: tables of groups, coefficients and change points, figures and a page."""

from __future__ import annotations

import hashlib
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.batch.batch import BatchResult, GroupFit
from hydrodamp.batch.groups import MIN_GROUPS, find_outlying_groups, group_reasons
from hydrodamp.files import as_json
from hydrodamp.identification.fit_files import fit_document
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.figures.style import (
    SERIES,
    coefficient_symbol,
    stacked_panels,
    with_style,
)
from hydrodamp.report.files import Picture
from hydrodamp.report.fit_tables import half_widths, standard_errors
from hydrodamp.report.page import Page, installed, render_page
from hydrodamp.report.pictures import draw_pictures
from hydrodamp.report.provenance import today
from hydrodamp.report.table import Column, Table, coefficient, to_csv
from hydrodamp.results import save_results
from hydrodamp.status import Status

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_PANELS, MAX_LISTED_GROUPS = 6, 3  # of a figure, and of a note
MAX_TICKS = 12  # of a figure
MIN_P_VALUE = 1e-6  # printed; smaller ones depend on the tails of the distribution

#: Why a method that reduces each log is used instead of the recommended one.
_REASON = ", which reduces each log once; `recommended` takes more than ten times as long"
REASONS = dict.fromkeys(("weak", "ls"), _REASON)

#: Patterns of the files that a batch may write, relative to its folder.
RESULT_FILES = ("coefficients.csv", "coefficients.parquet", "batch.html", "*.svg", "fits/*.json")


def batch_table(result: BatchResult) -> Table:
    """Return a row for each group and model, and the change points in the notes."""
    columns = (
        *(Column(_header(key), number=False) for key in result.by),
        Column("model", number=False),
        *(Column(name, form=str) for name in ("logs", "samples", "rank", "coefs")),
        Column("RMS", form="{:.3f}".format),
        Column("outcome", number=False),
    )
    rows = tuple(
        (
            *each.group,
            each.fit.model.key,
            *(each.n_logs, each.fit.n_samples, each.fit.rank, each.fit.model.n_coefficients),
            each.rms,
            each.fit.status.word,
        )
        for each in result.fits
    )
    return Table("Fits of groups of logs", columns, rows, (*_notes(result),))


def summary_tables(result: BatchResult) -> list[Table]:
    """Return the printed tables: all fits, and the change points if there are any."""
    changes = change_point_table(result)
    return [batch_table(result), *([changes] if changes.rows else [])]


def _header(key: str) -> str:
    return key if key in ("vehicle", "day", "month", "folder") else "group"


def _notes(result: BatchResult) -> Iterator[str]:
    yield (
        "RMS is the error of eq. 24 of a replay of each group's first log with a fit to its others."
    )
    if any(each.n_logs == 1 for each in result.fits):
        yield "RMS is `-` for a group of one log, which has no others."
    if result.order != "date":
        reason = ", as clocks that count from boot give none" if result.order == "name" else ""
        yield (
            f"Groups are in the order of their {result.order}s{reason}; change points are only "
            "estimated between days or months."
        )
    yield (
        "Standard errors and intervals include noise, but no bias that all logs share, such as "
        "that of noise in the velocities."
    )
    for name in result.changes:
        series = result.time_series[name]
        for index, labels in find_outlying_groups([each.fit for each in series]).items():
            yield (
                f"{name}: {' '.join(series[index].group)} is far from all other groups in "
                f"{' '.join(labels)} and is not part of the test for changes of these."
            )
    yield from _data_notes(result)
    yield from result.outliers
    for reason in group_reasons(result.failed):
        yield f"omitted: {reason}"


def batch_verdict(result: BatchResult) -> Iterator[str]:
    """Yield for each time series whether and when coefficients changed, the logs and the method."""
    for name, changes in result.changes.items():
        series = result.time_series[name]
        n = sum(each.fit.uncertainty is not None for each in series)
        if n < MIN_GROUPS:
            yield (
                f"{name}: a change point needs {MIN_GROUPS} groups with standard errors; this "
                f"series has {n}."
            )
        elif not changes:
            yield f"{name}: no coefficient has a change point."
        else:
            ((first, most),) = Counter(change.first for change in changes).most_common(1)
            yield (
                f"{name}: {len(changes)} of {series[0].fit.model.n_coefficients} coefficients have "
                f"a change point, {most} of them at {' '.join(series[first].group)}."
            )
    n_logs = {each.group: each.n_logs for each in result.fits}
    counts = {"log": sum(n_logs.values()), "group": len(n_logs)}
    logs, groups = (f"{n} {unit}{'s' * (n != 1)}" for unit, n in counts.items())
    yield f"{logs} in {groups}, {len(result.failed)} omitted."
    method = result.fits[0].fit.method
    yield f"Identified by `{method}`{REASONS.get(method, '')}."


def change_point_table(result: BatchResult) -> Table:
    """Return a row for each change point, the most significant of a time series first."""
    columns = (
        *(Column(name, number=False) for name in ("series", "coefficient", "from")),
        *(Column(name, form=coefficient) for name in ("before", "after")),
        Column("change", form="{:+.0%}".format),
        Column("p-value", form="{:.0e}".format),
    )
    rows = tuple(
        (
            *(name, change.label, " ".join(result.time_series[name][change.first].group)),
            *(change.before, change.after, change.relative_change),
            max(change.p_value, MIN_P_VALUE),
        )
        for name, changes in result.changes.items()
        for change in changes
    )
    note = "p-value: family-wise probability of so large a change in a series without a change."
    return Table("Change points", columns, rows, (note,))


def _data_notes(result: BatchResult) -> Iterator[str]:
    """Yield which groups have too little data."""
    problems = {
        "do not determine all coefficients: add logs, or select a smaller model": [
            each for each in result.fits if each.fit.status is Status.RANK_DEFICIENT
        ],
        "are too short for standard errors, which need two minutes of logs": [
            each for each in result.fits if each.fit.uncertainty is None
        ],
    }
    for problem, fits in problems.items():
        if fits:
            names = ", ".join(
                f"{' '.join((each.fit.model.key, *each.group))} ({each.fit.n_samples} samples)"
                for each in fits[:MAX_LISTED_GROUPS]
            )
            n_more = len(fits) - MAX_LISTED_GROUPS
            yield f"{names}{f' and {n_more} more' if n_more > 0 else ''} {problem}."


def coefficient_table(result: BatchResult) -> Table:
    """Return a row for each coefficient of each group, for other programs."""
    numbers = ("value", "standard_error", "low_noise_only", "high_noise_only")
    names = ("model", "coefficient", *numbers, "unit", "grade")
    fit_names = ("start", "logs", "samples", "rank", "rms", "outcome")
    rows = tuple(row for each in result.fits for row in _coefficient_rows(each))
    columns = tuple(Column(name) for name in (*map(_header, result.by), *names, *fit_names))
    return Table("Coefficients of groups of logs", columns, rows)


def _coefficient_rows(group: GroupFit) -> Iterator[tuple[Any, ...]]:
    fit = group.fit
    grades = [grade.word for grade in group.grades] or [""] * fit.model.n_coefficients
    values = fit.damping.coefficients.tolist()
    errors, halves = standard_errors(fit).tolist(), half_widths(fit).tolist()
    columns = zip(fit.model.labels, values, errors, halves, grades, strict=True)
    fit_values = (group.start, group.n_logs, fit.n_samples, fit.rank, group.rms, fit.status.word)
    for label, value, error, half, grade in columns:
        numbers = (value, error, value - half, value + half)
        unit = coefficient_unit(*read_label(label))
        yield (*group.group, fit.model.key, label, *numbers, unit, grade, *fit_values)


def write_batch(result: BatchResult, folder: Path) -> None:
    """Write the table as CSV and Parquet, a file for each fit, a figure a series, and a page."""
    table = to_csv(coefficient_table(result)).encode("utf-8")
    contents = {folder / "coefficients.csv": table}
    names = _file_names([(*each.group, each.fit.model.key) for each in result.fits])
    for each, name in zip(result.fits, names, strict=True):
        contents[folder / "fits" / f"{name}.json"] = as_json(fit_document(each.fit)).encode("utf-8")
    with suppress(ImportError):
        from pyarrow import csv, parquet

        stream = io.BytesIO()
        parquet.write_table(csv.read_csv(io.BytesIO(table)), stream)
        contents[folder / "coefficients.parquet"] = stream.getvalue()
    names = _file_names([(name,) for name in result.time_series])
    sketches = [
        (file, f"Coefficients of {name} with 95 % intervals; lines mark change points.", draw)
        for file, name in zip(names, result.time_series, strict=True)
        for draw in [partial(time_series_figure, result, name)]
    ]
    pictures, _ = draw_pictures(sketches, {})
    contents |= {folder / f"{each.name}.svg": each.svg for each in pictures}
    if installed():
        contents[folder / "batch.html"] = render_batch_page(result, pictures).encode("utf-8")
    save_results(contents, folder, RESULT_FILES)


def _file_names(keys: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a file name for each key; a digest distinguishes equal names."""
    names = [re.sub(r"[^\w.+-]+", "-", ".".join(key)) for key in keys]
    uses = Counter(name.casefold() for name in names)  # some file systems ignore case
    digests = (hashlib.sha256(repr(key).encode()).hexdigest()[:8] for key in keys)
    return [
        name if uses[name.casefold()] == 1 else f"{name}.{digest}"
        for name, digest in zip(names, digests, strict=True)
    ]


def render_batch_page(result: BatchResult, pictures: Sequence[Picture]) -> str:
    """Return the HTML page of a batch."""
    n_logs = {each.group: each.n_logs for each in result.fits}
    stamps = (each.fit.damping.vehicle for each in result.fits)
    vehicles = {stamp.name for stamp in stamps if stamp is not None}
    return render_page(
        Page(
            title="Damping of groups of logs",
            about={
                "vehicle": ", ".join(sorted(vehicles)),
                "log": f"{sum(n_logs.values())} logs by {', '.join(result.by)}",
                "date": today(),
                "units": "SI; RMS in m/s and deg/s",
            },
            notes=[" ".join(batch_verdict(result))],
            pictures=pictures,
            tables=summary_tables(result)[::-1],
            facts={"grouped by": ", ".join(result.by), "method": result.fits[0].fit.method},
        )
    )


@with_style
def time_series_figure(result: BatchResult, series: str) -> Figure:
    """Draw the time series of coefficients: those that changed, then the most precise.

    Parameters
    ----------
    result : BatchResult
        Groups in the order of time.
    series : str
        A key of ``result.time_series``.

    Returns
    -------
    figure : Figure
        A panel for each coefficient, with 95 % intervals; lines mark change points.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    groups, changes = result.time_series[series], result.changes.get(series, ())
    labels = groups[0].fit.model.labels
    errors, size = standard_errors(groups[0].fit), abs(groups[0].fit.damping.coefficients)
    relative = np.divide(errors, size, out=np.full_like(size, np.inf), where=size > 0.0)
    by_precision = [labels[index] for index in relative.argsort()]
    drawn = [*dict.fromkeys([*(change.label for change in changes), *by_precision])][:MAX_PANELS]
    figure, panels = stacked_panels(len(drawn), each=1.3)
    days = range(len(groups))
    style: dict[str, Any] = {"fmt": "o", "markersize": 3, "capsize": 2}
    for panel, label in zip(panels, drawn, strict=True):
        index = labels.index(label)
        values = [each.fit.damping.coefficients[index] for each in groups]
        halves = [half_widths(each.fit)[index] for each in groups]
        panel.errorbar(days, values, halves, color=SERIES[0], **style)
        for change in changes:
            if change.label == label:
                panel.plot([-0.4, change.first - 0.5], [change.before] * 2, color="black")
                end = len(groups) - 0.6
                panel.plot([change.first - 0.5, end], [change.after] * 2, color="black")
        unit = coefficient_unit(*read_label(label))
        panel.set_ylabel(f"{coefficient_symbol(label)}\n[{unit}]")
    step = -(-len(groups) // MAX_TICKS)
    names = [" ".join(each.group) for each in groups]
    panels[-1].set_xticks([*days][::step], names[::step], rotation=45, ha="right")
    return figure

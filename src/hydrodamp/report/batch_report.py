"""What a season of logs tells: a table of groups, every coefficient of each, and their course."""

from __future__ import annotations

import hashlib
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.batch.batch import BatchResult, GroupFit
from hydrodamp.batch.changepoints import MIN_GROUPS
from hydrodamp.errors import MethodError
from hydrodamp.files import as_json
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.documents import fit_document
from hydrodamp.report.figures.axes import coefficient_symbol
from hydrodamp.report.figures.style import colour_of, figure_bytes, stacked_panels, with_style
from hydrodamp.report.fit_tables import half_widths, standard_errors
from hydrodamp.report.page import installed, render_page
from hydrodamp.report.table import Column, Table, coefficient, to_csv
from hydrodamp.results import remove_results, save_results
from hydrodamp.simulation.status import Status

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Coefficients that are drawn, and groups that are named in a sentence.
_DRAWN, _SAID = 6, 3

_CAPTION = "Coefficients of {} with 95 % intervals; lines where one changed for good."


def batch_table(season: BatchResult) -> Table:
    """Return a row for each group and model, and what changed below."""
    columns = (
        *(Column(_header(one), number=False) for one in season.by),
        Column("model", number=False),
        *(Column(name, form=str) for name in ("logs", "samples", "rank", "coefs")),
        Column("RMS", form="{:.3f}".format),
        Column("outcome", number=False),
    )
    rows = tuple(
        (
            *one.group,
            one.fit.model.key,
            *(one.n_logs, one.fit.n_samples, one.fit.rank, one.fit.model.n_coefficients),
            one.rms,
            one.fit.status.word,
        )
        for one in season.fits
    )
    return Table("Fits of groups of logs", columns, rows, (*_notes(season),))


def summary_tables(season: BatchResult) -> list[Table]:
    """Return the tables that a reader sees: all fits, and what changed, if anything did."""
    changed = change_point_table(season)
    return [batch_table(season), *([changed] if changed.rows else [])]


def _header(by: str) -> str:
    return by if by in ("vehicle", "day", "month", "folder") else "group"


def _notes(season: BatchResult) -> Iterator[str]:
    yield (
        "RMS is the error of eq. 24 of a replay of each group's first log with a fit to its others."
    )
    if season.order != "date":
        reason = ", as clocks that count from boot give none" if season.order == "name" else ""
        yield (
            f"Groups are in the order of their {season.order}s{reason}; changes are looked for "
            "between days or months."
        )
    yield (
        "Standard errors and intervals allow for noise, not for bias that all logs share, such as "
        "that of noise in the velocities."
    )
    yield from _verdicts(season)
    yield from _thin(season)
    for log, reason in season.failed.items():
        yield f"left out: {log}: {reason}"


def _verdicts(season: BatchResult) -> Iterator[str]:
    """Say of each course whether it changed, and when most of it did."""
    for name, found in season.changes.items():
        course = season.time_series[name]
        n = sum(one.fit.uncertainty is not None for one in course)
        if n < MIN_GROUPS:
            yield (
                f"{name}: {n} group{'s' * (n != 1)} with standard errors are too few to tell a "
                f"change, which takes {MIN_GROUPS}."
            )
        elif not found:
            yield f"{name}: no coefficient changes for good."
        else:
            ((first, most),) = Counter(one.first for one in found).most_common(1)
            yield (
                f"{name}: {len(found)} of {course[0].fit.model.n_coefficients} coefficients change "
                f"for good, {most} of them from {' '.join(course[first].group)} on."
            )


def change_point_table(season: BatchResult) -> Table:
    """Return a row for each lasting change, the surest of a course first."""
    columns = (
        *(Column(name, number=False) for name in ("course", "coefficient", "from")),
        *(Column(name, form=coefficient) for name in ("before", "after")),
        Column("change", form="{:+.0%}".format),
        Column("chance", form="{:.0e}".format),
    )
    rows = tuple(
        (
            *(name, one.label, " ".join(season.time_series[name][one.first].group)),
            *(one.before, one.after, one.relative_change, max(one.p_value, 1e-6)),
        )
        for name, found in season.changes.items()
        for one in found
    )
    note = "Chance: how often so much would be seen, at most, in a season in which nothing changes."
    return Table("What changed for good", columns, rows, (note,))


def _thin(season: BatchResult) -> Iterator[str]:
    """Say of which groups there is too little."""
    some = {
        "do not tell all coefficients apart: log more of them, or take a smaller model": [
            one for one in season.fits if one.fit.status is Status.RANK_DEFICIENT
        ],
        "are too short for standard errors, which take two minutes of logs": [
            one for one in season.fits if one.fit.uncertainty is None
        ],
    }
    for what, fits in some.items():
        if fits:
            said = ", ".join(f"{_name(one)} ({one.fit.n_samples} samples)" for one in fits[:_SAID])
            more = f" and {len(fits) - _SAID} more" if len(fits) > _SAID else ""
            yield f"{said}{more} {what}."


def _name(one: GroupFit) -> str:
    return " ".join((one.fit.model.key, *one.group))


def coefficient_table(season: BatchResult) -> Table:
    """Return a row for each coefficient of each group, for other programs."""
    number = ("value", "standard_error", "low_noise_only", "high_noise_only")
    names = ("model", "coefficient", *number, "unit", "grade")
    more = ("start", "logs", "samples", "rank", "rms", "outcome")
    rows = tuple(row for one in season.fits for row in _rows(one))
    columns = tuple(Column(name) for name in (*map(_header, season.by), *names, *more))
    return Table("Coefficients of groups of logs", columns, rows)


def _rows(one: GroupFit) -> Iterator[tuple[Any, ...]]:
    fit = one.fit
    words = [grade.word for grade in one.grades]
    grades = words or [""] * fit.model.n_coefficients
    values = fit.damping.coefficients.tolist()
    errors, halves = standard_errors(fit).tolist(), half_widths(fit).tolist()
    each = zip(fit.model.labels, values, errors, halves, grades, strict=True)
    for label, value, error, half, grade in each:
        number = (value, error, value - half, value + half)
        unit = coefficient_unit(*read_label(label))
        told = (one.start, one.n_logs, fit.n_samples, fit.rank, one.rms, fit.status.word)
        yield (*one.group, fit.model.key, label, *number, unit, grade, *told)


#: Names of all files that a season may write, from its folder.
RESULT_FILES = ("coefficients.csv", "coefficients.parquet", "season.html", "*.svg", "fits/*.json")


def write_batch(season: BatchResult, folder: Path) -> None:
    """Write the table as CSV and Parquet, a file for each fit, a picture a course, and a page."""
    contents = {folder / "coefficients.csv": to_csv(coefficient_table(season)).encode("utf-8")}
    names = _file_names([(*one.group, one.fit.model.key) for one in season.fits])
    for one, name in zip(season.fits, names, strict=True):
        contents[folder / "fits" / f"{name}.json"] = as_json(fit_document(one.fit)).encode("utf-8")
    with suppress(ImportError):
        from pyarrow import csv, parquet

        table = io.BytesIO()
        parquet.write_table(csv.read_csv(io.BytesIO(next(iter(contents.values())))), table)
        contents[folder / "coefficients.parquet"] = table.getvalue()
    pictures = {}
    with suppress(MethodError):
        pictures = {
            name: figure_bytes(time_series_figure(season, name), "svg")
            for name in season.time_series
        }
    names = _file_names([(name,) for name in pictures])
    contents |= {
        folder / f"{name}.svg": one for name, one in zip(names, pictures.values(), strict=True)
    }
    if installed():
        contents[folder / "season.html"] = render_batch_page(season, pictures).encode("utf-8")
    remove_results(folder, RESULT_FILES, keep=contents)
    save_results(contents, folder)


def _file_names(keys: Sequence[tuple[str, ...]]) -> list[str]:
    """Return a file name for each key; a digest tells keys apart that would share one."""
    names = [re.sub(r"[^\w.+-]+", "-", ".".join(key)) for key in keys]
    uses = Counter(name.casefold() for name in names)  # some file systems ignore case
    digests = (hashlib.sha256(repr(key).encode()).hexdigest()[:8] for key in keys)
    return [
        name if uses[name.casefold()] == 1 else f"{name}.{digest}"
        for name, digest in zip(names, digests, strict=True)
    ]


def render_batch_page(season: BatchResult, pictures: dict[str, bytes]) -> str:
    """Return the page of a season."""
    import hydrodamp

    n_logs = {one.group: one.n_logs for one in season.fits}
    counted = f"{sum(n_logs.values())} logs in {len(n_logs)} groups, {len(season.failed)} left out."
    return render_page(
        "Damping of groups of logs",
        "One fit per group, and the changes between groups",
        [" ".join((counted, *_verdicts(season)))],
        summary_tables(season)[::-1],
        [(_CAPTION.format(name), picture) for name, picture in pictures.items()],
        {
            "grouped by": ", ".join(season.by),
            "method": season.fits[0].fit.method,
            "made by": f"hydrodamp {hydrodamp.__version__}",
        },
    )


@with_style
def time_series_figure(season: BatchResult, course: str) -> Figure:
    """Draw the course of coefficients: those that changed, else the best known.

    Parameters
    ----------
    season : Season
        Groups in the order of time.
    course : str
        One of ``season.courses``.

    Returns
    -------
    figure : Figure
        A panel each, with 95 % intervals; a line where one changed for good.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    groups, changed = season.time_series[course], season.changes.get(course, ())
    labels = groups[0].fit.model.labels
    errors, size = standard_errors(groups[0].fit), abs(groups[0].fit.damping.coefficients)
    shares = np.divide(errors, size, out=np.full_like(size, np.inf), where=size > 0.0)
    best = [labels[place] for place in shares.argsort()]
    chosen = [*dict.fromkeys([*(one.label for one in changed), *best])][:_DRAWN]
    figure, panels = stacked_panels(len(chosen), each=1.3)
    days = range(len(groups))
    for panel, label in zip(panels, chosen, strict=True):
        place = labels.index(label)
        values = [one.fit.damping.coefficients[place] for one in groups]
        halves = [half_widths(one.fit)[place] for one in groups]
        panel.errorbar(
            days, values, halves, fmt="o", markersize=3, capsize=2, color=colour_of("weak")
        )
        for one in changed:
            if one.label == label:
                panel.plot([-0.4, one.first - 0.5], [one.before] * 2, color="black")
                panel.plot([one.first - 0.5, len(groups) - 0.6], [one.after] * 2, color="black")
        unit = coefficient_unit(*read_label(label))
        panel.set_ylabel(f"{coefficient_symbol(label)}\n[{unit}]")
    step = -(-len(groups) // 12)
    panels[-1].set_xticks(
        [*days][::step],
        [" ".join(one.group) for one in groups][::step],
        rotation=45,
        ha="right",
    )
    return figure

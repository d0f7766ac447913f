"""What a season of logs tells: a table of groups, every coefficient of each, and their course."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydrodamp.batch.drift import FEWEST
from hydrodamp.batch.season import GroupFit, Season
from hydrodamp.errors import MethodError
from hydrodamp.files import as_json, save_all
from hydrodamp.models.model import coefficient_unit, read_label
from hydrodamp.report.documents import fit_document
from hydrodamp.report.figures.axes import coefficient_symbol
from hydrodamp.report.figures.look import colour_of, figure_bytes, in_our_look, stacked
from hydrodamp.report.fit_tables import half_widths, standard_errors
from hydrodamp.report.grid import Column, Grid, to_csv

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Coefficients that are drawn.
_DRAWN = 6


def season_grid(season: Season) -> Grid:
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
    return Grid("Fits of groups of logs", columns, rows, (*_notes(season),))


def _header(by: str) -> str:
    return by if by in ("vehicle", "day", "month", "folder") else "group"


def _notes(season: Season) -> Iterator[str]:
    yield (
        "RMS is the error of eq. 24 of a replay of each group's first log with a fit to its others."
    )
    for model, found in season.changes.items():
        for one in found:
            first = " ".join(_of(season, model)[one.first].group)
            yield (
                f"{model}: {one.label} changes by {one.share:+.0%} from {first} on: "
                f"{one.before:.4g} before, {one.after:.4g} after; where nothing changes so much "
                f"is seen with a chance of {max(one.chance, 1e-6):.1g} at most."
            )
        if (n := len(_of(season, model))) < FEWEST:
            yield f"{model}: {n} groups are too few to tell a change, which takes {FEWEST}."
        elif not found:
            yield f"{model}: no coefficient changes for good."
    for log, reason in season.failed.items():
        yield f"left out: {log}: {reason}"


def _of(season: Season, model: str) -> list[GroupFit]:
    return [one for one in season.fits if one.fit.model.key == model]


def coefficients_grid(season: Season) -> Grid:
    """Return a row for each coefficient of each group, for other programs."""
    names = ("model", "coefficient", "value", "standard_error", "low", "high", "unit", "grade")
    more = ("start", "logs", "samples", "rank", "rms", "outcome")
    rows = tuple(row for one in season.fits for row in _rows(one))
    columns = tuple(Column(name) for name in (*map(_header, season.by), *names, *more))
    return Grid("Coefficients of groups of logs", columns, rows)


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


def write_season(season: Season, folder: Path) -> None:
    """Write the table as CSV and Parquet, a damping file for each fit, and a picture a model."""
    contents = {folder / "coefficients.csv": to_csv(coefficients_grid(season)).encode("utf-8")}
    for one in season.fits:
        name = re.sub(r"[^\w.+-]+", "-", ".".join((*one.group, one.fit.model.key)))
        contents[folder / "fits" / f"{name}.json"] = as_json(fit_document(one.fit)).encode("utf-8")
    with suppress(ImportError):
        from pyarrow import csv, parquet

        table = io.BytesIO()
        parquet.write_table(csv.read_csv(io.BytesIO(next(iter(contents.values())))), table)
        contents[folder / "coefficients.parquet"] = table.getvalue()
    with suppress(MethodError):
        for model in dict.fromkeys(one.fit.model.key for one in season.fits):
            contents[folder / f"{model}.svg"] = figure_bytes(season_figure(season, model), "svg")
    save_all(contents)


@in_our_look
def season_figure(season: Season, model: str) -> Figure:
    """Draw the course of a model's coefficients: those that changed, else the best known.

    Parameters
    ----------
    season : Season
        Groups in the order of time.
    model : str
        The model's key.

    Returns
    -------
    figure : Figure
        A panel each, with 95 % intervals; a line where one changed for good.

    Raises
    ------
    MethodError
        If matplotlib is not installed.
    """
    groups, changed = _of(season, model), season.changes.get(model, ())
    labels = groups[0].fit.model.labels
    known = standard_errors(groups[0].fit) / abs(groups[0].fit.damping.coefficients)
    best = [labels[place] for place in known.argsort()]
    chosen = [*dict.fromkeys([*(one.label for one in changed), *best])][:_DRAWN]
    figure, panels = stacked(len(chosen), each=1.0)
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

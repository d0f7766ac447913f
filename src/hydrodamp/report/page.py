"""HTML pages, one self-contained file each; among them the report of a comparison."""

from __future__ import annotations

import base64
import hashlib
import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.report.comparison_tables import score_table
from hydrodamp.report.documents import provenance_of
from hydrodamp.report.figures.axes import Bins, clock, shown_velocities, velocity_unit
from hydrodamp.report.figures.style import colour_of, line_styles
from hydrodamp.report.files import ReportContent, read_comparison, read_content
from hydrodamp.report.fit_tables import fit_table
from hydrodamp.report.narrative import remarks, verdict
from hydrodamp.report.pictures import band_caption
from hydrodamp.report.table import Table
from hydrodamp.results import save_result
from hydrodamp.validation.compare import Comparison, Row, rms_or_infinity
from hydrodamp.validation.diagnostics import PredictionBand, find_selected_row

if TYPE_CHECKING:
    from jinja2 import Environment, Template

NEEDS_JINJA = 'HTML reports need the package jinja2: pip install "hydrodamp[report]"'

MAX_REPLAYS = 32  # replays drawn, those with the lowest errors
MAX_VALUES = 750_000  # values of all series together, 2 MB as text
MAX_POINTS = 20_000  # points of one series
QUANTISATION_STEPS = 65_000  # steps of the range of a series, as uint16
MISSING_STEP = 65_535  # step of a missing value
LINE_WIDTH = 1.5  # px

_SCRIPTS = ("theme.js", "sorting.js", "uplot.js", "plots.js")


def installed() -> bool:
    """Return whether the packages of a report are installed."""
    return find_spec("jinja2") is not None


def write_report(
    results: Comparison | str | os.PathLike[str],
    path: str | os.PathLike[str],
    content: ReportContent | None = None,
) -> Path:
    """Write a comparison as one self-contained HTML file.

    Parameters
    ----------
    results : Comparison or path
        A comparison, or the folder it was written to. Nothing is fitted again.
    path : str or path
        The file; written whole or not at all.
    content : ReportContent, optional
        Grades, band and pictures of the selected row; by default those in the folder, if any.

    Returns
    -------
    path : Path
        The file.

    Raises
    ------
    FileError
        If the folder is none of a comparison, or the file cannot be written.
    MethodError
        If jinja2 is not installed.
    """
    comparison = results if isinstance(results, Comparison) else read_comparison(results)
    if content is None and not isinstance(results, Comparison):
        content = read_content(Path(results), comparison)
    save_result(comparison_page(comparison, content), Path(path))
    return Path(path)


def comparison_page(comparison: Comparison, content: ReportContent | None = None) -> str:
    """Return the report of a comparison."""
    return _template("report.html.j2").render(_variables(comparison, content or ReportContent()))


def _variables(comparison: Comparison, content: ReportContent) -> dict[str, object]:
    """Return the variables of the template."""
    selected, grades, unit = (
        find_selected_row(comparison),
        content.identifiability,
        comparison.rate_unit,
    )
    by_error = sorted(comparison.rows, key=lambda row: (rms_or_infinity(row), row.n_coefficients))
    order = sorted(by_error, key=lambda row: (row.rms is None, not row.converged))
    plots = series(comparison, order, content.band)
    warnings = comparison.provenance.get("warnings", "").splitlines()
    segments = comparison.provenance.get("test_segments")
    return {
        "comparison": comparison,
        "subtitle": f"Replayed on {segments}" if segments else "",
        "title": f"Damping of {comparison.provenance.get('vehicle') or 'a vehicle'}",
        "methods": {
            method: (f"m{index}", colour_of(method))
            for index, method in enumerate(comparison.methods)
        },
        "verdict": verdict(comparison, grades),
        "warnings": [*map(str.strip, warnings), *remarks(comparison)],
        "scores": score_table(
            comparison,
            by_error,
            f"Error of each replay: RMS of velocities in m/s and {unit}/s, and fit in %",
        ),
        "sorted_rows": by_error,
        "selected": selected,
        "series": plots,
        "coefficients": [
            (row, fit_table(row.fit, grades if row is selected else None))
            for row in order
            if row.fit.status.usable
        ],
        "pictures": content.pictures,
        "not_shown": content.not_shown,
        "origin": _origin(comparison),
        "scripts": [text_of(name) for name in _SCRIPTS[: None if plots else 2]],
        "styles": text_of("report.css"),
        "plot_styles": text_of("uplot.css"),
        "licence": text_of("uplot.LICENSE"),
    }


def render_page(
    title: str,
    subtitle: str,
    notes: Iterable[str],
    tables: Iterable[Table],
    figures: Iterable[tuple[str, bytes]] = (),
    facts: Mapping[str, str] | None = None,
    facts_title: str = "Provenance",
) -> str:
    """Return a page of a verdict, tables, captioned SVG figures and a list of facts."""
    return _template("page.html.j2").render(
        title=title,
        subtitle=subtitle,
        notes=notes,
        tables=tables,
        figures=figures,
        facts=facts or {},
        facts_title=facts_title,
        styles=text_of("report.css"),
    )


def _template(name: str) -> Template:
    if not installed():
        raise MethodError(NEEDS_JINJA)
    return _environment().get_template(name)


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("hydrodamp.report", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode("ascii")
    environment.filters["sha256"] = lambda script: hashlib.sha256(script.encode()).digest()
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    return environment


@cache
def text_of(name: str) -> str:
    """Return the text of an asset."""
    return files("hydrodamp.report").joinpath("assets", name).read_text(encoding="utf-8")


def _origin(comparison: Comparison) -> dict[str, object]:
    """Return the provenance of a comparison: vehicle, files, versions and settings."""
    import hydrodamp

    texts = {key: text for key, text in provenance_of(comparison).items() if text}
    files = [line.strip().partition("  ") for line in texts.pop("files", "").splitlines()]
    facts = [(key.replace("_", " "), text) for key, text in texts.items() if key != "warnings"]
    version = f"hydrodamp {hydrodamp.__version__}, Python {platform.python_version()}"
    read = [(name or digest, digest if name else "") for digest, _, name in files]
    settings = {row.method: row.fit.provenance.get("settings") for row in comparison.rows[::-1]}
    used = [(method, settings[method]) for method in comparison.methods if settings[method]]
    return {
        "facts": (*facts, ("report made by", version)),
        "files": Table.of_words("Input files", ("file", "SHA-256"), "ll", read),
        "settings": Table.of_words("Settings of the methods", ("method", "settings"), "ll", used),
    }


def series(
    comparison: Comparison, rows: Sequence[Row], band: PredictionBand | None = None
) -> dict[str, Any] | None:
    """Return the data and captions of the time-series plots, rows in order of preference."""
    runs = [(row, row.trajectory) for row in rows if row.trajectory is not None]
    if not runs:
        return None
    shown_runs, log, selected = runs[:MAX_REPLAYS], runs[0][1].log, find_selected_row(comparison)
    names, unit = tuple(runs[0][0].score.rms_by_axis), comparison.rate_unit
    n_series = len(names) * (1 + len(shown_runs) + 2 * (band is not None))
    bins, time = Bins.over(log.bounds, min(MAX_VALUES // n_series, MAX_POINTS)), clock(log)

    def packed(velocity: FloatArray) -> list[dict[str, object]]:
        return [_pack(bins.values(shown_velocities(velocity, name, unit))) for name in names]

    styles = line_styles([(row.model, row.method) for row, _ in shown_runs])
    band_entry, caption, edges = None, "", []
    if band is not None and selected is not None:
        band_entry = {
            "name": f"{100.0 * band.level:.0f} % band of {selected.model} by {selected.method}",
            "method": selected.method,
            "colour": colour_of(selected.method),
        }
        caption = band_caption(selected)
        edges = [packed(band.lower), packed(band.upper)]
    document = {
        "velocities": [{"name": name, "unit": velocity_unit(name, unit)} for name in names],
        "segments": [
            {"name": segment.name, "start": time[segment.start], "stop": time[segment.stop - 1]}
            for segment in log.segments
        ],
        "replays": [
            {
                "name": f"{row.model} by {row.method}",
                "method": row.method,
                "colour": style.colour,
                "dashes": [round(LINE_WIDTH * length, 1) for length in style.dashes],
            }
            for (row, _), style in zip(shown_runs, styles, strict=True)
        ],
        "band": band_entry,
        "time": _base64(bins.times(time).astype("<f8")),
        "series": [packed(log.velocity), *(packed(run.velocity) for _, run in shown_runs)],
        "edges": edges,
    }
    return {
        "document": document,
        "band_caption": caption,
        "left_out": len(runs) - len(shown_runs),
        "is_thinned": not bins.is_exact,
    }


def _pack(values: FloatArray) -> dict[str, object]:
    """Return a series quantised to uint16 steps of its range."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    step = (high - low) / QUANTISATION_STEPS or 1.0
    counts = np.where(np.isfinite(values), np.rint((values - low) / step), MISSING_STEP)
    return {"low": low, "step": step, "steps": _base64(counts.astype("<u2"))}


def _base64(array: np.ndarray) -> str:
    return base64.b64encode(array.tobytes()).decode("ascii")

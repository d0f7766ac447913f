"""HTML pages of results, one self-contained file each, all of one template."""

from __future__ import annotations

import base64
import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydrodamp.errors import MethodError
from hydrodamp.identification.identifiability import Identifiability
from hydrodamp.report.comparison_tables import score_table
from hydrodamp.report.documents import comparison_document
from hydrodamp.report.figures.style import model_colours
from hydrodamp.report.files import Picture, ReportContent, read_comparison, read_content
from hydrodamp.report.fit_tables import fit_table
from hydrodamp.report.forest import forest_rows
from hydrodamp.report.narrative import describe_data, explain_failure, remarks
from hydrodamp.report.provenance import (
    Track,
    describe_run,
    horizontal_track,
    provenance_facts,
    provenance_tables,
    timeline,
    true_coefficients,
)
from hydrodamp.report.series import replay_series
from hydrodamp.report.table import Table, to_html
from hydrodamp.report.verdict_tables import best_by_model, selection_cells
from hydrodamp.results import save_result
from hydrodamp.validation.compare import Comparison, Row
from hydrodamp.validation.diagnostics import find_selected_row
from hydrodamp.validation.selection import relative_errors

if TYPE_CHECKING:
    from jinja2 import Environment

NEEDS_JINJA = 'HTML reports need the package jinja2: pip install "hydrodamp[report]"'


#: Rows of a table that is shown at once; longer ones are folded.
MAX_OPEN_ROWS = 12

_SCRIPTS = ("theme.js", "sorting.js", "downloads.js", "uplot.js", "plots.js")


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


@dataclass(frozen=True, kw_only=True)
class Page:
    """Content of a page: header, verdict, sections, provenance; `run` has those of a comparison."""

    title: str
    about: Mapping[str, str | None]
    notes: Sequence[str] = ()
    track: Track | None = None
    series: dict[str, Any] | None = None
    pictures: Sequence[Picture] = ()
    not_shown: Sequence[str] = ()
    tables: Sequence[Table] = ()
    facts: Mapping[str, str] = field(default_factory=dict)
    sources: Sequence[Table] = ()
    run: Mapping[str, Any] | None = None

    @property
    def contents(self) -> dict[str, str]:
        """The sections with their headings."""
        is_shown = {
            ("verdict", "Verdict"): True,
            ("series", "Time series"): self.series,
            ("coefficients", "Coefficients"): self.run and self.run["coefficients"],
            ("scores", "Scores"): self.run,
            ("pictures", "Pictures"): self.pictures or self.not_shown,
            ("numbers", "Numbers"): self.tables,
            ("origin", "Provenance"): True,
        }
        return dict(section for section, content in is_shown.items() if content)


def render_page(page: Page) -> str:
    """Return a page as HTML."""
    if not installed():
        raise MethodError(NEEDS_JINJA)
    scripts = _SCRIPTS[: None if page.series else -2]
    return (
        page_environment("hydrodamp.report")
        .get_template("page.html.j2")
        .render(
            _variables(page),
            scripts=[*map(text_of, scripts)],
            styles=[*map(text_of, ["uplot.css"] * bool(page.series) + ["report.css"])],
            licence=text_of("uplot.LICENSE"),
        )
    )


def _variables(page: Page) -> dict[str, Any]:
    """Return the variables of the sections of a page."""
    facts = {**page.facts, **provenance_facts()}
    variables = {"page": page, "run": page.run, "series": page.series, "facts": facts}
    return variables | {"max_rows": MAX_OPEN_ROWS}


def comparison_page(comparison: Comparison, content: ReportContent | None = None) -> str:
    """Return the report of a comparison."""
    return render_page(_comparison_content(comparison, content or ReportContent()))


def read_sections(folder: Path) -> dict[str, Any]:
    """Return the sections of the report of a folder of results as HTML, with their variables."""
    comparison = read_comparison(folder)
    page = _comparison_content(comparison, read_content(folder, comparison))
    sections = page_environment("hydrodamp.report").get_template("sections.html.j2")
    return {"sections": sections.render(_variables(page)), "series": page.series, "run": page.run}


def _comparison_content(comparison: Comparison, content: ReportContent) -> Page:
    """Return the content of the report of a comparison."""
    selected, unit, provenance = (
        find_selected_row(comparison),
        comparison.rate_unit,
        comparison.provenance,
    )
    pairs = zip(relative_errors(comparison), comparison.rows, strict=True)
    by_error = [row for _, row in sorted(pairs, key=lambda pair: (pair[0], pair[1].n_coefficients))]
    order = sorted(
        by_error, key=lambda row: (row is not selected, row.rms is None, not row.converged)
    )
    log = None if selected is None or selected.trajectory is None else selected.trajectory.log
    origin = provenance_tables(comparison, selected)
    title = f"Damping of {provenance.get('vehicle') or 'a vehicle'}"
    about = {
        "vehicle": provenance.get("vehicle"),
        "log": describe_run(comparison, selected),
        "date": provenance.get("date"),
        "units": f"SI, FRD and NED; angular rates in {unit}/s",
    }
    return Page(
        title=title,
        about=about,
        track=horizontal_track(log),
        series=replay_series(comparison, order, content.band),
        pictures=content.pictures,
        not_shown=content.not_shown,
        facts=origin.facts,
        sources=(origin.files, origin.settings),
        run=_run_variables(comparison, content.identifiability, by_error, order),
    )


def _run_variables(
    comparison: Comparison,
    grades: Identifiability | None,
    by_error: Sequence[Row],
    order: Sequence[Row],
) -> dict[str, Any]:
    """Return the variables of the sections of a comparison."""
    selected = find_selected_row(comparison)
    warnings = comparison.provenance.get("warnings", "").splitlines()
    usable = [row for row in order if row.fit.status.usable]
    verdict = comparison.verdict() if selected else None
    lines = () if verdict is None else verdict.lines
    tables = [(row, fit_table(row.fit, grades if row is selected else None)) for row in usable]
    best = [row for row, _ in best_by_model(usable, comparison.select() if selected else None)]
    fits = sorted((row for row in best if row.n_coefficients), key=lambda row: row is not selected)
    truth, unit = true_coefficients(comparison), comparison.rate_unit
    names = {model: f"m{index}" for index, model in enumerate(comparison.models)}

    def row_attributes(row: Row) -> dict[str, str]:
        is_chosen = {"aria-current": "true"} if row is selected else {}
        return {"class": f"model {names[row.model]}{' chosen' * bool(is_chosen)}", **is_chosen}

    scores = f"Error of each replay: relative in %, RMS in m/s and {unit}/s, and fit in %"
    return {
        "colours": {names[key]: value for key, value in model_colours(comparison.models).items()},
        "classes": names,
        "verdict": verdict,
        "failure": explain_failure(comparison),
        "summary": selection_cells(comparison),
        "has_methods": len(comparison.methods) > 1,
        "warnings": [*map(str.strip, warnings), *remarks(comparison)],
        "scores": score_table(comparison, by_error, scores),
        "score_rows": [*map(row_attributes, by_error)],
        "selected": selected,
        "timeline": timeline(comparison, selected),
        "data": describe_data(comparison),
        "document": comparison_document(comparison),
        "forest_fits": fits,
        "selected_forest": forest_rows([fits[0].fit], truth) if fits else (),
        "forest": forest_rows([row.fit for row in fits], truth) if len(fits) > 1 else (),
        "has_truth": bool(truth),
        "coefficients": [
            (row, table.omit_notes(lines) if row is selected else table, grade_attributes(table))
            for row, table in tables
        ],
    }


def grade_attributes(table: Table) -> list[dict[str, str]]:
    """Return the axis and the grade of each coefficient of a fit, by which its row is filtered."""
    if table.columns[-1].name != "grade":
        return []
    rows = ((row[0], row[-1].partition(":")[0]) for row in table.words)
    return [{"data-axis": label[0], "data-grade": grade} for label, grade in rows]


@cache
def page_environment(package: str) -> Environment:
    """Return the environment of the templates of HTML pages in the assets of a package."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader(package, "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode("ascii")
    environment.filters["sha256"] = lambda script: hashlib.sha256(script.encode()).digest()
    environment.filters["html"] = lambda *args, **names: Markup(to_html(*args, **names))
    environment.policies["json.dumps_kwargs"] = {"allow_nan": False, "separators": (",", ":")}
    return environment


@cache
def content_policy() -> str:
    """Return the Content-Security-Policy under which only the scripts of our own pages run."""
    digests = (hashlib.sha256(text_of(name).encode()).digest() for name in _SCRIPTS)
    sources = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    return (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {sources}; "
        "base-uri 'none'; form-action 'none'"
    )


@cache
def text_of(name: str) -> str:
    """Return the text of an asset."""
    return files("hydrodamp.report").joinpath("assets", name).read_text(encoding="utf-8")

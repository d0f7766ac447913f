"""HTML pages, one self-contained file each: report of a comparison, fidelity of an export."""

from __future__ import annotations

import base64
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hydrodamp.errors import FileError, MethodError
from hydrodamp.files import load_json
from hydrodamp.report.comparison_tables import score_table
from hydrodamp.report.documents import comparison_document
from hydrodamp.report.figures.style import model_colours
from hydrodamp.report.files import ReportContent, read_comparison, read_content
from hydrodamp.report.fit_tables import fit_table
from hydrodamp.report.forest import forest_rows
from hydrodamp.report.narrative import describe_data, explain_failure, remarks
from hydrodamp.report.pictures import series
from hydrodamp.report.provenance import (
    describe_run,
    provenance_facts,
    provenance_tables,
    timeline,
    track_points,
    true_coefficients,
)
from hydrodamp.report.table import NOTHING, Table
from hydrodamp.report.verdict_tables import best_by_model, selection_cells
from hydrodamp.results import save_result
from hydrodamp.validation.compare import Comparison
from hydrodamp.validation.diagnostics import find_selected_row
from hydrodamp.validation.selection import relative_errors

if TYPE_CHECKING:
    from jinja2 import Environment, Template

NEEDS_JINJA = 'HTML reports need the package jinja2: pip install "hydrodamp[report]"'

CARD, PAGE = "fidelity.json", "fidelity.html"
"""The card in the folder of an export, and its page."""

_FORMAT = "hydrodamp-fidelity"

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


def comparison_page(comparison: Comparison, content: ReportContent | None = None) -> str:
    """Return the report of a comparison."""
    return _template("report.html.j2").render(_variables(comparison, content or ReportContent()))


def _variables(comparison: Comparison, content: ReportContent) -> dict[str, object]:
    """Return the variables of the template."""
    selected, grades = find_selected_row(comparison), content.identifiability
    unit, provenance = comparison.rate_unit, comparison.provenance
    errors = zip(relative_errors(comparison), comparison.rows, strict=True)
    pairs = sorted(errors, key=lambda pair: (pair[0], pair[1].n_coefficients))
    by_error = [row for _, row in pairs]
    order = sorted(
        by_error, key=lambda row: (row is not selected, row.rms is None, not row.converged)
    )
    plots = series(comparison, order, content.band)
    warnings = provenance.get("warnings", "").splitlines()
    usable = [row for row in order if row.fit.status.usable]
    selection = comparison.select() if selected else None
    verdict = comparison.verdict() if selected else None
    lines = () if verdict is None else verdict.lines
    tables = [(row, fit_table(row.fit, grades if row is selected else None)) for row in usable]
    best = [row for row, _ in best_by_model(usable, selection) if row.n_coefficients]
    forest_fits = sorted(best, key=lambda row: row is not selected)
    truth = true_coefficients(comparison)
    colours = enumerate(model_colours(comparison.models).items())
    scores = f"Error of each replay: relative in %, RMS in m/s and {unit}/s, and fit in %"
    return {
        "comparison": comparison,
        "subtitle": describe_run(comparison, selected),
        "title": f"Damping of {provenance.get('vehicle') or 'a vehicle'}",
        "colours": {model: (f"m{index}", colour) for index, (model, colour) in colours},
        "verdict": verdict,
        "failure": explain_failure(comparison),
        "summary": selection_cells(comparison),
        "warnings": [*map(str.strip, warnings), *remarks(comparison)],
        "scores": score_table(comparison, by_error, scores),
        "sorted_rows": by_error,
        "selected": selected,
        "series": plots,
        "timeline": timeline(comparison, selected),
        "data": describe_data(comparison),
        "track": track_points(selected),
        "document": comparison_document(comparison),
        "forest_fits": forest_fits,
        "forest": forest_rows([row.fit for row in forest_fits], truth) if forest_fits else (),
        "has_truth": bool(truth),
        "max_rows": MAX_OPEN_ROWS,
        "coefficients": [
            (row, table.omit_notes(lines) if row is selected else table) for row, table in tables
        ],
        "pictures": content.pictures,
        "not_shown": content.not_shown,
        "origin": provenance_tables(comparison, selected),
        "scripts": [text_of(name) for name in _SCRIPTS[: None if plots else 3]],
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
        facts={**(facts or {}), **provenance_facts()},
        facts_title=facts_title,
        max_rows=MAX_OPEN_ROWS,
        scripts=[text_of("theme.js")],
        styles=text_of("report.css"),
    )


def _template(name: str) -> Template:
    if not installed():
        raise MethodError(NEEDS_JINJA)
    return page_environment("hydrodamp.report").get_template(name)


@cache
def page_environment(package: str) -> Environment:
    """Return the environment of the templates of HTML pages in the assets of a package."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader(package, "assets"),
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


def read_card(folder: Path) -> dict[str, Any]:
    """Return the card in the folder of an export."""
    document = load_json(folder / CARD)
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise FileError(
            f"{folder / CARD}: `format` must be '{_FORMAT}': export again with `hydrodamp export`."
        )
    return document


def write_fidelity_page(folder: Path, path: Path | None = None) -> Path:
    """Write the page of an export's card, by default into its folder."""
    document, page_path = read_card(folder), path or folder / PAGE
    html = render_page(
        f"{document['vehicle']} for {document['target']}",
        "Fidelity of the export",
        [document["text"]],
        [*_card_tables(document)],
        facts=_card_facts(document),
    )
    save_result(html, page_path)
    return page_path


def _card_tables(card: dict[str, Any]) -> Iterator[Table]:
    errors = {
        "wrench error [% of rms]": card["wrench_error"],
        "at a tenth of the velocities": card.get("slow_error", {}),
        "added mass / rigid-body mass": card["mass_ratio"],
    }
    yield _merge_columns(f"By axis, at {card['asked_at']}", "axis", errors)
    if replays := card["replays"]:
        pairs = ("source", "target"), ("source", "log"), ("target", "log")
        scores = {f"{a} and {b}": replays[f"{a}_to_{b}"] for a, b in pairs}
        rms = {key: {"all": score["rms"], **score["rms_by_axis"]} for key, score in scores.items()}
        title = f"Replay RMS in m/s and deg/s. {replays['step']}."
        yield _merge_columns(title, "velocity", rms)
    power = {f"of the {key}": value for key, value in card["power"].items()}
    title = f"Greatest power of the damping within {card['box']}"
    yield _merge_columns(title, "damping", {"[W]": power})


def _merge_columns(
    title: str, first: str, columns: Mapping[str, Mapping[str, float | None]]
) -> Table:
    """Return a table of numbers by name, one column each."""
    names = dict.fromkeys(name for values in columns.values() for name in values)
    rows = (
        (name, *(_format_number(values.get(name)) for values in columns.values())) for name in names
    )
    return Table.of_words(title, (first, *columns), "l" + "r" * len(columns), rows)


def _card_facts(card: dict[str, Any]) -> dict[str, str]:
    facts = {
        "written for": card["description"],
        "model": card["model"],
        "inputs": card["inputs"],
        "projected terms": card["projected"],
        "unrepresented effects": card["ignores"],
        "run by": card["run_by"],
        "not run": card["not_run"],
        "failed": card.get("run_error", ""),
        **card["settings"],
        "exported by": f"hydrodamp {card['hydrodamp']}",
    }
    texts = {key: [fact] if isinstance(fact, str) else fact for key, fact in facts.items()}
    return {key: ", ".join(text) for key, text in texts.items() if any(text)}


def _format_number(value: float | None) -> str:
    return NOTHING if value is None else format(value, ".3g")

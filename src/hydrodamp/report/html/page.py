"""The page itself: template, styles, scripts and data in one text."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from typing import TYPE_CHECKING

from hydrodamp.errors import MethodError
from hydrodamp.report.figures.look import colour_of
from hydrodamp.report.gallery.findings import Findings, chosen_row
from hydrodamp.report.html import coefficient_tables as coefficients
from hydrodamp.report.html.origin import origin, told
from hydrodamp.report.html.packing import script_json
from hydrodamp.report.html.pictures import pictures_section
from hydrodamp.report.html.plots import plots
from hydrodamp.report.html.score_table import ranked, score_table
from hydrodamp.report.html.summary import summary
from hydrodamp.report.remarks import remarks
from hydrodamp.validation.comparison import Comparison

if TYPE_CHECKING:
    from jinja2 import Environment

MISSING = 'the report needs the package jinja2: pip install "hydrodamp[report]"'
"""What is missing where there is no report."""

MOST = 4_900_000
"""Bytes of a page; pictures that do not fit are left to their folder."""

NOTHING_FOUND = Findings()
"""Where the training log was not asked."""

_SCRIPTS = ("theme.js", "sorting.js", "uplot.js", "levels.js", "plots.js")


@dataclass(frozen=True)
class Script:
    """A script and what the page's policy knows it by."""

    text: str
    digest: str


def installed() -> bool:
    """Tell whether what a report needs is installed."""
    return find_spec("jinja2") is not None


def page(
    comparison: Comparison, provenance: Mapping[str, object], findings: Findings = NOTHING_FOUND
) -> str:
    """Return the report of a comparison."""
    if not installed():
        raise MethodError(MISSING)
    template = _environment().get_template("report.html.j2")
    content = _content(comparison, provenance, findings)
    bare = template.render(content, section=pictures_section(findings, 0))
    room = MOST - len(bare.encode("utf-8"))
    return template.render(content, section=pictures_section(findings, room))


def _content(
    comparison: Comparison, provenance: Mapping[str, object], findings: Findings
) -> dict[str, object]:
    """Return what the page holds beside its pictures."""
    drawn, order = plots(comparison, findings.band), ranked(comparison.rows)
    return {
        "comparison": comparison,
        "title": _title(comparison),
        "methods": {
            method: (f"m{place}", colour_of(method))
            for place, method in enumerate(comparison.methods)
        },
        "verdict": summary(comparison, findings.identifiability),
        "warnings": (*told(provenance), *_remarks(comparison)),
        "table": score_table(comparison),
        "plots": drawn,
        "data": script_json(drawn.document) if drawn else "",
        "tables": coefficients.coefficient_tables(
            order, chosen_row(comparison), findings.identifiability
        ),
        "interval": coefficients,
        "origin": origin(comparison, provenance),
        "scripts": [_script(name) for name in _SCRIPTS[: None if drawn else 2]],
        "styles": _text("report.css"),
        "plot_styles": _text("uplot.css"),
        "licence": _text("uplot.LICENSE"),
    }


def _title(comparison: Comparison) -> str:
    return f"Damping of {comparison.provenance.get('vehicle') or 'a vehicle'}"


def _remarks(comparison: Comparison) -> tuple[str, ...]:
    """Return what stands below the table, and what the choice left out."""
    if all(row.rms is None for row in comparison.rows):
        return remarks(comparison)
    choice = comparison.choice()
    said = [each for each in remarks(comparison) if each != choice.sentence]
    return tuple(filter(None, (choice.reservation, *said)))


@cache
def _environment() -> Environment:
    from jinja2 import DictLoader, Environment, StrictUndefined

    names = ("report.html.j2", "coefficients.html.j2", "pictures.html.j2")
    return Environment(
        loader=DictLoader({name: _text(name) for name in names}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


@cache
def _script(name: str) -> Script:
    text = _text(name)
    digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")
    return Script(text, digest)


@cache
def _text(name: str) -> str:
    return files("hydrodamp.report.html").joinpath("assets", name).read_text(encoding="utf-8")

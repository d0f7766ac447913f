"""The directive ``catalogue``: every damping model of the package, from its own table."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

from docutils import nodes
from sections import section
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

import hydrodamp as hd
from hydrodamp.basis.term import AXES
from hydrodamp.models.model import group_axes

TERMS_A_LINE = 5
"""How many terms of a formula stand in one line."""


def formula(axis: str, terms: Sequence[hd.Term]) -> list[str]:
    """Return the wrench on an axis as lines of LaTeX.

    Parameters
    ----------
    axis : str
        One of X Y Z K M N.
    terms : sequence of Term
        Its terms.

    Returns
    -------
    lines : list of str
        For the environment ``aligned``.
    """
    if not terms:
        return [rf"\tau_{axis} &= 0"]
    factors = [rf"{axis}_{{{term.latex()}}}\,{term.latex()}" for term in terms]
    starts = range(0, len(factors), TERMS_A_LINE)
    lines = [" + ".join(factors[start : start + TERMS_A_LINE]) for start in starts]
    return [rf"\tau_{axis} &= {lines[0]}", *(rf"&\quad + {line}" for line in lines[1:])]


def plain(text: str) -> str:
    """Return a text with everything escaped that reStructuredText would read as markup."""
    return re.sub(r"([\\*`|_])", r"\\\1", text)


def described(model: hd.DampingModel) -> Iterator[str]:
    """Yield a model in reStructuredText.

    Parameters
    ----------
    model : DampingModel
        One of the catalogue.

    Yields
    ------
    line : str
        Key, counts, terms an axis, formulas, source and note.
    """
    yield from (f"``{model.key}``: {model.n_coefficients} coefficients.", "", plain(model.note), "")
    yield from (".. list-table::", "   :header-rows: 1", "   :widths: 12 8 80", "")
    yield from ("   * - axes", "     - n", "     - terms")
    groups = group_axes(model)
    for terms, axes in groups.items():
        yield f"   * - {' '.join(axes)}"
        yield f"     - {len(terms)}"
        yield f"     - ``{' '.join(map(str, terms))}``" if terms else "     - none"
    yield from ("", ".. math::", "", r"   \begin{aligned}")
    yield r" \\ ".join(
        r" \\ ".join(f"   {line}" for line in formula(axes[0], terms))
        for terms, axes in groups.items()
    )
    yield from (r"   \end{aligned}", "")
    same = [axes for axes in groups.values() if len(axes) > 1]
    if same:
        told = "; ".join(f"{', '.join(axes[1:])} as {axes[0]}" for axes in same)
        yield from (f"Equal rows are written once: {told}.", "")
    yield f"Source: {plain(model.source)}."


class Catalogue(SphinxDirective):
    """A section for each model of the catalogue."""

    def run(self) -> list[nodes.Node]:
        """Return the sections."""
        return [
            section(self, nodes.Text(model.title), f"model-{key}", described(model))
            for key, model in hd.catalog.items()
        ]


class Counts(SphinxDirective):
    """A table of all models: how many terms on which axis."""

    def run(self) -> list[nodes.Node]:
        """Return the table."""
        heads = ["model", "key", "n", *AXES]
        lines = [".. list-table::", "   :header-rows: 1", ""]
        for cells in (heads, *(_counted(model) for model in hd.catalog.values())):
            lines.append(f"   * - {cells[0]}")
            lines += [f"     - {cell}" for cell in cells[1:]]
        return self.parse_text_to_nodes("\n".join([*lines, ""]))


def _counted(model: hd.DampingModel) -> list[str]:
    counts = (model.n_coefficients, *map(len, model.terms))
    return [f":ref:`{model.title} <model-{model.key}>`", f"``{model.key}``", *map(str, counts)]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.add_directive("catalogue", Catalogue)
    app.add_directive("model-counts", Counts)
    return {"version": hd.__version__, "parallel_read_safe": True}

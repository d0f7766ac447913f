"""One table in five languages: plain text, Markdown, LaTeX, CSV and HTML."""

from __future__ import annotations

import csv
import html
import io
import textwrap
from collections.abc import Callable, Iterable, Sequence

from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import BOUND

WIDTH = 80
"""Columns of a plain text page."""

_LATEX = {
    "\\": r"\textbackslash{}",
    **{mark: f"\\{mark}" for mark in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "|": r"\textbar{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
}


def to_text(grid: Grid, width: int = WIDTH) -> str:
    """Return a table as plain text."""
    words = (grid.header, *grid.rows)
    widths = [max(map(len, column)) for column in zip(*words, strict=True)]
    lines = [_padded(row, widths, grid) for row in words]
    lines.insert(1, (" " * grid.gap).join("-" * each for each in widths))
    notes = [line for note in grid.notes for line in wrapped(note, width)]
    head = [grid.title, ""] if grid.title else []
    return "\n".join([*head, *lines, *([""] if notes else []), *notes])


def to_markdown(grid: Grid) -> str:
    """Return a table in GitHub's Markdown."""
    rules = ["---:" if side == "r" else ":---" for side in grid.align]
    rows = [_markdown_row(grid.header), _markdown_row(rules, escape=False)]
    rows += [_markdown_row(row) for row in _stressed(grid, "**{}**".format)]
    head = [f"**{grid.title}**", ""] if grid.title else []
    notes = ["", *(f"- {_markdown(note)}" for note in grid.notes)] if grid.notes else []
    return "\n".join([*head, *rows, *notes])


def to_latex(grid: Grid) -> str:
    """Return a table as LaTeX, with the rules of the booktabs package."""
    rows = _stressed(
        Grid(
            grid.title,
            tuple(map(_latex, grid.header)),
            tuple(tuple(map(_latex, row)) for row in grid.rows),
            grid.align,
            best=grid.best,
        ),
        r"\textbf{{{}}}".format,
    )
    lines = [
        *(f"% {note.replace(BOUND, ' ')}" for note in grid.notes),
        r"\begin{table}",
        r"  \centering",
        f"  \\caption{{{_latex(grid.title)}}}",
        f"  \\begin{{tabular}}{{{grid.align}}}",
        r"    \toprule",
        f"    {' & '.join(map(_latex, grid.header))} \\\\",
        r"    \midrule",
        *(f"    {' & '.join(row)} \\\\" for row in rows),
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines)


def to_csv(grid: Grid) -> str:
    r"""Return a table as comma-separated values: header and rows alone."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows((grid.header, *grid.rows))
    return stream.getvalue()


def to_html(grid: Grid) -> str:
    """Return a table as an HTML fragment."""
    header = "".join(f"<th>{html.escape(word)}</th>" for word in grid.header)
    rows = ["".join(_html_cell(grid, i, j) for j in range(len(grid.align))) for i in _rows(grid)]
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in grid.notes)
    lines = [
        "<table>",
        f"<caption>{html.escape(grid.title)}</caption>",
        f"<thead><tr>{header}</tr></thead>",
        "<tbody>",
        *(f"<tr>{row}</tr>" for row in rows),
        "</tbody>",
        "</table>",
    ]
    return "\n".join([*lines, *([f"<ul>{notes}</ul>"] if notes else [])])


def wrapped(note: str, width: int = WIDTH) -> list[str]:
    """Return a note in lines, each but the first indented."""
    lines = textwrap.wrap(
        note, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(BOUND, " ") for line in lines]


def _rows(grid: Grid) -> range:
    return range(len(grid.rows))


def _padded(row: Sequence[str], widths: Sequence[int], grid: Grid) -> str:
    words = (
        word.rjust(width) if side == "r" else word.ljust(width)
        for word, width, side in zip(row, widths, grid.align, strict=True)
    )
    return (" " * grid.gap).join(words).rstrip()


def _stressed(grid: Grid, stress: Callable[[str], str]) -> list[list[str]]:
    return [
        [stress(word) if (i, j) in grid.best else word for j, word in enumerate(row)]
        for i, row in enumerate(grid.rows)
    ]


def _markdown_row(row: Iterable[str], *, escape: bool = True) -> str:
    return "| " + " | ".join(_markdown(word) if escape else word for word in row) + " |"


def _markdown(word: str) -> str:
    return word.replace("|", r"\|").replace("<", "&lt;").replace("~", r"\~")


def _latex(word: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in word)


def _html_cell(grid: Grid, i: int, j: int) -> str:
    word = html.escape(grid.rows[i][j])
    style = ' style="text-align:right"' if grid.align[j] == "r" else ""
    return f"<td{style}>{f'<strong>{word}</strong>' if (i, j) in grid.best else word}</td>"

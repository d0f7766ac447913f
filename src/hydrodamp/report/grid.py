"""A table of values and how it is written: terminal, plain text, Markdown, LaTeX and CSV."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hydrodamp.report.numbers import BOUND, NOTHING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

WIDTH = 80
"""Columns of a plain text page."""

_CROWDED = 10  # columns, beyond which they stand closer together
_ALARMS = ("diverged", "failed", "refused", "too few")
_LATEX = {
    "\\": r"\textbackslash{}",
    **{mark: f"\\{mark}" for mark in "&%$#_{}"},
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "|": r"\textbar{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
}


@dataclass(frozen=True)
class Column:
    """A column: how its values are written, what they mean, and its name for other programs."""

    name: str
    number: bool = True
    form: Callable[[Any], str] = str
    meaning: str = ""
    key: str = ""


@dataclass(frozen=True)
class Grid:
    """A title, columns, rows of values and notes below them."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[object, ...], ...]
    notes: tuple[str, ...] = ()
    best: frozenset[tuple[int, int]] = frozenset()

    @classmethod
    def of_words(
        cls,
        title: str,
        header: Sequence[str],
        align: str,
        rows: Iterable[tuple[object, ...]],
        notes: Iterable[str] = (),
    ) -> Grid:
        """Return a table of words, each column aligned to the left ("l") or the right ("r")."""
        sides = zip(header, align, strict=True)
        columns = tuple(Column(name, number=side == "r") for name, side in sides)
        return cls(title, columns, tuple(rows), tuple(notes))

    @property
    def header(self) -> tuple[str, ...]:
        """The names of the columns."""
        return tuple(column.name for column in self.columns)

    @property
    def words(self) -> list[list[str]]:
        """The rows as they are read."""
        return [
            [_word(value, column) for column, value in zip(self.columns, row, strict=True)]
            for row in self.rows
        ]

    @property
    def gap(self) -> int:
        """Blanks between columns: two, or one where there are many."""
        return 2 if len(self.columns) <= _CROWDED else 1

    def column(self, name: str) -> tuple[str, ...]:
        """Return the words of a column."""
        place = self.header.index(name)
        return tuple(row[place] for row in self.words)


def _word(value: object, column: Column) -> str:
    if value is None:
        return NOTHING
    return value if isinstance(value, str) else column.form(value)


def to_text(grid: Grid, width: int = WIDTH) -> str:
    """Return a table as plain text."""
    words = (grid.header, *grid.words)
    widths = [max(map(len, column)) for column in zip(*words, strict=True)]
    lines = [_padded(row, widths, grid) for row in words]
    lines.insert(1, (" " * grid.gap).join("-" * each for each in widths))
    notes = [line for note in grid.notes for line in wrapped(note, width)]
    head = [grid.title, ""] if grid.title else []
    return "\n".join([*head, *lines, *([""] if notes else []), *notes])


def _padded(row: Sequence[str], widths: Sequence[int], grid: Grid) -> str:
    cells = zip(row, widths, grid.columns, strict=True)
    words = (w.rjust(width) if column.number else w.ljust(width) for w, width, column in cells)
    return (" " * grid.gap).join(words).rstrip()


def wrapped(note: str, width: int = WIDTH) -> list[str]:
    """Return a note in lines, each but the first indented."""
    lines = textwrap.wrap(
        note, width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
    )
    return [line.replace(BOUND, " ") for line in lines]


def to_markdown(grid: Grid) -> str:
    """Return a table in GitHub's Markdown."""
    rules = ["---:" if column.number else ":---" for column in grid.columns]
    head = [f"**{grid.title}**", ""] if grid.title else []
    notes = ["", *(f"- {_markdown(note)}" for note in grid.notes)] if grid.notes else []
    rows = _stressed(grid, _markdown, "**{}**")
    lines = [" | ".join(row) for row in ([*map(_markdown, grid.header)], rules, *rows)]
    return "\n".join([*head, *(f"| {line} |" for line in lines), *notes])


def to_latex(grid: Grid) -> str:
    """Return a table as LaTeX, with the rules of the booktabs package."""
    rows = [" & ".join(row) for row in _stressed(grid, _latex, r"\textbf{{{}}}")]
    align = "".join("r" if column.number else "l" for column in grid.columns)
    lines = [
        *(f"% {note.replace(BOUND, ' ')}" for note in grid.notes),
        r"\begin{table}",
        r"  \centering",
        f"  \\caption{{{_latex(grid.title)}}}",
        f"  \\begin{{tabular}}{{{align}}}",
        r"    \toprule",
        f"    {' & '.join(map(_latex, grid.header))} \\\\",
        r"    \midrule",
        *(f"    {row} \\\\" for row in rows),
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines)


def _stressed(grid: Grid, escape: Callable[[str], str], stress: str) -> list[list[str]]:
    return [
        [stress.format(escape(w)) if (i, j) in grid.best else escape(w) for j, w in enumerate(row)]
        for i, row in enumerate(grid.words)
    ]


def _markdown(word: str) -> str:
    return word.replace("|", r"\|").replace("<", "&lt;").replace("~", r"\~")


def _latex(word: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in word)


def to_csv(grid: Grid) -> str:
    """Return a table as comma-separated values in full precision: header and rows alone."""
    stream = io.StringIO()
    header = [column.key or column.name for column in grid.columns]
    csv.writer(stream, lineterminator="\n").writerows((header, *grid.rows))
    return stream.getvalue()


def show(console: Console, *grids: Grid) -> None:
    """Print tables with their notes on a terminal."""
    for place, grid in enumerate(grids):
        if place:
            console.print()
        console.print(grid.title, style="bold", markup=False, emoji=False)
        table = _rich_table(grid)
        # A table is printed no narrower than its words: rather past the edge than in pieces.
        least = console.measure(table, options=console.options.update(width=10_000)).minimum
        table.width = least if least > console.width else None
        console.print(table, crop=False)
        if grid.notes:
            console.print()
        for line in (
            line for note in grid.notes for line in wrapped(note, min(console.width, 100))
        ):
            console.print(line, markup=False, highlight=False, emoji=False, soft_wrap=True)


def _rich_table(grid: Grid) -> Table:
    from rich.box import SIMPLE_HEAD
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, grid.gap - 1, 0, 0))
    for column in grid.columns:
        table.add_column(
            Text(column.name),
            justify="right" if column.number else "left",
            overflow="fold",
            no_wrap=column.number,
        )
    for i, row in enumerate(grid.words):
        table.add_row(*(Text(w, style=_style(w, (i, j) in grid.best)) for j, w in enumerate(row)))
    return table


def _style(word: str, best: bool) -> str:
    if best:
        return "bold green"
    return "yellow" if word.startswith("~") else "red" if word in _ALARMS else ""

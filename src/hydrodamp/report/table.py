"""Table of values, written as plain text, Markdown, LaTeX (booktabs), HTML and CSV."""

from __future__ import annotations

import csv
import io
import math
import textwrap
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from typing import Any

from hydrodamp.errors import printable

NOTHING = "-"  # where there is no number

#: Characters per line of plain text.
WIDTH = 80

MAX_DECIMALS = 6  # of a value with its half-width; smaller and larger ones have an exponent

_FORMULAS = ("=", "+", "-", "@")  # first characters of spreadsheet formulas
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
    """A column: heading, format, definition, and name in files."""

    name: str
    number: bool = True
    form: Callable[[Any], str] = str
    meaning: str = ""
    key: str = ""


@dataclass(frozen=True)
class Table:
    """A title, columns, rows of values and notes below them."""

    title: str
    columns: tuple[Column, ...]
    rows: tuple[tuple[object, ...], ...]
    notes: tuple[str, ...] = ()
    best: frozenset[tuple[int, int]] = frozenset()

    def __post_init__(self) -> None:
        """Remove control characters from title and notes."""
        object.__setattr__(self, "title", printable(self.title))
        object.__setattr__(self, "notes", tuple(map(printable, self.notes)))

    @classmethod
    def of_items(
        cls,
        title: str,
        items: Iterable[object],
        columns: Mapping[str, tuple[str, str]],
        notes: Iterable[str] = (),
    ) -> Table:
        """Return a table with a row per item; a column is an attribute and its format."""
        formats = columns.items()
        formatted = (
            Column(name, form != "s", f"{{:{form}}}".format) for name, (_, form) in formats
        )
        rows = (tuple(getattr(item, name) for name, _ in columns.values()) for item in items)
        return cls(title, tuple(formatted), tuple(rows), tuple(notes))

    @classmethod
    def of_words(
        cls,
        title: str,
        header: Sequence[str],
        align: str,
        rows: Iterable[tuple[object, ...]],
        notes: Iterable[str] = (),
    ) -> Table:
        """Return a table of texts, each column aligned left ("l") or right ("r")."""
        sides = zip(header, align, strict=True)
        columns = tuple(Column(name, number=side == "r") for name, side in sides)
        return cls(title, columns, tuple(rows), tuple(notes))

    def omit_notes(self, notes: Collection[str]) -> Table:
        """Return the table without notes that are printed elsewhere."""
        return replace(self, notes=tuple(note for note in self.notes if note not in notes))

    @property
    def header(self) -> tuple[str, ...]:
        """The names of the columns."""
        return tuple(printable(column.name) for column in self.columns)

    @property
    def words(self) -> list[list[str]]:
        """The formatted cells."""
        return [
            [_word(value, column) for column, value in zip(self.columns, row, strict=True)]
            for row in self.rows
        ]


def _word(value: object, column: Column) -> str:
    if value is None:
        return NOTHING
    return printable(value) if isinstance(value, str) else column.form(value)


def _cells(source: Table) -> list[list[str]]:
    """Return header, rule and rows, padded to equal width in each column."""
    table = [list(source.header), [""] * len(source.columns), *source.words]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    table[1] = ["-" * width for width in widths]
    return [
        [
            word.rjust(width) if column.number else word.ljust(width)
            for word, width, column in zip(row, widths, source.columns, strict=True)
        ]
        for row in table
    ]


def to_text(table: Table, width: int = WIDTH) -> str:
    """Return a table as plain text with wrapped notes."""
    lines = _cells(table) if table.columns else []
    spaced = max((sum(map(len, row)) + 2 * len(row) - 2 for row in lines), default=0)
    gap = " " * (2 if spaced <= width else 1)
    title = [table.title, ""] if table.title else []
    wrap = partial(textwrap.fill, subsequent_indent="  ", break_long_words=False)
    notes = [wrap(note, width, break_on_hyphens=False) for note in table.notes]
    rows = [gap.join(row).rstrip() for row in lines]
    return "\n".join([*title, *rows, *([""] if rows and notes else []), *notes])


def to_markdown(table: Table) -> str:
    """Return a table in GitHub's Markdown."""
    rules = ["---:" if column.number else ":---" for column in table.columns]
    head = [f"**{table.title}**", ""] if table.title else []
    notes = ["", *(f"- {_markdown(note)}" for note in table.notes)] if table.notes else []
    rows = emphasise_best(table, _markdown, "**{}**")
    lines = [" | ".join(row) for row in ([*map(_markdown, table.header)], rules, *rows)]
    return "\n".join([*head, *(f"| {line} |" for line in lines), *notes])


def to_latex(table: Table) -> str:
    """Return a table as LaTeX, with the rules of the booktabs package."""
    rows = [" & ".join(row) for row in emphasise_best(table, _latex, r"\textbf{{{}}}")]
    align = "".join("r" if column.number else "l" for column in table.columns)
    lines = [
        *(f"% {note}" for note in table.notes),
        r"\begin{table}",
        r"  \centering",
        f"  \\caption{{{_latex(table.title)}}}",
        f"  \\begin{{tabular}}{{{align}}}",
        r"    \toprule",
        f"    {' & '.join(map(_latex, table.header))} \\\\",
        r"    \midrule",
        *(f"    {row} \\\\" for row in rows),
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines)


def to_html(
    table: Table, name: str, rows: Sequence[Mapping[str, str]] = (), sorted_by: str = ""
) -> str:
    """Return a table as HTML whose heads sort, with its file name and attributes of its rows."""

    def cell(tag: str, column: Column, text: str, **attributes: str) -> str:
        classes = {"class": "number"} if column.number else {}
        return f"<{tag}{_attributes({**attributes, **classes})}>{text}</{tag}>"

    def head(column: Column) -> str:
        order = {"aria-sort": "ascending"} if column.name == sorted_by else {}
        button = {"type": "button", "data-numeric": str(int(column.number))}
        button |= {"title": column.meaning} if column.meaning else {}
        text = f'<span class="head">{escape(column.name)}</span>'
        text += '<span class="arrow" aria-hidden="true"></span>'
        return cell(
            "th", column, f"<button{_attributes(button)}>{text}</button>", scope="col", **order
        )

    def body(values: Sequence[object], words: Sequence[str]) -> str:
        cells = []
        for index, (column, value, word) in enumerate(
            zip(table.columns, values, words, strict=True)
        ):
            is_known = value is not None and value == value and value != NOTHING
            key = {"data-key": str(value) if is_known else ""}
            tag, scope = ("td", {}) if index else ("th", {"scope": "row"})
            cells.append(cell(tag, column, escape(word), **scope, **key))
        return "".join(cells)

    pairs = zip(table.rows, table.words, rows or [{}] * len(table.rows), strict=True)
    region = {"class": "wide", "role": "region", "aria-label": table.title, "tabindex": "0"}
    return "\n".join([
        f"<div{_attributes(region)}>",
        f"<table{_attributes({'class': 'numbers sortable', 'data-file': name})}>",
        f"<caption>{escape(table.title)}</caption>",
        f"<thead><tr>{''.join(map(head, table.columns))}</tr></thead>",
        "<tbody>",
        *(f"<tr{_attributes(each)}>{body(values, words)}</tr>" for values, words, each in pairs),
        "</tbody></table></div>",
    ])  # fmt: skip


def _attributes(values: Mapping[str, str]) -> str:
    return "".join(f' {name}="{escape(text)}"' for name, text in values.items())


def emphasise_best(table: Table, escape: Callable[[str], str], stress: str) -> list[list[str]]:
    return [
        [stress.format(escape(w)) if (i, j) in table.best else escape(w) for j, w in enumerate(row)]
        for i, row in enumerate(table.words)
    ]


def _markdown(word: str) -> str:
    return word.replace("|", r"\|").replace("<", "&lt;").replace("~", r"\~")


def _latex(word: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in word)


def to_csv(table: Table) -> str:
    """Return header and rows as comma-separated values in full precision."""
    stream = io.StringIO()
    header = [column.key or column.name for column in table.columns]
    rows = ([_cell(value) for value in row] for row in (header, *table.rows))
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue()


FORMATS = {"text": to_text, "markdown": to_markdown, "latex": to_latex, "csv": to_csv}


def _cell(value: object) -> object:
    """Return a cell; quote a text that a spreadsheet would evaluate."""
    if not isinstance(value, str):
        return value
    word = printable(value)
    with suppress(ValueError):
        float(word)
        return word
    return f"'{word}" if word.startswith(_FORMULAS) else word


def error_size(value: float | None, decimals: int = 3) -> str:
    """Return an error with a fixed number of decimals."""
    if value is None or math.isnan(value):
        return NOTHING
    if 0.0 < value < 0.5 * 10.0**-decimals:
        return f"<.{'1':>0{decimals}}"
    for limit, most in ((100.0, decimals), (1000.0, 1), (99999.5, 0)):
        if value < limit:
            return f"{value:.{min(most, decimals)}f}"
    return f"{value:.0e}"


def percent(value: float | None) -> str:
    """Return a fit in percent in at most three characters."""
    if value is None or math.isnan(value):
        return NOTHING
    return "<0" if value < 0.0 else f"{value:.0f}"


def format_interval(value: float, half: float) -> str:
    """Return a value and its half-width, which has two significant digits: ``-3.244 ± 0.044``."""
    is_known = math.isfinite(value) and 0.0 < half < math.inf
    decimals = 1 - math.floor(math.log10(half)) if is_known else MAX_DECIMALS + 1
    if abs(decimals) > MAX_DECIMALS:
        return f"{coefficient(value)} ± {coefficient(half)}"
    digits = max(decimals, 0)
    return f"{round(value, decimals):.{digits}f} ± {round(half, decimals):.{digits}f}"


def coefficient(value: float | None) -> str:
    """Return a coefficient with four significant digits."""
    return NOTHING if value is None or not math.isfinite(value) else f"{value:.4g}"

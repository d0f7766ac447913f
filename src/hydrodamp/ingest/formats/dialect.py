"""How a text file of columns is written, found from its first lines."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydrodamp.data.channels import SEGMENT
from hydrodamp.data.units import is_unit
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import (
    Column,
    Names,
    column_of,
    is_missing,
    is_number,
    number,
    unique_names,
)
from hydrodamp.ingest.formats.content import check_columns, head

#: How a line begins that holds no row.
COMMENTS = ("#", "%", "//")

#: The name of what reads bytes that are no Unicode, as Windows-1252.
WESTERN = "hydrodamp.western"


def _western(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeDecodeError)
    odd = error.object[error.start : error.end].decode("cp1252", "replace")
    return odd if error.encoding == "utf-8" else "\ufffd", error.end


codecs.register_error(WESTERN, _western)

_ENCODINGS = {
    rb"\xef\xbb\xbf": "utf-8-sig",
    rb"\xff\xfe|\xfe\xff": "utf-16",
    rb"([^\0]\0){4}": "utf-16-le",
    rb"(\0[^\0]){4}": "utf-16-be",
}
_BEGIN = 1 << 18  # bytes
_LINE = re.compile("\r\n|\n|\r")

#: In order of preference; the empty one stands for any white space.
DELIMITERS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", "": "spaces"}
_COMMENT = re.compile(r"\s*(#|%|//)+")
_SAMPLE = 200  # lines


@dataclass(frozen=True)
class Dialect:
    """The encoding of a text, its delimiter and decimal sign, and its header."""

    encoding: str
    quoted: bool
    delimiter: str
    decimal: str
    header: Header
    numeric: tuple[bool, ...]
    width: int
    first: int

    def column(self, place: int, cells: Sequence[str]) -> Column:
        """Return cells as a column."""
        return column_of(cells, self.decimal, self.header.names[place])


def find_dialect(path: str | Path) -> Dialect:
    """Find how a file is written from its first lines."""
    begin = head(path, _BEGIN)
    encoding = next((one for mark, one in _ENCODINGS.items() if re.match(mark, begin)), "utf-8")
    lines = _LINE.split(begin.rstrip(b"\0").decode(encoding, errors=WESTERN))
    if len(begin) == _BEGIN and len(lines) > 1:
        lines.pop()
    marks = [mark for mark in DELIMITERS if mark]
    check_columns(1 + max(line.count(mark) for line in lines[:_SAMPLE] for mark in marks), path)
    check_columns(max(len(line.split()) for line in lines[:_SAMPLE]), path)
    try:
        tables = {mark: _rows(lines[:_SAMPLE], mark) for mark in DELIMITERS}
    except csv.Error as error:
        raise LogError(f"the file is no text of columns: {error}", source=str(path)) from error
    tables = {mark: rows for mark, rows in tables.items() if rows}
    if not tables:
        raise LogError(
            "the file is empty; it must begin with a line of column names", source=str(path)
        )
    ways = [(mark, decimal) for mark in tables for decimal in ".,"]
    delimiter, decimal = max(ways, key=lambda way: _score(tables[way[0]], way[1]))
    if all(len(row.cells) == 1 for row in tables[delimiter]):
        # Nothing splits the rows, so what splits the first line is the delimiter.
        split = (mark for mark in tables if mark and tables[mark][0].filled > 1)
        delimiter = next(split, next(iter(tables)))
    return _described(tables[delimiter], encoding, '"' in "".join(lines), delimiter, decimal)


@dataclass(frozen=True)
class _Row:
    line: int
    cells: tuple[str, ...]
    comment: bool

    @property
    def filled(self) -> int:
        """The number of cells without the empty ones at the end."""
        return next((k + 1 for k in reversed(range(len(self.cells))) if self.cells[k].strip()), 0)


def _rows(lines: Sequence[str], delimiter: str) -> list[_Row]:
    """Return the rows that are not blank, without the mark of a comment."""
    rows = []
    for line, text in enumerate(lines, start=1):
        mark = _COMMENT.match(text)
        bare, cells = text[mark.end() :] if mark else text, list[str]()
        if delimiter:
            cells = next(csv.reader([bare], delimiter=delimiter, skipinitialspace=True), cells)
        rows.append(_Row(line, tuple(cells if delimiter else bare.split()), mark is not None))
    return [row for row in rows if row.filled]


def _later(rows: Sequence[_Row]) -> list[_Row]:
    """Return the later half of the rows, past any header."""
    plain = [row for row in rows if not row.comment] or list(rows)
    return plain[len(plain) // 2 :]


def _width(rows: Sequence[_Row], decimal: str) -> int:
    """Return the length of the rows that hold most of the numbers."""
    weights: Counter[int] = Counter()
    for row in rows:
        weights[len(row.cells)] += 1 + 1000 * sum(is_number(cell, decimal) for cell in row.cells)
    return weights.most_common(1)[0][0]


def _score(rows: Sequence[_Row], decimal: str) -> tuple[float, bool, float]:
    """Return how well a delimiter fits: numbers, several columns, equal lengths."""
    later = _later(rows)
    width = _width(later, decimal)
    even = [row for row in later if len(row.cells) == width]
    cells = [cell for row in even for cell in row.cells if not is_missing(cell)]
    numbers = sum(is_number(cell, decimal) for cell in cells) / max(len(cells), 1)
    equal = len(even) / len(later)
    return round(numbers * equal, 3), width > 1, equal


def _described(
    rows: list[_Row], encoding: str, quoted: bool, delimiter: str, decimal: str
) -> Dialect:
    """Return the dialect of rows split by the delimiter that fits best."""
    later = _later(rows)
    width = _width(later, decimal)
    even = [row.cells for row in later if len(row.cells) == width]
    likely = [_is_numeric(column, decimal) for column in zip(*even, strict=True)]
    start = next((k for k in range(len(rows)) if _is_data(rows, k, likely, decimal)), 1)
    filled = max((row.filled for row in rows[start:] if len(row.cells) == width), default=width)
    above = [_join_brackets(row, width, delimiter) for row in rows[:start]]
    header = Header(above, filled, width, delimiter)
    numeric = (
        likely[k : k + 1] == [True] and name != SEGMENT for k, name in enumerate(header.names)
    )
    return Dialect(
        encoding,
        quoted,
        delimiter,
        decimal,
        header,
        tuple(numeric),
        max(width, len(header.names)),
        rows[start].line if start < len(rows) else rows[-1].line + 1,
    )


def _join_brackets(row: _Row, width: int, delimiter: str) -> _Row:
    """Join the cells of names such as `pd(1,1)` where a header has more cells than its rows."""
    cells: list[str] = []
    for cell in row.cells:
        if cells and cells[-1].count("(") > cells[-1].count(")"):
            cells[-1] += delimiter + cell
        else:
            cells.append(cell)
    return replace(row, cells=tuple(cells)) if len(row.cells) > width == len(cells) else row


def _is_numeric(cells: Sequence[str], decimal: str) -> bool:
    there = [cell for cell in cells if not is_missing(cell)]
    numbers = sum(number(cell, decimal) is not None for cell in there)
    return bool(there) and 2 * numbers >= len(there)


def _is_data(rows: Sequence[_Row], place: int, numeric: Sequence[bool], decimal: str) -> bool:
    """Return whether a row is data rather than a header, by its cells in columns of numbers."""
    row = rows[place]
    cells = [cell for cell, is_so in zip(row.cells, numeric, strict=False) if is_so]
    if row.comment or not cells or _are_units(row):
        return False
    words = sum(not is_missing(cell) and not is_number(cell, decimal) for cell in cells)
    named = any(1 < above.filled >= row.filled for above in rows[:place])
    return 2 * words <= len(cells) and (named or (words == 0 and len(row.cells) == len(numeric)))


def _are_units(row: _Row) -> bool:
    cells = [cell for cell in row.cells if cell.strip()]
    return 2 * sum(map(is_unit, cells)) > len(cells)


class Header:
    """What the lines above the rows say."""

    def __init__(self, rows: Sequence[_Row], filled: int, width: int, delimiter: str) -> None:
        self.names = unique_names([""] * filled)
        self.cells: tuple[str, ...] = ()
        self.units: dict[str, str] = {}
        self.faults: dict[str, str] = {}
        self.notes: list[str] = []
        full = [row for row in rows if filled <= row.filled <= max(width, filled)]
        if not full and delimiter and rows and rows[-1].filled > 1:
            full = [rows[-1]]
        if not full:
            self.notes.append("no line of column names; the columns are called by their place")
            return
        units = full.pop().cells if len(full) > 1 and _are_units(full[-1]) else ()
        *above, row = full
        self.notes += [f"line {one.line} above the column names was passed over" for one in above]
        self.cells = tuple(cell.strip() for cell in row.cells[: row.filled])
        # Quotation marks, padding and the escapes of typesetting are no part of a name.
        called = Names([cell.strip('"').strip().replace("\\_", "_") for cell in self.cells])
        below = zip(called.names, (unit.strip().strip("[]()") for unit in units), strict=False)
        self.names, self.faults = called.names, called.faults
        self.units = called.units | {name: unit for name, unit in below if unit}
        self.notes += self.faults.values()

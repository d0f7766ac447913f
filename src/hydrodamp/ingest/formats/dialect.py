"""Delimited text, dialect: encoding, delimiter, decimal sign and header from the first lines.

Each pair of delimiter and decimal sign is scored by the share of cells that are numbers times the
share of rows of equal width; the best one is the dialect.
"""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from hydrodamp.data.channels import SEGMENT, is_unit
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import (
    Column,
    ColumnNames,
    is_missing,
    is_number,
    parse_column,
    parse_number,
    unique_names,
)
from hydrodamp.ingest.formats.content import check_columns, read_head

#: First characters of comment lines.
COMMENTS = ("#", "%", "//")

#: Error handler that decodes bytes invalid in UTF-8 as Windows-1252.
CP1252_FALLBACK = "hydrodamp.western"


def _decode_cp1252(error: UnicodeError) -> tuple[str, int]:
    assert isinstance(error, UnicodeDecodeError)
    decoded = error.object[error.start : error.end].decode("cp1252", "replace")
    return decoded if error.encoding == "utf-8" else "\ufffd", error.end


codecs.register_error(CP1252_FALLBACK, _decode_cp1252)

_ENCODINGS = {
    rb"\xef\xbb\xbf": "utf-8-sig",
    rb"\xff\xfe|\xfe\xff": "utf-16",
    rb"([^\0]\0){4}": "utf-16-le",
    rb"(\0[^\0]){4}": "utf-16-be",
}
_HEAD_BYTES = 1 << 18  # bytes
_LINE = re.compile("\r\n|\n|\r")

#: In order of preference; the empty string is any white space.
DELIMITERS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", "": "spaces"}
_COMMENT = re.compile(r"\s*(#|%|//)+")
_SAMPLE_LINES = 200  # lines


@dataclass(frozen=True)
class Dialect:
    """Encoding, delimiter, decimal sign and header of a text file, and its numeric columns."""

    encoding: str
    has_quotes: bool
    delimiter: str
    decimal: str
    header: Header
    numeric: tuple[bool, ...]
    width: int
    first_line: int

    def parse_column(self, index: int, cells: Sequence[str]) -> Column:
        """Parse the cells of a column."""
        return parse_column(cells, self.decimal, self.header.names[index])


def find_dialect(path: str | Path) -> Dialect:
    """Detect the dialect of a file from its first lines."""
    head = read_head(path, _HEAD_BYTES)
    encoding = next(
        (name for signature, name in _ENCODINGS.items() if re.match(signature, head)), "utf-8"
    )
    lines = _LINE.split(head.rstrip(b"\0").decode(encoding, errors=CP1252_FALLBACK))
    if len(head) == _HEAD_BYTES and len(lines) > 1:
        lines.pop()
    delimiters = [mark for mark in DELIMITERS if mark]
    check_columns(
        1 + max(line.count(mark) for line in lines[:_SAMPLE_LINES] for mark in delimiters), path
    )
    check_columns(max(len(line.split()) for line in lines[:_SAMPLE_LINES]), path)
    try:
        tables = {mark: _split_rows(lines[:_SAMPLE_LINES], mark) for mark in DELIMITERS}
    except csv.Error as error:
        raise LogError(f"expected delimited text; {error}", source=str(path)) from error
    tables = {mark: rows for mark, rows in tables.items() if rows}
    if not tables:
        raise LogError(
            "the file is empty; it must begin with a line of column names", source=str(path)
        )
    candidates = [(mark, decimal) for mark in tables for decimal in ".,"]
    delimiter, decimal = max(candidates, key=lambda way: _score_dialect(tables[way[0]], way[1]))
    if all(len(row.cells) == 1 for row in tables[delimiter]):
        # No delimiter splits the rows: take the one that splits the first line.
        splitting = (mark for mark in tables if mark and tables[mark][0].filled > 1)
        delimiter = next(splitting, next(iter(tables)))
    return _make_dialect(tables[delimiter], encoding, '"' in "".join(lines), delimiter, decimal)


@dataclass(frozen=True)
class _Row:
    line: int
    cells: tuple[str, ...]
    comment: bool

    @property
    def filled(self) -> int:
        """Number of cells without empty trailing ones."""
        return next((k + 1 for k in reversed(range(len(self.cells))) if self.cells[k].strip()), 0)


def _split_rows(lines: Sequence[str], delimiter: str) -> list[_Row]:
    """Split lines into non-empty rows, without comment marks."""
    rows = []
    for line, text in enumerate(lines, start=1):
        mark = _COMMENT.match(text)
        content, cells = text[mark.end() :] if mark else text, list[str]()
        if delimiter:
            cells = next(csv.reader([content], delimiter=delimiter, skipinitialspace=True), cells)
        rows.append(_Row(line, tuple(cells if delimiter else content.split()), mark is not None))
    return [row for row in rows if row.filled]


def _last_half(rows: Sequence[_Row]) -> list[_Row]:
    """Return the second half of the rows, which lies below any header."""
    uncommented = [row for row in rows if not row.comment] or list(rows)
    return uncommented[len(uncommented) // 2 :]


def _dominant_width(rows: Sequence[_Row], decimal: str) -> int:
    """Return the row width that holds most numbers."""
    weights: Counter[int] = Counter()
    for row in rows:
        weights[len(row.cells)] += 1 + 1000 * sum(is_number(cell, decimal) for cell in row.cells)
    return weights.most_common(1)[0][0]


def _score_dialect(rows: Sequence[_Row], decimal: str) -> tuple[float, bool, float]:
    """Return the score of a delimiter: numbers, several columns, equal widths."""
    tail = _last_half(rows)
    width = _dominant_width(tail, decimal)
    regular = [row for row in tail if len(row.cells) == width]
    cells = [cell for row in regular for cell in row.cells if not is_missing(cell)]
    numbers = sum(is_number(cell, decimal) for cell in cells) / max(len(cells), 1)
    regularity = len(regular) / len(tail)
    return round(numbers * regularity, 3), width > 1, regularity


def _make_dialect(
    rows: list[_Row], encoding: str, quoted: bool, delimiter: str, decimal: str
) -> Dialect:
    """Return the dialect of rows split by the best delimiter."""
    tail = _last_half(rows)
    width = _dominant_width(tail, decimal)
    regular = [row.cells for row in tail if len(row.cells) == width]
    is_numeric = [_is_numeric(column, decimal) for column in zip(*regular, strict=True)]
    start = next((k for k in range(len(rows)) if _is_data(rows, k, is_numeric, decimal)), 1)
    filled = max((row.filled for row in rows[start:] if len(row.cells) == width), default=width)
    header_rows = [_join_brackets(row, width, delimiter) for row in rows[:start]]
    header = Header(header_rows, filled, width, delimiter)
    numeric = (
        is_numeric[k : k + 1] == [True] and name != SEGMENT for k, name in enumerate(header.names)
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
    """Join header cells such as `pd(1,1)`, split at the comma in parentheses."""
    cells: list[str] = []
    for cell in row.cells:
        if cells and cells[-1].count("(") > cells[-1].count(")"):
            cells[-1] += delimiter + cell
        else:
            cells.append(cell)
    return replace(row, cells=tuple(cells)) if len(row.cells) > width == len(cells) else row


def _is_numeric(cells: Sequence[str], decimal: str) -> bool:
    present = [cell for cell in cells if not is_missing(cell)]
    numbers = sum(parse_number(cell, decimal) is not None for cell in present)
    return bool(present) and 2 * numbers >= len(present)


def _is_data(rows: Sequence[_Row], index: int, numeric: Sequence[bool], decimal: str) -> bool:
    """Return whether a row is data and no header, by its cells in numeric columns."""
    row = rows[index]
    cells = [cell for cell, is_so in zip(row.cells, numeric, strict=False) if is_so]
    if row.comment or not cells or _are_units(row):
        return False
    words = sum(not is_missing(cell) and not is_number(cell, decimal) for cell in cells)
    has_header = any(1 < above.filled >= row.filled for above in rows[:index])
    return 2 * words <= len(cells) and (
        has_header or (words == 0 and len(row.cells) == len(numeric))
    )


def _are_units(row: _Row) -> bool:
    cells = [cell for cell in row.cells if cell.strip()]
    return 2 * sum(map(is_unit, cells)) > len(cells)


class Header:
    """Column names and units, parsed from the lines above the data."""

    def __init__(self, rows: Sequence[_Row], filled: int, width: int, delimiter: str) -> None:
        self.names = unique_names([""] * filled)
        self.cells: tuple[str, ...] = ()
        self.units: dict[str, str] = {}
        self.faults: dict[str, str] = {}
        self.notes: list[str] = []
        candidates = [row for row in rows if filled <= row.filled <= max(width, filled)]
        if not candidates and delimiter and rows and rows[-1].filled > 1:
            candidates = [rows[-1]]
        if not candidates:
            self.notes.append("there is no line of column names; columns are named by their number")
            return
        units = candidates.pop().cells if len(candidates) > 1 and _are_units(candidates[-1]) else ()
        *skipped_rows, row = candidates
        self.notes += [
            f"line {skipped.line} above the column names was skipped" for skipped in skipped_rows
        ]
        self.cells = tuple(cell.strip() for cell in row.cells[: row.filled])
        # Strip quotation marks, padding and LaTeX escapes.
        columns = ColumnNames([cell.strip('"').strip().replace("\\_", "_") for cell in self.cells])
        unit_row = zip(columns.names, (unit.strip().strip("[]()") for unit in units), strict=False)
        self.names, self.faults = columns.names, columns.faults
        self.units = columns.units | {name: unit for name, unit in unit_row if unit}
        self.notes += self.faults.values()

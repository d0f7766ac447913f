"""How a text file of columns is written, found from its first lines."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, column_of, is_missing, is_number, number
from hydrodamp.ingest.formats.naming import is_unit, split_unit, told_apart, unescaped

_DELIMITERS = ("\t", ";", "|", ",", "")
"""In order of preference; the empty one stands for any white space."""
_CALLED = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", "": "spaces"}
_COMMENT = re.compile(r"\s*(#|%|//)+")
_SEPARATOR = re.compile(r"sep=.$", re.IGNORECASE)
_SAMPLE = 200
_LABEL = "segment"
"""A column of names, were they digits: a segment `001` is not called `1`."""
_NO_NAME = "unnamed"
"""What a row without one has for a name."""


@dataclass(frozen=True)
class Dialect:
    """How the columns of a text file are told apart and called."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: dict[str, str]
    header: tuple[str, ...]
    numeric: tuple[bool, ...]
    width: int
    first: int
    notes: tuple[str, ...] = ()
    faults: Mapping[str, str] = field(default_factory=dict)

    @property
    def called(self) -> str:
        """How one calls what stands between the cells."""
        return _CALLED[self.delimiter]

    def column(self, place: int, cells: Sequence[str]) -> Column:
        """Return cells as a column."""
        column = column_of(cells, self.decimal)
        if self.names[place] != _LABEL:
            return column
        words = tuple(cell.strip() or _NO_NAME for cell in cells)
        return Column(None if column.bad else column.numbers, words)


@dataclass(frozen=True)
class _Row:
    line: int
    cells: tuple[str, ...]
    comment: bool

    @property
    def filled(self) -> int:
        """The number of cells without the empty ones at the end."""
        return next((k + 1 for k in reversed(range(len(self.cells))) if self.cells[k].strip()), 0)


def split(line: str, delimiter: str) -> list[str]:
    """Return the cells of one line."""
    if not delimiter:
        return line.split()
    return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])


def find_dialect(lines: Sequence[str], source: str) -> Dialect:
    """Find how a file is written from its first lines."""
    try:
        spelt = {mark: _rows(lines[:_SAMPLE], mark) for mark in _DELIMITERS}
    except csv.Error as error:
        raise LogError(f"the file is no text of columns: {error}", source=source) from error
    if not any(row.filled for rows in spelt.values() for row in rows):
        raise LogError(
            "the file is empty; it must begin with a line of column names", source=source
        )
    ways = [(mark, decimal) for mark in _DELIMITERS if spelt[mark] for decimal in ".,"]
    delimiter, decimal = max(ways, key=lambda way: _score(spelt[way[0]], way[1]))
    if all(len(row.cells) == 1 for row in spelt[delimiter]):
        delimiter = _of_header(spelt)
    return _described(spelt[delimiter], delimiter, decimal)


def _of_header(spelt: Mapping[str, Sequence[_Row]]) -> str:
    """Return what splits the first line, where nothing splits the rows."""
    marks = [mark for mark in _DELIMITERS if spelt[mark]]
    return next((mark for mark in marks if mark and spelt[mark][0].filled > 1), marks[0])


def _rows(lines: Sequence[str], delimiter: str) -> list[_Row]:
    """Return the rows that are not blank; a comment's mark is dropped."""
    rows = []
    for line, text in enumerate(lines, start=1):
        if _SEPARATOR.match(text.strip()):
            continue
        bare = _COMMENT.sub("", text, count=1) if (mark := _COMMENT.match(text)) else text
        row = _Row(line, tuple(split(bare, delimiter)), mark is not None)
        if row.filled:
            rows.append(row)
    return rows


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


def _described(rows: list[_Row], delimiter: str, decimal: str) -> Dialect:
    """Return the dialect of rows split by the delimiter that fits best."""
    later = _later(rows)
    width = _width(later, decimal)
    even = [row.cells for row in later if len(row.cells) == width]
    likely = [_numeric(column, decimal) for column in zip(*even, strict=True)]
    start = next((k for k in range(len(rows)) if _is_data(rows, k, likely, decimal)), 1)
    filled = max((row.filled for row in rows[start:] if len(row.cells) == width), default=width)
    header = _Header(rows[:start], filled, width, delimiter)
    names = header.names or told_apart([""] * filled)
    numeric = [likely[k : k + 1] == [True] and name != _LABEL for k, name in enumerate(names)]
    return Dialect(
        delimiter,
        decimal,
        names,
        header.units,
        header.spelt,
        tuple(numeric),
        max(width, len(names)),
        rows[start].line if start < len(rows) else rows[-1].line + 1,
        tuple(header.notes),
        header.faults,
    )


def _numeric(cells: Sequence[str], decimal: str) -> bool:
    there = [cell for cell in cells if not is_missing(cell)]
    numbers = sum(number(cell, decimal) is not None for cell in there)
    return bool(there) and 2 * numbers >= len(there)


def _is_data(rows: Sequence[_Row], place: int, numeric: Sequence[bool], decimal: str) -> bool:
    """Tell a row of data from one of a header by its cells in the columns of numbers."""
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


class _Header:
    """What the lines above the rows say."""

    def __init__(self, rows: Sequence[_Row], filled: int, width: int, delimiter: str) -> None:
        self.names: tuple[str, ...] = ()
        self.spelt: tuple[str, ...] = ()
        self.units: dict[str, str] = {}
        self.faults: dict[str, str] = {}
        self.notes: list[str] = []
        full = [row for row in rows if filled <= row.filled <= max(width, filled)]
        if not full and delimiter and rows and rows[-1].filled > 1:
            full = [rows[-1]]
        if not full:
            self.notes.append("no line of column names; the columns are called by their place")
            return
        units = full.pop() if len(full) > 1 and _are_units(full[-1]) else None
        self._name(full[-1], None if units is None else units.cells)
        for row in full[:-1]:
            self.notes.append(f"line {row.line} above the column names was passed over")

    def _name(self, row: _Row, units: tuple[str, ...] | None) -> None:
        self.spelt = tuple(cell.strip() for cell in row.cells[: row.filled])
        whole = [unescaped(cell) for cell in self.spelt]
        halves = [split_unit(name) for name in whole]
        if units is not None or len({stem for stem, _ in halves}) < len(set(whole)):
            halves = [(name, "") for name in whole]
        self.names = told_apart([stem for stem, _ in halves])
        stated = units or [unit for _, unit in halves]
        pairs = zip(self.names, (unit.strip().strip("[]()") for unit in stated), strict=False)
        self.units = {name: unit for name, unit in pairs if unit}
        for name, count in Counter(stem for stem, _ in halves).items():
            if name and count > 1:
                self.faults[name] = f"column `{name}` stands {count} times in the header; keep one"
        self.notes += self.faults.values()

"""Cells of text tables: numbers, dates and text; headers: column names with units."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, count
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import SEGMENT, is_unit
from hydrodamp.data.recording import Dates, Topic
from hydrodamp.ingest.formats.dates import MISSING, is_date, is_missing, parse_dates

#: First characters of comment lines.
COMMENTS = ("#", "%", "//")

_BOOLEANS = {"true": 1.0, "false": 0.0}
# A latitude or longitude with the letter of its hemisphere: 59.4N, 5924.00 N, 59°24.0'N.
_COORDINATE = re.compile(
    r"(?=[^NSEW]*[NSEW][^NSEW]*$)(?=.*\d\D+\d)[NSEW]? *(\d+(?:[.,]\d+)?)"
    r"(?:[°: ]+(\d+(?:[.,]\d+)?)(?:[': ]+(\d+(?:[.,]\d+)?))?)?[°'\" ]*[NSEW]?",
    re.IGNORECASE,
)
#: Beginnings of words in the names of columns of latitude and of longitude.
COORDINATE_NAMES = tuple(
    re.compile(rf"(?:(?<![A-Za-z])(?i:gps|gnss|nav)?|(?=L[a-z]))(?i:{stems})")
    for stems in ("lat(?!er|en)", "lon(?!g[a-z])|longitude|lng")
)
_UNNAMED_SEGMENT = "unnamed"  # label of rows with an empty cell
_NAN = float("nan")
_MAX_LISTED = 3
_BRACKETED = re.compile(r"(.*?\S)[ _]*(?:\[([^\[\]]*)\]|\(([^()]*)\))$")
# A number with a mark between groups of three digits. With a decimal point, a lone comma is no such
# mark: `1,039` may be a number with a decimal comma.
_GROUPED = r"\s*[+-]?[1-9]\d?\d?(?:([%s'\u2019\xa0\u202f ])\d{3})(?:\1\d{3})*(?:%s\d*)?\s*"
_THOUSANDS = {
    ".": re.compile(r"(?![^,]*,\d*\s*$)" + _GROUPED % (",", r"\.")),
    ",": re.compile(_GROUPED % (".", ",")),
}
_ELEMENT = re.compile(r"\d+")


@dataclass(frozen=True)
class Column:
    """A parsed column: numbers or text, and the invalid cells with their rows."""

    numbers: FloatArray | None
    texts: tuple[str, ...] = ()
    invalid: tuple[tuple[int, str], ...] = ()
    unit: str = ""
    dates: Dates | None = None


def make_topic(
    name: str,
    columns: Mapping[str, Column],
    lines: Sequence[int] = (),
    *,
    time: FloatArray | None = None,
    units: Mapping[str, str] | None = None,
) -> Topic:
    """Return columns as a topic; columns with invalid cells become faults."""
    faults = {
        key: fault
        for key, column in columns.items()
        for fault in invalid_cells(f"{name}.{key}" if name else key, column.invalid, lines)
    }
    valid = {key: column for key, column in columns.items() if not column.invalid}
    fields = {key: column.numbers for key, column in valid.items() if column.numbers is not None}
    texts = {
        key: column.texts
        for key, column in columns.items()
        if column.numbers is None or column.texts
    }
    date_units = {key: column.unit for key, column in columns.items() if column.unit}
    dates = {key: column.dates for key, column in columns.items() if column.dates}
    return Topic(name, time, fields, texts, {**(units or {}), **date_units}, faults, lines, dates)


def invalid_cells(
    column: str, cells: Sequence[tuple[int, str]], lines: Sequence[int]
) -> Iterator[str]:
    """Yield one message on the cells of a column that are no numbers, if any."""
    if cells:
        examples = [
            f"{cell!r} in row {row + 1}" + (f" (line {lines[row]})" if lines else "")
            for row, cell in cells[:_MAX_LISTED]
        ]
        more = f" and {len(cells) - _MAX_LISTED} more" if len(cells) > _MAX_LISTED else ""
        yield f"column `{column}` must hold numbers; got {', '.join(examples)}{more}"


def parse_number(cell: str, decimal: str = ".") -> float | None:
    """Return the number in a cell: NaN for a missing value, None for text."""
    # float() accepts underscores between digits; logs do not use them.
    text = cell if decimal == "." else cell.replace(".", "_").replace(",", ".")
    with suppress(ValueError):
        if "_" not in text:
            return float(text)
    if match := _THOUSANDS[decimal].fullmatch(cell):
        return parse_number(cell.replace(match[1], ""), decimal)
    return _NAN if is_missing(cell) else None


def is_number(cell: str, decimal: str = ".") -> bool:
    """Return whether a cell holds a number or a date."""
    if is_missing(cell):
        return False
    return parse_number(cell, decimal) is not None or is_date(cell)


def parse_numbers(cells: Sequence[str], decimal: str = ".") -> Column:
    """Parse a column of numbers."""
    if decimal == ".":
        with suppress(ValueError):
            values = np.fromiter(map(float, cells), np.float64, len(cells))
            if "_" not in "".join(cells):
                return Column(values)
    parsed = {cell: parse_number(cell, decimal) for cell in set(cells)}
    numbers = [parsed[cell] for cell in cells]
    invalid = tuple((row, cells[row]) for row, value in enumerate(numbers) if value is None)
    values = np.array([_NAN if value is None else value for value in numbers], dtype=np.float64)
    return Column(values, tuple(map(str.strip, cells)) if invalid else (), invalid)


def share_texts(cells: Iterable[str], texts: dict[str, str]) -> Iterable[str]:
    """Return cells such that equal ones are one object, which ``texts`` holds."""
    words = [*cells]
    return map(texts.setdefault, words, words)


def parse_column(cells: Sequence[str], decimal: str = ".", name: str = "") -> Column:
    """Parse a column of unknown content; segment labels keep text and numbers."""
    distinct = dict.fromkeys(cells)
    if name == SEGMENT:
        positions = {cell: index for index, cell in enumerate(distinct)}
        column, indices = parse_column([*positions], decimal), [positions[cell] for cell in cells]
        numbers = None if column.invalid else column.numbers
        labels = {cell: cell.strip() or _UNNAMED_SEGMENT for cell in distinct}
        return Column(
            None if numbers is None else numbers[indices], tuple(labels[cell] for cell in cells)
        )
    lowered = {cell: cell.strip().lower() for cell in distinct}
    present = [cell for cell, word in lowered.items() if word not in MISSING]
    if present and {*lowered.values()} <= {*_BOOLEANS, *MISSING}:
        return Column(np.array([_BOOLEANS.get(lowered[cell], _NAN) for cell in cells]))
    if present and all(map(is_date, present)):
        with suppress(ValueError):
            seconds, dates = parse_dates(cells)
            return Column(seconds, unit="s", dates=dates)
    column = parse_numbers(cells, decimal)
    if column.invalid and all(map(_COORDINATE.fullmatch, map(str.strip, present))):
        coordinates = _parse_coordinates(cells)
        # A number and a letter may be a quantity and its unit: 10.5 W is a power.
        if coordinates.unit or any(names.search(name) for names in COORDINATE_NAMES):
            return coordinates
    if 2 * len(column.invalid) <= sum(lowered[cell] not in MISSING for cell in cells):
        return column
    return Column(None, tuple(map(str.strip, cells)))


def _parse_coordinates(cells: Sequence[str]) -> Column:
    """Return latitudes or longitudes, negative in the south and west."""
    values, unit = np.full(len(cells), _NAN), ""
    for row, cell in enumerate(cells):
        if match := _COORDINATE.fullmatch(cell.strip()):
            numbers = [float(text.replace(",", ".")) for text in match.groups() if text]
            sign = -1.0 if {*match[0].upper()} & {*"SW"} else 1.0
            values[row] = sign * sum(number / 60.0**k for k, number in enumerate(numbers))
            unit = "deg" if len(numbers) > 1 else unit
    return Column(values, unit=unit)


class ColumnNames:
    """Unique column names of a table, and their units in brackets."""

    def __init__(self, header: Sequence[str]) -> None:
        pairs = [_split_unit(name) for name in header]
        # Brackets remain where only they make the names unique.
        if len({stem for stem, _ in pairs}) < len(set(header)):
            pairs = [(name, unit) for name, (_, unit) in zip(header, pairs, strict=True)]
        counts = Counter(stem for stem, _ in pairs)
        self.names = unique_names([stem for stem, _ in pairs])
        self.units = {name: unit for name, (_, unit) in zip(self.names, pairs, strict=True) if unit}
        self.faults = {
            name: f"column `{name}` occurs {times} times in the header; keep one"
            for name, times in counts.items()
            if name and times > 1
        }


def _split_unit(name: str) -> tuple[str, str]:
    """Split a name into stem and unit in brackets; empty for no unit."""
    match = _BRACKETED.fullmatch(name)
    bracketed = "0" if match is None else (match[2] or match[3] or "0").strip()
    if match is None or _ELEMENT.fullmatch(bracketed) or not (match[2] or is_unit(bracketed)):
        return name, ""
    return match[1], bracketed


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return names with a number added to repeated ones, and `column N` for empty ones."""
    labels = [name or f"column {number}" for number, name in enumerate(names, start=1)]
    counts, used = Counter(labels), set(labels)

    def make_unique(name: str) -> str:
        name = next(candidate for k in count(1) if (candidate := f"{name} ({k})") not in used)
        used.add(name)
        return name

    return tuple(make_unique(name) if counts[name] > 1 else name for name in labels)


class Row(NamedTuple):
    """A line split into cells."""

    line: int
    cells: tuple[str, ...]
    comment: bool

    @property
    def filled(self) -> int:
        """Number of cells without empty trailing ones."""
        return max((k for k, cell in enumerate(self.cells, start=1) if cell.strip()), default=0)

    def has_units(self) -> bool:
        """Return whether most cells are units."""
        cells = [cell for cell in self.cells if cell.strip()]
        return 2 * sum(map(is_unit, cells)) > len(cells)

    def join_brackets(self, width: int, delimiter: str) -> Row:
        """Join cells such as `pd(1,1)`, split at the comma in parentheses."""
        cells: list[str] = []
        for cell in self.cells:
            if cells and cells[-1].count("(") > cells[-1].count(")"):
                cells[-1] += delimiter + cell
            else:
                cells.append(cell)
        return self._replace(cells=tuple(cells)) if len(self.cells) > width == len(cells) else self


class Header:
    """Column names and units, parsed from the lines above the data."""

    def __init__(self, rows: Sequence[Row], filled: int, width: int, delimiter: str) -> None:
        self.names = unique_names([""] * filled)
        self.cells: tuple[str, ...] = ()
        self.units: dict[str, str] = {}
        self.faults: dict[str, str] = {}
        self.notes: list[str] = []
        rows = [row.join_brackets(width, delimiter) for row in rows]
        candidates = [row for row in rows if filled <= row.filled <= max(width, filled)]
        if not candidates and delimiter and rows and rows[-1].filled > 1:
            candidates = [rows[-1]]
        if not candidates:
            self.notes.append("there is no line of column names; columns are named by their number")
            return
        units = candidates.pop().cells if len(candidates) > 1 and candidates[-1].has_units() else ()
        *skipped_rows, row = candidates
        self.notes += [
            f"line {row.line} above the column names was skipped" for row in skipped_rows
        ]
        self.cells = tuple(cell.strip() for cell in row.cells[: row.filled])
        # Strip quotation marks, padding and LaTeX escapes.
        columns = ColumnNames([cell.strip('"').strip().replace("\\_", "_") for cell in self.cells])
        unit_row = zip(columns.names, (unit.strip().strip("[]()") for unit in units), strict=False)
        self.names, self.faults = columns.names, columns.faults
        self.units = columns.units | {name: unit for name, unit in unit_row if unit}
        self.notes += self.faults.values()


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


def join_blocks(dialect: Dialect, index: int, blocks: Sequence[Column]) -> Column:
    """Concatenate the blocks of a column."""
    arrays = [block.numbers for block in blocks if block.numbers is not None]
    if not arrays:
        return dialect.parse_column(index, [cell for block in blocks for cell in block.texts])
    starts = np.cumsum([0, *map(len, arrays)]).tolist()
    invalid = tuple(
        (start + row, cell)
        for start, block in zip(starts, blocks, strict=False)
        for row, cell in block.invalid
    )
    texts = (p.texts or map(repr, a.tolist()) for p, a in zip(blocks, arrays, strict=True))
    return Column(
        np.concatenate(arrays), tuple(chain.from_iterable(texts)) if invalid else (), invalid
    )

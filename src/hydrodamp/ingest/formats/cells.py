"""Cells of a table: the numbers, words and dates in them, and the names and units of columns."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import count

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import SEGMENT
from hydrodamp.data.recording import Topic
from hydrodamp.data.units import is_unit

#: What stands in a cell without a value, in lower case.
MISSING = frozenset(
    {"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "nat", "-", "1.#qnan", "-1.#ind"}
)

_TRUTH = {"true": 1.0, "false": 0.0}
_DATE = re.compile(
    r"\s*(?:(\d{4})[-/.](\d\d?)[-/.](\d\d?)|(\d\d?)[-/.](\d\d?)[-/.](\d{4}))?(?:^|[T ]+|$)"
    r"(?:(\d\d?):(\d\d)(?::(\d\d(?:[.,]\d*)?))?\s*([ap]m)?)?\s*(?:z|utc|([+-]\d\d):?(\d\d))?\s*$",
    re.IGNORECASE,
)
_DAY = 86400.0  # s
_NO_NAME = "unnamed"  # the label of a row without one
_NAN = float("nan")
_LISTED = 3
_BRACKETED = re.compile(r"(.*?\S)[ _]*(?:\[([^\[\]]*)\]|\(([^()]*)\))$")
_ELEMENT = re.compile(r"\d+")


@dataclass(frozen=True)
class Column:
    """What a column of cells holds: numbers, or words; and the rows that are no numbers."""

    numbers: FloatArray | None
    words: tuple[str, ...] = ()
    bad: tuple[tuple[int, str], ...] = ()
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Part:
    """Columns of a text, with the line of each row."""

    columns: tuple[Column, ...]
    lines: Sequence[int]
    notes: tuple[str, ...] = ()


def topic_of(
    name: str,
    columns: Mapping[str, Column],
    lines: Sequence[int] = (),
    *,
    time: FloatArray | None = None,
    units: Mapping[str, str] | None = None,
) -> Topic:
    """Return columns as a topic; those with cells that are no numbers are among its faults."""
    faults = {
        key: fault
        for key, column in columns.items()
        for fault in bad_cells(f"{name}.{key}" if name else key, column.bad, lines)
    }
    fields = {
        key: column.numbers
        for key, column in columns.items()
        if column.numbers is not None and not column.bad
    }
    words = {key: it.words for key, it in columns.items() if it.numbers is None or it.words}
    dated = {key: column.unit for key, column in columns.items() if column.unit}
    return Topic(name, time, fields, words, {**(units or {}), **dated}, faults, lines)


def bad_cells(called: str, bad: Sequence[tuple[int, str]], lines: Sequence[int]) -> Iterator[str]:
    """Name the cells of a column, if any, that are no numbers."""
    if bad:
        told = [
            f"{cell!r} in row {row + 1}" + (f" (line {lines[row]})" if lines else "")
            for row, cell in bad[:_LISTED]
        ]
        more = f" and {len(bad) - _LISTED} more" if len(bad) > _LISTED else ""
        yield f"column `{called}` must hold numbers; got {', '.join(told)}{more}"


def number(cell: str, decimal: str = ".") -> float | None:
    """Return the number in a cell."""
    # An underline makes it no number here, though Python allows one.
    text = cell if decimal == "." else cell.replace(".", "_").replace(",", ".")
    with suppress(ValueError):
        if "_" not in text:
            return float(text)
    return _NAN if is_missing(cell) else None


def is_number(cell: str, decimal: str = ".") -> bool:
    """Return whether a cell holds a number or a date."""
    if is_missing(cell):
        return False
    return number(cell, decimal) is not None or is_date(cell)


def is_date(cell: str) -> bool:
    """Return whether a cell holds a date, or a time of day to the second."""
    found = _DATE.match(cell)
    return found is not None and (found[1] or found[6] or found[9]) is not None


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value."""
    return cell.strip().lower() in MISSING


def numbers_of(cells: Sequence[str], decimal: str = ".") -> Column:
    """Return a column that should hold numbers."""
    if decimal == ".":
        with suppress(ValueError):
            values = np.fromiter(map(float, cells), np.float64, len(cells))
            if "_" not in "".join(cells):
                return Column(values)
    known = {cell: number(cell, decimal) for cell in set(cells)}
    found = [known[cell] for cell in cells]
    bad = tuple((row, cells[row]) for row, value in enumerate(found) if value is None)
    values = np.array([_NAN if value is None else value for value in found], dtype=np.float64)
    return Column(values, tuple(map(str.strip, cells)) if bad else (), bad)


def column_of(cells: Sequence[str], decimal: str = ".", name: str = "") -> Column:
    """Return a column of unknown content; that of labels keeps its words beside its numbers."""
    if name == SEGMENT:
        few = {cell: place for place, cell in enumerate(dict.fromkeys(cells))}
        column, places = column_of([*few], decimal), [few[cell] for cell in cells]
        called = [cell.strip() or _NO_NAME for cell in few]
        own = None if column.bad else column.numbers
        numbers = None if own is None else own[places]
        return Column(numbers, tuple(called[place] for place in places))
    there = [cell for cell in cells if not is_missing(cell)]
    plain = [cell.strip().lower() for cell in cells]
    if there and {*plain} <= {*_TRUTH, *MISSING}:
        return Column(np.array([_TRUTH.get(cell, _NAN) for cell in plain]))
    if there and all(map(is_date, there)):
        with suppress(ValueError):
            return Column(_seconds(cells), unit="s")
    column = numbers_of(cells, decimal)
    if 2 * len(column.bad) <= len(there):
        return column
    return Column(None, tuple(map(str.strip, cells)))


def _seconds(cells: Sequence[str]) -> FloatArray:
    """Return dates in seconds since 1970, and times of day since midnight, running on over it."""
    found = [None if is_missing(cell) else _DATE.match(cell) for cell in cells]
    is_day_first = any(int(one[4]) > 12 for one in found if one and one[4])
    days: dict[tuple[str | None, ...], float] = {(None,) * 6: 0.0}
    seconds = np.full(len(cells), _NAN)
    for row, one in enumerate(found):
        if one is None:
            continue
        if (date := one.groups()[:6]) not in days:
            first, second = (4, 5) if is_day_first else (5, 4)
            day, month = (3, 2) if one[1] else (first, second)
            given = datetime(int(one[1] or one[6]), int(one[month]), int(one[day]), tzinfo=UTC)
            days[date] = given.timestamp()
        hour = int(one[7] or 0)
        if one[10]:
            hour = hour % 12 + 12 * (one[10].lower() == "pm")
        zone = (int(one[11]) * 60 + int(one[11][0] + one[12])) * 60 if one[11] else 0
        rest = float((one[9] or "0").replace(",", "."))
        seconds[row] = days[date] + hour * 3600 + int(one[8] or 0) * 60 + rest - zone
    known = ~np.isnan(seconds)
    if seconds[known].max(initial=0.0) <= _DAY:
        seconds[known] = np.unwrap(seconds[known], period=_DAY)
    return seconds


class Names:
    """What the columns of a table are called, apart from the units that stand there in brackets."""

    def __init__(self, given: Sequence[str]) -> None:
        halves = [_split(name) for name in given]
        if len({stem for stem, _ in halves}) < len(set(given)):  # the brackets tell them apart
            halves = [(name, unit) for name, (_, unit) in zip(given, halves, strict=True)]
        counts = Counter(stem for stem, _ in halves)
        self.names = unique_names([stem for stem, _ in halves])
        self.units = {
            name: unit for name, (_, unit) in zip(self.names, halves, strict=True) if unit
        }
        self.faults = {
            name: f"column `{name}` stands {times} times in the header; keep one"
            for name, times in counts.items()
            if name and times > 1
        }


def _split(name: str) -> tuple[str, str]:
    """Split what stands in brackets off a name, and return it where it is a unit."""
    found = _BRACKETED.fullmatch(name)
    inside = "0" if found is None else (found[2] or found[3] or "0").strip()
    if found is None or _ELEMENT.fullmatch(inside) or not (found[2] or is_unit(inside)):
        return name, ""
    return found[1], inside


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return names with a number where they repeat, and with their place where there is none."""
    given = [name or f"column {place}" for place, name in enumerate(names, start=1)]
    counts, taken = Counter(given), set(given)

    def new(name: str) -> str:
        name = next(one for k in count(1) if (one := f"{name} ({k})") not in taken)
        taken.add(name)
        return name

    return tuple(new(name) if counts[name] > 1 else name for name in given)

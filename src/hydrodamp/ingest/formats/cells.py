"""Cells of text, and the numbers in them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from hydrodamp.arrays import FloatArray

MISSING = frozenset(
    {"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "nat", "-", "1.#qnan", "-1.#ind"}
)
"""What stands in a cell without a value, in lower case."""

_TRUTH = {"true": 1.0, "false": 0.0}
_DATE = re.compile(r"\s*\d{4}-\d\d-\d\d([T ]\d\d:\d\d.*)?$")
_NAN = float("nan")


@dataclass(frozen=True)
class Column:
    """What a column of cells holds: numbers, or words."""

    numbers: FloatArray | None
    words: tuple[str, ...] = ()
    bad: tuple[tuple[int, str], ...] = ()
    unit: str = ""


def number(cell: str, decimal: str = ".") -> float | None:
    """Return the number in a cell."""
    text = cell.strip()
    if decimal == ",":
        if "." in text:
            return _NAN if text.lower() in MISSING else None
        text = text.replace(",", ".")
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return _NAN if text.lower() in MISSING else None


def is_number(cell: str, decimal: str = ".") -> bool:
    """Return whether a cell holds a number or a date."""
    if is_missing(cell):
        return False
    return number(cell, decimal) is not None or _DATE.match(cell) is not None


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value."""
    return cell.strip().lower() in MISSING


def numbers_of(cells: Sequence[str], decimal: str = ".") -> Column:
    """Return a column that should hold numbers."""
    if decimal == ".":
        try:
            values = np.fromiter(map(float, cells), np.float64, len(cells))
        except ValueError:
            pass
        else:
            if "_" not in "".join(cells):
                return Column(values)
    known = {cell: number(cell, decimal) for cell in set(cells)}
    found = [known[cell] for cell in cells]
    bad = tuple((row, cells[row]) for row, value in enumerate(found) if value is None)
    values = np.array([_NAN if value is None else value for value in found], dtype=np.float64)
    return Column(values, tuple(map(str.strip, cells)) if bad else (), bad)


def column_of(cells: Sequence[str], decimal: str = ".") -> Column:
    """Return a column of unknown content."""
    there = [cell for cell in cells if not is_missing(cell)]
    if all(cell.strip().lower() in _TRUTH for cell in there) and there:
        return Column(np.array([_TRUTH.get(cell.strip().lower(), _NAN) for cell in cells]))
    if there and all(map(_DATE.match, there)):
        seconds = _seconds(cells)
        if seconds is not None:
            return Column(seconds, unit="s")
    column = numbers_of(cells, decimal)
    return (
        column if 2 * len(column.bad) <= len(there) else Column(None, tuple(map(str.strip, cells)))
    )


def _seconds(cells: Sequence[str]) -> FloatArray | None:
    """Return dates in seconds since 1970; None if one of them cannot be read."""
    try:
        return np.array([_NAN if is_missing(cell) else _second(cell) for cell in cells])
    except ValueError:
        return None


def _second(cell: str) -> float:
    date = datetime.fromisoformat(cell.strip())
    return (date if date.tzinfo else date.replace(tzinfo=UTC)).timestamp()

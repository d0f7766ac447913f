"""Comma-separated text to named columns of numbers, with the place of every bad cell."""

from __future__ import annotations

import csv
from array import array
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from pathlib import Path
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import FileError

_MISSING = frozenset({"", "nan", "na", "n/a", "null", "none"})
_LISTED = 3


@dataclass(eq=False)
class Table:
    """Columns of a text file, as far as they could be read.

    Attributes
    ----------
    source : str
        The file.
    names : tuple of str
        The header.
    numbers : dict of str to ndarray, shape (n,)
        The columns read as numbers; NaN where a cell is empty or bad.
    texts : dict of str to tuple of str
        The columns read as text.
    lines : list of int
        The line of the file of each row.
    faults : list of str
        One sentence each; cells that are no numbers are listed by column.
    unreadable : set of str
        The columns that hold cells which are no numbers.
    """

    source: str
    names: tuple[str, ...] = ()
    numbers: dict[str, FloatArray] = field(default_factory=dict)
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    lines: list[int] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    unreadable: set[str] = field(default_factory=set)


def read_table(
    path: str | Path, numbers: Collection[str] | None = None, texts: Collection[str] = ()
) -> Table:
    """Read columns of a comma-separated file with a header.

    Parameters
    ----------
    path : str or Path
        A UTF-8 file; a byte order mark, quoted cells and blank lines are tolerated.
    numbers : collection of str, optional
        The columns to read as numbers; all but ``texts`` where not given.
    texts : collection of str, optional
        The columns to read as text.

    Returns
    -------
    table : Table
        What could be read, and its faults. Names that are not in the header are
        not in the table either.

    Raises
    ------
    FileError
        If the file cannot be opened.
    """
    table = Table(str(path))
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            _fill(table, csv.reader(file, skipinitialspace=True), numbers, texts)
    except UnicodeDecodeError as error:
        table.faults.append(
            f"the file must be UTF-8 text; near byte {error.start} it is not. Save it as UTF-8"
        )
    except csv.Error as error:
        table.faults.append(f"the file is no comma-separated text: {error}")
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    return table


class _Rows(Protocol):
    """What ``csv.reader`` gives: rows, and the line the last one ended on."""

    @property
    def line_num(self) -> int: ...

    def __iter__(self) -> Iterator[list[str]]: ...


def _fill(
    table: Table,
    rows: _Rows,
    numbers: Collection[str] | None,
    texts: Collection[str],
) -> None:
    """Read the header, then the rows, into the table."""
    table.names = _header(rows)
    wanted = set(table.names if numbers is None else numbers) | set(texts)
    table.faults += _header_faults(table.names, wanted)
    if table.faults:
        return
    shown = [name for name in table.names if name in texts]
    read = [name for name in table.names if name in wanted and name not in texts]
    cells, labels = _body(table, rows, read, shown)
    block = np.array(cells, dtype=np.float64).reshape(len(table.lines), len(read))
    table.numbers = dict(zip(read, np.ascontiguousarray(block.T), strict=True))
    table.texts = dict(zip(shown, zip(*labels, strict=True), strict=False)) if labels else {}


def _header(rows: _Rows) -> tuple[str, ...]:
    names = [name.strip() for name in next((row for row in rows if any(row)), [])]
    while names and not names[-1]:
        names.pop()
    return tuple(names)


def _header_faults(names: tuple[str, ...], wanted: Collection[str]) -> Iterator[str]:
    if not names:
        yield "the file is empty; it must begin with a line of column names"
        return
    for separator, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and separator in names[0]:
            yield f"columns must be separated by commas; got {called}. Export with commas"
            return
    for name, count in Counter(names).items():
        if count > 1 and name and name in wanted:
            yield f"column `{name}` stands {count} times in the header; keep one"


def _body(
    table: Table, rows: _Rows, read: Sequence[str], shown: Sequence[str]
) -> tuple[array[float], list[tuple[str, ...]]]:
    """Read the rows: whole rows at once, cell by cell where that fails."""
    cells, labels, bad = array("d"), [], _BadCells(table)
    pick, show = _picker(table.names, read), _picker(table.names, shown)
    width, lines = len(table.names), table.lines
    for row in rows:
        if len(row) != width and not _pad(row, width, rows.line_num, table.faults):
            continue
        try:
            cells.extend([*map(float, pick(row))])
        except ValueError:
            if not any(cell.strip() for cell in row):
                continue
            place = f"row {len(lines) + 1} (line {rows.line_num})"
            cells.extend([*map(bad.number, read, pick(row), [place] * len(read))])
        lines.append(rows.line_num)
        if shown:
            labels.append(tuple(show(row)))
    bad.report()
    return cells, labels


def _picker(names: tuple[str, ...], chosen: Sequence[str]) -> Callable[[list[str]], Sequence[str]]:
    places = [names.index(name) for name in chosen]
    if len(places) > 1:
        return itemgetter(*places)
    return lambda row: [row[place] for place in places]


def _pad(row: list[str], width: int, line: int, faults: list[str]) -> bool:
    """Drop empty cells past the header; say if the row has another number of cells."""
    if not any(cell.strip() for cell in row):
        return False
    while len(row) > width and not row[-1].strip():
        row.pop()
    if len(row) == width:
        return True
    told = f"line {line} has {len(row)} cells, the header has {width}"
    ragged = sum("cells, the header has" in fault for fault in faults)
    if ragged < _LISTED:
        faults.append(told)
    return False


class _BadCells:
    """Cells that are no numbers, by column."""

    def __init__(self, table: Table) -> None:
        self.table = table
        self.places: dict[str, list[str]] = {}

    def number(self, name: str, cell: str, place: str) -> float:
        """Return the number in a cell; NaN if there is none, noting bad ones."""
        try:
            return float(cell)
        except ValueError:
            if cell.strip().lower() not in _MISSING:
                self.places.setdefault(name, []).append(f"{cell!r} in {place}")
            return float("nan")

    def report(self) -> None:
        """Put the bad cells among the faults of the table, one sentence a column."""
        self.table.unreadable |= set(self.places)
        for name, places in self.places.items():
            more = len(places) - _LISTED
            tail = f" and {more} more" if more > 0 else ""
            listed = ", ".join(places[:_LISTED])
            self.table.faults.append(f"column `{name}` must hold numbers; got {listed}{tail}")

"""Text in columns: CSV, TSV and what else lies between spaces.

Arrow reads what is clean; what is odd is read here row by row, and named with its line.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import IO, Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, Part, is_number, numbers_of, topic_of
from hydrodamp.ingest.formats.content import opened
from hydrodamp.ingest.formats.dialect import COMMENTS, DELIMITERS, WESTERN, Dialect, find_dialect

_BLOCK = 4096  # rows of strings that stay in the cache until they are numbers
_LISTED = 3
_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "none", "NaT"]
_BYTES = 1 << 19  # larger ones leave the cache and take half as long again
_SPACES = re.compile(rb"[ \t]+")
_MARGINS = re.compile(rb"(?m)^ +| +(?=\r?$)")
_PLAIN = frozenset("0123456789.+-")  # a row that begins so is no header, comment or blank


def read(path: str | Path) -> Recording:
    """Read text in columns with any header, delimiter, encoding and decimal sign."""
    dialect = find_dialect(path)
    part = _by_arrow(path, dialect) if any(dialect.numeric) else None
    return _recording(part or _careful(path, dialect), path, dialect)


def _recording(part: Part, path: str | Path, dialect: Dialect) -> Recording:
    """Return columns as a recording of one topic."""
    named = dict(zip(dialect.header.names, part.columns, strict=True))
    dated = [name for name, column in named.items() if column.unit]
    topic = topic_of("", named, part.lines, units=dialect.header.units)
    notes = [*dialect.header.notes, *part.notes, *topic.faults.values()]
    notes += [f"column `{name}` holds dates or times of day, read in seconds" for name in dated]
    topic = replace(topic, faults={**topic.faults, **dialect.header.faults})
    return Recording((topic,), str(path), "text in columns", tuple(notes))


def _careful(path: str | Path, dialect: Dialect) -> Part:
    """Read row by row."""
    read = _Rows(path, dialect)
    rows, lines = iter(read), list[int]()
    blocks: list[list[Column]] = []
    while block := [*islice(rows, _BLOCK)]:
        lines += [line for line, _ in block]
        blocks.append(_columns([cells for _, cells in block], dialect))
    read.check()
    pieces = [*zip(*blocks, strict=True)] or [()] * len(dialect.header.names)
    columns = tuple(_joined(dialect, *piece) for piece in enumerate(pieces))
    return Part(columns, lines, tuple(read.notes()))


def _columns(block: Sequence[Sequence[str]], dialect: Dialect) -> list[Column]:
    """Turn the cells of columns of numbers into numbers."""
    return [
        numbers_of(cells, dialect.decimal) if numeric else Column(None, cells)
        for cells, numeric in zip(zip(*block, strict=True), dialect.numeric, strict=True)
    ]


def _joined(dialect: Dialect, place: int, pieces: Sequence[Column]) -> Column:
    """Return the column that its blocks make."""
    arrays = [piece.numbers for piece in pieces if piece.numbers is not None]
    if not arrays:
        return dialect.column(place, [cell for piece in pieces for cell in piece.words])
    starts = np.cumsum([0, *map(len, arrays)]).tolist()
    placed = zip(starts, pieces, strict=False)
    bad = tuple((start + row, cell) for start, piece in placed for row, cell in piece.bad)
    if not bad:
        return Column(np.concatenate(arrays))
    words = (p.words or map(repr, a.tolist()) for p, a in zip(pieces, arrays, strict=True))
    return Column(np.concatenate(arrays), tuple(chain.from_iterable(words)), bad)


class _Rows:
    """The rows of a file, and the oddities on the way."""

    def __init__(self, path: str | Path, dialect: Dialect) -> None:
        self.path, self.dialect = path, dialect
        self.ragged: list[tuple[int, int]] = []
        self.passed: dict[str, list[int]] = {}
        self.spanning = self.line = 0
        self.ended = True

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        width, header = len(self.dialect.header.names), self.dialect.header.cells
        header = () if all(map(is_number, header)) else header
        try:
            for line, cells in self._split():
                if len(cells) > width and not any(map(str.strip, cells[width:])):
                    del cells[width:]
                if len(cells) == width and cells[0][:1] in _PLAIN:
                    yield line, cells
                elif not any(map(str.strip, cells)):
                    continue
                elif cells[0].lstrip().startswith(COMMENTS):
                    self._pass_over(line, "is a comment")
                elif header and tuple(map(str.strip, cells)) == header:
                    self._pass_over(line, "repeats the header")
                elif len(cells) != width:
                    self.ragged.append((line, len(cells)))
                    if not self.spanning and any("\n" in cell for cell in cells):
                        self.spanning = line
                else:
                    yield line, cells
        except csv.Error as error:
            raise LogError(
                f"line {self.line}: {error}. Is a quotation mark missing above?",
                source=str(self.path),
            ) from error

    def _split(self) -> Iterator[tuple[int, list[str]]]:
        """Yield the cells of each line below the header, and the number of the line."""
        delimiter, above = self.dialect.delimiter, self.dialect.first - 1
        with opened(self.path) as binary:
            text = io.TextIOWrapper(
                binary, encoding=self.dialect.encoding, errors=WESTERN, newline=""
            )
            lines = islice(self._lines(text), above, None)
            if not delimiter:
                yield from ((self.line, line.split()) for line in lines)
                return
            rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
            yield from ((above + rows.line_num, cells) for cells in rows)

    def _lines(self, text: io.TextIOWrapper) -> Iterator[str]:
        for line in text:
            self.line += 1
            self.ended = line.endswith(("\n", "\r"))
            if "\0" in line and not line.strip("\0\r\n"):
                self._pass_over(self.line, "is filled with zero bytes")
                yield "\n"
            else:
                yield line

    def _pass_over(self, line: int, what: str) -> None:
        self.passed.setdefault(what, []).append(line)

    def cut(self) -> int:
        """Return the last line where it lacks both its end and cells; else 0."""
        line, cells = self.ragged[-1] if self.ragged else (0, 0)
        is_last = line == self.line and not self.ended
        return line if is_last and cells < len(self.dialect.header.names) else 0

    def check(self) -> None:
        """Raise the faults so far."""
        faults = self.ragged[:-1] if self.cut() else self.ragged
        if not faults:
            return
        head = "the header has" if self.dialect.header.cells else "the first rows have"
        head = f"{head} {len(self.dialect.header.names)}"
        told = [f"line {line} has {cells} cells, {head}" for line, cells in faults[:_LISTED]]
        if len(faults) > _LISTED:
            told.append(f"so have {len(faults) - _LISTED} more lines")
        mark = DELIMITERS[self.dialect.delimiter]
        told[-1] += f". Cells are divided by {mark}; mend or drop these lines"
        if self.spanning:
            told.append(f"a cell goes on to line {self.spanning}: is a quotation mark missing?")
        raise LogError(told, source=str(self.path))

    def notes(self) -> Iterator[str]:
        """Say what was passed over."""
        if cut := self.cut():
            yield f"the last line ({cut}) is cut off; it was left out"
        for what, lines in self.passed.items():
            more = f", as do {len(lines) - 1} more lines" if len(lines) > 1 else ""
            yield f"line {lines[0]} {what}{more}; passed over"


def _by_arrow(path: str | Path, dialect: Dialect) -> Part | None:
    """Read all rows of a clean file; None where Arrow does not read it as it is meant."""
    try:
        from pyarrow import csv

        with opened(path) as file:
            text: IO[bytes] = file
            if not dialect.delimiter:  # made single, as Arrow wants them
                bare = file.read().decode(dialect.encoding, errors=WESTERN).encode()
                text = io.BytesIO(_MARGINS.sub(b"", _SPACES.sub(b" ", bare)))
            table: Any = csv.read_csv(text, **_options(csv, dialect))
    except (ImportError, ValueError, OverflowError, OSError):
        return None
    if _is_odd(table, dialect):
        return None
    columns = tuple(
        Column(arrow_numbers(column)) if numeric else dialect.column(place, column.to_pylist())
        for place, (column, numeric) in enumerate(zip(table.columns, dialect.numeric, strict=False))
    )
    return Part(columns, range(dialect.first, dialect.first + len(table)))


def arrow_numbers(column: Any) -> FloatArray:
    """Return the numbers of a column of Arrow in an array that nobody writes; NaN for none."""
    parts = (chunk.to_numpy(zero_copy_only=False) for chunk in column.chunks)
    values = np.concatenate([np.empty(0), *parts])
    values.setflags(write=False)
    return values


def _options(csv: Any, dialect: Dialect) -> dict[str, Any]:
    """Return what Arrow must know of the dialect; its columns are called by their place."""
    import pyarrow

    places = [str(place) for place in range(dialect.width)]
    kinds = [pyarrow.float64() if numeric else pyarrow.string() for numeric in dialect.numeric]
    kinds += [pyarrow.null()] * (dialect.width - len(kinds))
    plain = not dialect.delimiter or dialect.encoding.startswith("utf-8")
    return {
        "read_options": csv.ReadOptions(
            column_names=places,
            skip_rows=dialect.first - 1,
            use_threads=False,  # threads take a fifth more of the processor here
            block_size=_BYTES,
            encoding="utf8" if plain else dialect.encoding,
        ),
        "parse_options": csv.ParseOptions(
            delimiter=dialect.delimiter or " ",
            quote_char='"' if dialect.quoted else False,
            ignore_empty_lines=False,
        ),
        "convert_options": csv.ConvertOptions(
            column_types=dict(zip(places, kinds, strict=True)),
            null_values=_MISSING,
            decimal_point=dialect.decimal,
        ),
    }


def _is_odd(table: Any, dialect: Dialect) -> bool:
    """Return whether there are rows that Arrow reads otherwise than they are meant."""
    from pyarrow import compute

    columns = [*zip(table.columns, dialect.numeric, strict=False)]
    words = [column for column, numeric in columns if not numeric]
    first, numeric = columns[0]
    if numeric and not first.null_count and not words:
        return False
    blank: Any = True  # lines without any value, which Arrow takes for rows
    for column, numeric in columns:
        empty = compute.utf8_trim_whitespace(column) if not numeric else column
        empty = column.is_null() if numeric else compute.equal(empty, "")
        blank = compute.and_(blank, empty)
    odd = [blank]
    # Quotation marks and ends of lines that Arrow takes for letters, and comments among the rows.
    odd += [compute.match_substring_regex(column, '["\r\n]') for column in words]
    if not columns[0][1]:
        bare = compute.utf8_trim_whitespace(first)
        odd += [compute.starts_with(bare, mark) for mark in COMMENTS]
    return any(bool(compute.any(one).as_py()) for one in odd)

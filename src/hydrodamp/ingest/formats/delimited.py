"""Delimited text (CSV, TSV, white space): Arrow reads clean files, a row reader all others.

The row reader is slower but reports comments, repeated headers and ragged rows with their lines.
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
from hydrodamp.ingest.formats.cells import Column, ParsedTable, is_number, make_topic, parse_numbers
from hydrodamp.ingest.formats.content import open_log
from hydrodamp.ingest.formats.dialect import (
    COMMENTS,
    CP1252_FALLBACK,
    DELIMITERS,
    Dialect,
    find_dialect,
)

_BLOCK_ROWS = 4096  # rows; their strings fit in the cache
_MAX_LISTED = 3
_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "none", "NaT"]
_ARROW_BLOCK_BYTES = 1 << 19  # larger blocks exceed the cache: 1.5 times the time
_SPACES = re.compile(rb"[ \t]+")
_LINE_MARGINS = re.compile(rb"(?m)^ +| +(?=\r?$)")
_NUMBER_STARTS = frozenset("0123456789.+-")  # a row that begins so is data


def read_file(path: str | Path) -> Recording:
    """Read delimited text with any header, delimiter, encoding and decimal sign."""
    dialect = find_dialect(path)
    table = _read_with_arrow(path, dialect) if any(dialect.numeric) else None
    return _make_recording(table or _read_by_row(path, dialect), path, dialect)


def _make_recording(table: ParsedTable, path: str | Path, dialect: Dialect) -> Recording:
    """Return columns as a recording with one topic."""
    columns = dict(zip(dialect.header.names, table.columns, strict=True))
    dates = [name for name, column in columns.items() if column.unit]
    topic = make_topic("", columns, table.lines, units=dialect.header.units)
    notes = [*dialect.header.notes, *table.notes, *topic.faults.values()]
    notes += [
        f"column `{name}` holds dates or times of day; it is read in seconds" for name in dates
    ]
    topic = replace(topic, faults={**topic.faults, **dialect.header.faults})
    return Recording((topic,), str(path), "text in columns", tuple(notes))


def _read_by_row(path: str | Path, dialect: Dialect) -> ParsedTable:
    """Read all rows one by one."""
    reader = _RowReader(path, dialect)
    rows, lines = iter(reader), list[int]()
    blocks: list[list[Column]] = []
    while block := [*islice(rows, _BLOCK_ROWS)]:
        lines += [line for line, _ in block]
        blocks.append(_parse_block([cells for _, cells in block], dialect))
    reader.check()
    by_column = [*zip(*blocks, strict=True)] or [()] * len(dialect.header.names)
    columns = tuple(_join_blocks(dialect, *entry) for entry in enumerate(by_column))
    return ParsedTable(columns, lines, tuple(reader.notes()))


def _parse_block(block: Sequence[Sequence[str]], dialect: Dialect) -> list[Column]:
    """Parse the numeric columns of a block of rows."""
    return [
        parse_numbers(cells, dialect.decimal) if numeric else Column(None, cells)
        for cells, numeric in zip(zip(*block, strict=True), dialect.numeric, strict=True)
    ]


def _join_blocks(dialect: Dialect, index: int, blocks: Sequence[Column]) -> Column:
    """Concatenate the blocks of a column."""
    arrays = [block.numbers for block in blocks if block.numbers is not None]
    if not arrays:
        return dialect.parse_column(index, [cell for block in blocks for cell in block.texts])
    starts = np.cumsum([0, *map(len, arrays)]).tolist()
    blocks_with_start = zip(starts, blocks, strict=False)
    invalid = tuple(
        (start + row, cell) for start, block in blocks_with_start for row, cell in block.invalid
    )
    if not invalid:
        return Column(np.concatenate(arrays))
    texts = (p.texts or map(repr, a.tolist()) for p, a in zip(blocks, arrays, strict=True))
    return Column(np.concatenate(arrays), tuple(chain.from_iterable(texts)), invalid)


class _RowReader:
    """Iterator over the rows of a file that records skipped and ragged lines."""

    def __init__(self, path: str | Path, dialect: Dialect) -> None:
        self.path, self.dialect = path, dialect
        self.ragged: list[tuple[int, int]] = []
        self.skipped: dict[str, list[int]] = {}
        self.multiline = self.line = 0
        self.has_line_end = True

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        width, header = len(self.dialect.header.names), self.dialect.header.cells
        header = () if all(map(is_number, header)) else header
        try:
            for line, cells in self._split():
                if len(cells) > width and not any(map(str.strip, cells[width:])):
                    del cells[width:]
                if len(cells) == width and cells[0][:1] in _NUMBER_STARTS:
                    yield line, cells
                elif not any(map(str.strip, cells)):
                    continue
                elif cells[0].lstrip().startswith(COMMENTS):
                    self._skip(line, "is a comment")
                elif header and tuple(map(str.strip, cells)) == header:
                    self._skip(line, "repeats the header")
                elif len(cells) != width:
                    self.ragged.append((line, len(cells)))
                    if not self.multiline and any("\n" in cell for cell in cells):
                        self.multiline = line
                else:
                    yield line, cells
        except csv.Error as error:
            raise LogError(
                f"line {self.line}: {error}. Check for a missing quotation mark above it",
                source=str(self.path),
            ) from error

    def _split(self) -> Iterator[tuple[int, list[str]]]:
        """Yield line number and cells of each line below the header."""
        delimiter, above = self.dialect.delimiter, self.dialect.first_line - 1
        with open_log(self.path) as binary:
            text = io.TextIOWrapper(
                binary, encoding=self.dialect.encoding, errors=CP1252_FALLBACK, newline=""
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
            self.has_line_end = line.endswith(("\n", "\r"))
            if "\0" in line and not line.strip("\0\r\n"):
                self._skip(self.line, "is filled with zero bytes")
                yield "\n"
            else:
                yield line

    def _skip(self, line: int, reason: str) -> None:
        self.skipped.setdefault(reason, []).append(line)

    def truncated_line(self) -> int:
        """Return the number of the last line if it is truncated; else 0."""
        line, cells = self.ragged[-1] if self.ragged else (0, 0)
        is_last = line == self.line and not self.has_line_end
        return line if is_last and cells < len(self.dialect.header.names) else 0

    def check(self) -> None:
        """Raise LogError if there are ragged lines."""
        faults = self.ragged[:-1] if self.truncated_line() else self.ragged
        if not faults:
            return
        columns = "the header has" if self.dialect.header.cells else "the first rows have"
        columns = f"{columns} {len(self.dialect.header.names)}"
        messages = [
            f"line {line} has {cells} cells, {columns}" for line, cells in faults[:_MAX_LISTED]
        ]
        if len(faults) > _MAX_LISTED:
            messages.append(f"so do {len(faults) - _MAX_LISTED} more lines")
        mark = DELIMITERS[self.dialect.delimiter]
        messages[-1] += f". The delimiters are {mark}; correct or delete these lines"
        if self.multiline:
            messages.append(
                f"a cell continues on line {self.multiline}; check for a missing quotation mark"
            )
        raise LogError(messages, source=str(self.path))

    def notes(self) -> Iterator[str]:
        """Yield a note on each kind of skipped line."""
        if line := self.truncated_line():
            yield f"the last line ({line}) is truncated; it was skipped"
        for reason, lines in self.skipped.items():
            more = f", as do {len(lines) - 1} more lines" if len(lines) > 1 else ""
            yield f"line {lines[0]} {reason}{more}; skipped"


def _read_with_arrow(path: str | Path, dialect: Dialect) -> ParsedTable | None:
    """Read a clean file; None where Arrow fails or misreads it."""
    try:
        from pyarrow import csv

        with open_log(path) as file:
            text: IO[bytes] = file
            if not dialect.delimiter:  # Arrow needs single spaces
                utf8 = file.read().decode(dialect.encoding, errors=CP1252_FALLBACK).encode()
                text = io.BytesIO(_LINE_MARGINS.sub(b"", _SPACES.sub(b" ", utf8)))
            table: Any = csv.read_csv(text, **_arrow_options(csv, dialect))
    except (ImportError, ValueError, OverflowError, OSError):
        return None
    if _is_misread(table, dialect):
        return None
    columns = tuple(
        Column(arrow_numbers(column))
        if numeric
        else dialect.parse_column(index, column.to_pylist())
        for index, (column, numeric) in enumerate(zip(table.columns, dialect.numeric, strict=False))
    )
    return ParsedTable(columns, range(dialect.first_line, dialect.first_line + len(table)))


def arrow_numbers(column: Any) -> FloatArray:
    """Return an Arrow column as a read-only array; NaN for null."""
    arrays = (chunk.to_numpy(zero_copy_only=False) for chunk in column.chunks)
    values = np.concatenate([np.empty(0), *arrays])
    values.setflags(write=False)
    return values


def _arrow_options(csv: Any, dialect: Dialect) -> dict[str, Any]:
    """Return Arrow's options for a dialect; columns are named by their index."""
    import pyarrow

    names = [str(index) for index in range(dialect.width)]
    types = [pyarrow.float64() if numeric else pyarrow.string() for numeric in dialect.numeric]
    types += [pyarrow.null()] * (dialect.width - len(types))
    is_utf8 = not dialect.delimiter or dialect.encoding.startswith("utf-8")
    return {
        "read_options": csv.ReadOptions(
            column_names=names,
            skip_rows=dialect.first_line - 1,
            use_threads=False,  # threads take 20 % more CPU time here
            block_size=_ARROW_BLOCK_BYTES,
            encoding="utf8" if is_utf8 else dialect.encoding,
        ),
        "parse_options": csv.ParseOptions(
            delimiter=dialect.delimiter or " ",
            quote_char='"' if dialect.has_quotes else False,
            ignore_empty_lines=False,
        ),
        "convert_options": csv.ConvertOptions(
            column_types=dict(zip(names, types, strict=True)),
            null_values=_MISSING,
            decimal_point=dialect.decimal,
        ),
    }


def _is_misread(table: Any, dialect: Dialect) -> bool:
    """Return whether Arrow took blank lines, comments or quotation marks for data."""
    from pyarrow import compute

    columns = [*zip(table.columns, dialect.numeric, strict=False)]
    texts = [column for column, numeric in columns if not numeric]
    first, numeric = columns[0]
    if numeric and not first.null_count and not texts:
        return False
    blank: Any = True  # blank lines, which Arrow takes for rows
    for column, numeric in columns:
        empty = compute.utf8_trim_whitespace(column) if not numeric else column
        empty = column.is_null() if numeric else compute.equal(empty, "")
        blank = compute.and_(blank, empty)
    misread = [blank]
    # Quotation marks and line ends that Arrow takes for text, and comments between rows.
    misread += [compute.match_substring_regex(column, '["\r\n]') for column in texts]
    if not columns[0][1]:
        stripped = compute.utf8_trim_whitespace(first)
        misread += [compute.starts_with(stripped, mark) for mark in COMMENTS]
    return any(bool(compute.any(mask).as_py()) for mask in misread)

"""Delimited text (CSV, TSV, white space): detection of its dialect, and reading by row.

Each pair of delimiter and decimal sign is scored by the share of cells that are numbers times the
share of rows of equal width; the best one is the dialect. Arrow reads clean files; the row reader
is slower but reports comments, repeated headers and ragged rows with their lines.
"""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

from hydrodamp.data.channels import SEGMENT
from hydrodamp.data.recording import Recording
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.arrow import read_csv
from hydrodamp.ingest.formats.cells import (
    COMMENTS,
    Column,
    Dialect,
    Header,
    Row,
    is_number,
    join_blocks,
    make_topic,
    parse_number,
    parse_numbers,
    share_texts,
)
from hydrodamp.ingest.formats.content import (
    CP1252_FALLBACK,
    ENCODINGS,
    check_cells,
    check_columns,
    open_log,
    read_head,
)
from hydrodamp.ingest.formats.dates import is_missing
from hydrodamp.ingest.formats.long_form import pivot_long_form

_HEAD_BYTES = 1 << 18  # bytes
_LINE = re.compile("\r\n|\n|\r")

#: In order of preference; the empty string is any white space.
DELIMITERS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", "": "spaces"}
_COMMENT = re.compile(r"\s*(#|%|//)+")
_SAMPLE_LINES = 200  # lines
_BLOCK_ROWS = 4096  # rows; their strings fit in the cache
_MAX_LISTED = 3
_MAX_LINE = 1 << 20  # characters; a table of the most columns has a tenth of it
_NUMBER_STARTS = frozenset("0123456789.+-")  # a row that begins so is data


def read_file(path: str | Path) -> Recording:
    """Read delimited text with any header, delimiter, encoding and decimal sign."""
    dialect = find_dialect(path)
    header, notes = dialect.header, list(dialect.header.notes)
    table = read_csv(path, dialect, CP1252_FALLBACK) if any(dialect.numeric) else None
    cells, lines = table or _read_by_row(path, dialect, notes)
    columns = dict(zip(header.names, cells, strict=True))
    topic = make_topic("", columns, lines, units=header.units)
    notes += topic.faults.values()
    notes += [
        f"column `{name}` holds dates or times of day; it is read in seconds"
        for name, column in columns.items()
        if column.unit
    ]
    topic = replace(topic, faults={**topic.faults, **header.faults})
    return pivot_long_form(Recording((topic,), str(path), "text in columns", tuple(notes)))


def _read_by_row(
    path: str | Path, dialect: Dialect, notes: list[str]
) -> tuple[list[Column], Sequence[int]]:
    """Return columns and line numbers, read row by row in blocks."""
    reader = _RowReader(path, dialect)
    rows, lines = iter(reader), array("q")
    blocks: list[list[Column]] = []
    texts: dict[str, str] = {}
    while block := [*islice(rows, _BLOCK_ROWS)]:
        lines.extend(line for line, _ in block)
        columns = zip(*(cells for _, cells in block), strict=True)
        blocks.append(
            [
                parse_numbers(cells, dialect.decimal)
                if numeric
                else Column(None, tuple(share_texts(cells, texts)))
                for cells, numeric in zip(columns, dialect.numeric, strict=True)
            ]
        )
        check_cells(len(lines) * len(dialect.header.names), path, len(texts))
    notes += reader.notes()
    by_column = [*zip(*blocks, strict=True)] or [()] * len(dialect.header.names)
    return [join_blocks(dialect, k, column) for k, column in enumerate(by_column)], lines


class _RowReader:
    """Iterator over the rows of a file that records skipped and ragged lines."""

    def __init__(self, path: str | Path, dialect: Dialect) -> None:
        self.path, self.dialect = path, dialect
        self.ragged: list[tuple[int, int]] = []  # the first ones and the last
        self.skipped: dict[str, int] = {}  # the first line of each reason
        self.counts: Counter[str] = Counter()
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
                    self.counts["is ragged"] += 1
                    del self.ragged[_MAX_LISTED:]
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
        encoding = self.dialect.encoding
        with open_log(self.path) as binary:
            text = io.TextIOWrapper(binary, encoding=encoding, errors=CP1252_FALLBACK, newline="")
            lines = islice(self._lines(text), above, None)
            if not delimiter:
                yield from ((self.line, line.split()) for line in lines)
                return
            rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
            yield from ((above + rows.line_num, cells) for cells in rows)

    def _lines(self, text: io.TextIOWrapper) -> Iterator[str]:
        for line in iter(partial(text.readline, _MAX_LINE), ""):
            self.line += 1
            self.has_line_end = line.endswith(("\n", "\r"))
            if len(line) == _MAX_LINE and not self.has_line_end:
                fault = f"line {self.line} has more than {_MAX_LINE} characters: it is no table"
                raise LogError(fault, source=str(self.path))
            is_zero = "\0" in line and not line.strip("\0\r\n")
            if is_zero:
                self._skip(self.line, "is filled with zero bytes")
            yield "\n" if is_zero else line

    def _skip(self, line: int, reason: str) -> None:
        self.skipped.setdefault(reason, line)
        self.counts[reason] += 1

    def notes(self) -> Iterator[str]:
        """Yield a note on each kind of skipped line; raise LogError if there are ragged lines."""
        header = self.dialect.header
        line, n_cells = self.ragged[-1] if self.ragged else (0, 0)
        if line == self.line and not self.has_line_end and n_cells < len(header.names):
            yield f"the last line ({line}) is truncated; it was skipped"
            self.ragged.pop()
            self.counts["is ragged"] -= 1
        if self.ragged:
            columns = f"the {'header has' if header.cells else 'first rows have'}"
            messages = [
                f"line {line} has {cells} cells, {columns} {len(header.names)}"
                for line, cells in self.ragged[:_MAX_LISTED]
            ]
            if (n_more := self.counts["is ragged"] - _MAX_LISTED) > 0:
                messages.append(f"so do {n_more} more lines")
            mark = DELIMITERS[self.dialect.delimiter]
            messages[-1] += f". The delimiters are {mark}; correct or delete these lines"
            if self.multiline:
                messages.append(
                    f"a cell continues on line {self.multiline}; check for a missing quotation mark"
                )
            raise LogError(messages, source=str(self.path))
        for reason, line in self.skipped.items():
            n_more = self.counts[reason] - 1
            more = f", as do {n_more} more lines" if n_more else ""
            yield f"line {line} {reason}{more}; skipped"


def find_dialect(path: str | Path) -> Dialect:
    """Detect the dialect of a file from its first lines."""
    head = read_head(path, _HEAD_BYTES)
    encodings = (name for signature, name in ENCODINGS.items() if re.match(signature, head))
    encoding = next(encodings, "utf-8")
    lines = _LINE.split(head.rstrip(b"\0").decode(encoding, errors=CP1252_FALLBACK))
    if len(head) == _HEAD_BYTES and len(lines) > 1:
        lines.pop()
    has_quotes, lines = '"' in "".join(lines), lines[:_SAMPLE_LINES]
    check_columns(max(len(line.split(mark or None)) for line in lines for mark in DELIMITERS), path)
    try:
        tables = {mark: rows for mark in DELIMITERS if (rows := _split_rows(lines, mark))}
    except csv.Error as error:
        raise LogError(f"expected delimited text; {error}", source=str(path)) from error
    if not tables:
        fault = "the file is empty; it must begin with a line of column names"
        raise LogError(fault, source=str(path))
    candidates = [(mark, decimal) for mark in tables for decimal in ".,"]
    delimiter, decimal = max(candidates, key=lambda pair: _score_dialect(tables[pair[0]], pair[1]))
    if all(len(row.cells) == 1 for row in tables[delimiter]):
        # No delimiter splits the rows: take the one that splits the first line.
        splitting = (mark for mark in tables if mark and tables[mark][0].filled > 1)
        delimiter = next(splitting, next(iter(tables)))
    rows = tables[delimiter]
    regular, _ = _regular_rows(rows, decimal)
    width = len(regular[0])
    is_numeric = [_is_numeric(column, decimal) for column in zip(*regular, strict=True)]
    start = next((k for k in range(len(rows)) if _is_data(rows, k, is_numeric, decimal)), 1)
    filled = max((row.filled for row in rows[start:] if len(row.cells) == width), default=width)
    header = Header(rows[:start], filled, width, delimiter)
    numeric = (
        is_numeric[k : k + 1] == [True] and name != SEGMENT for k, name in enumerate(header.names)
    )
    return Dialect(
        encoding,
        has_quotes,
        delimiter,
        decimal,
        header,
        tuple(numeric),
        width=max(width, len(header.names)),
        first_line=rows[start].line if start < len(rows) else rows[-1].line + 1,
    )


def _split_rows(lines: Sequence[str], delimiter: str) -> list[Row]:
    """Split lines into non-empty rows, without comment marks."""
    rows = []
    for line, text in enumerate(lines, start=1):
        mark = _COMMENT.match(text)
        content, cells = text[mark.end() :] if mark else text, list[str]()
        if delimiter:
            cells = next(csv.reader([content], delimiter=delimiter, skipinitialspace=True), cells)
        rows.append(Row(line, tuple(cells if delimiter else content.split()), mark is not None))
    return [row for row in rows if row.filled]


def _regular_rows(rows: Sequence[Row], decimal: str) -> tuple[list[tuple[str, ...]], float]:
    """Return rows of the width that holds most numbers, and their share.

    Only the second half of the rows counts, which lies below any header.
    """
    cells = [row.cells for row in rows if not row.comment] or [row.cells for row in rows]
    cells = cells[len(cells) // 2 :]
    weights: Counter[int] = Counter()
    for row in cells:
        weights[len(row)] += 1 + 1000 * sum(is_number(cell, decimal) for cell in row)
    width = weights.most_common(1)[0][0]
    regular = [row for row in cells if len(row) == width]
    return regular, len(regular) / len(cells)


def _score_dialect(rows: Sequence[Row], decimal: str) -> tuple[float, bool, float]:
    """Return the score of a delimiter: numbers, several columns, equal widths."""
    regular, regularity = _regular_rows(rows, decimal)
    cells = [cell for row in regular for cell in row if not is_missing(cell)]
    numbers = sum(is_number(cell, decimal) for cell in cells) / max(len(cells), 1)
    return round(numbers * regularity, 3), len(regular[0]) > 1, regularity


def _is_numeric(cells: Sequence[str], decimal: str) -> bool:
    present = [cell for cell in cells if not is_missing(cell)]
    numbers = sum(parse_number(cell, decimal) is not None for cell in present)
    return bool(present) and 2 * numbers >= len(present)


def _is_data(rows: Sequence[Row], index: int, numeric: Sequence[bool], decimal: str) -> bool:
    """Return whether a row is data and no header, by its cells in numeric columns."""
    row = rows[index]
    cells = [cell for cell, is_so in zip(row.cells, numeric, strict=False) if is_so]
    if row.comment or not cells or row.has_units():
        return False
    words = sum(not is_missing(cell) and not is_number(cell, decimal) for cell in cells)
    has_header = any(1 < above.filled >= row.filled for above in rows[:index])
    is_complete = words == 0 and len(row.cells) == len(numeric)
    return 2 * words <= len(cells) and (has_header or is_complete)

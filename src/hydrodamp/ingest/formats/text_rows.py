"""Text in columns, row by row: what every oddity is, and where it stands."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain, islice

import numpy as np

from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, is_number, numbers_of
from hydrodamp.ingest.formats.content import followed
from hydrodamp.ingest.formats.dialect import Dialect
from hydrodamp.ingest.formats.text_table import COMMENTS, TextColumns, TextFile

_BLOCK = 4096  # rows of strings that stay in the cache until they are numbers
_LISTED = 3
_PLAIN = frozenset("0123456789.+-")  # a row that begins so is no header, comment or blank


def read(file: TextFile) -> TextColumns:
    """Read all rows."""
    return next(parts(file, None))


def parts(file: TextFile, rows: int | None, skip: int = 0) -> Iterator[TextColumns]:
    """Read rows part by part."""
    met, part = _Rows(file), _Part(file, skip)
    for line, cells in islice(met, skip, None):
        part.add(line, cells)
        if len(part.lines) == rows:
            met.check()
            yield part.taken([*met.notes()])
    met.check()
    if part.lines or rows is None:
        yield part.taken([*met.notes()])


@dataclass
class _Part:
    """Rows on their way to columns: strings for a block at most, numbers from then on."""

    file: TextFile
    skipped: int = 0
    lines: list[int] = field(default_factory=list)
    block: list[Sequence[str]] = field(default_factory=list)
    done: list[list[Column]] = field(default_factory=list)

    def add(self, line: int, cells: Sequence[str]) -> None:
        self.lines.append(line)
        self.block.append(cells)
        if len(self.block) == _BLOCK:
            self._turn()

    def taken(self, notes: Sequence[str]) -> TextColumns:
        """Return the columns so far, and begin anew."""
        self._turn()
        dialect = self.file.dialect
        pieces = [*zip(*self.done, strict=True)] or [()] * len(dialect.names)
        columns = tuple(_joined(dialect, *column) for column in enumerate(pieces))
        result = TextColumns(columns, self.lines, self.skipped, tuple(notes))
        self.skipped += len(self.lines)
        self.lines, self.done = [], []
        return result

    def _turn(self) -> None:
        """Turn the cells of columns of numbers into numbers."""
        if not self.block:
            return
        dialect = self.file.dialect
        columns = zip(zip(*self.block, strict=True), dialect.numeric, strict=True)
        self.done.append(
            [
                numbers_of(cells, dialect.decimal) if numeric else Column(None, cells)
                for cells, numeric in columns
            ]
        )
        self.block = []


def _joined(dialect: Dialect, place: int, pieces: Sequence[Column]) -> Column:
    """Return the column that its blocks make."""
    arrays = [piece.numbers for piece in pieces if piece.numbers is not None]
    if not arrays:
        return dialect.column(place, [cell for piece in pieces for cell in piece.words])
    starts = np.cumsum([0, *map(len, arrays)]).tolist()
    bad = tuple(
        (start + row, cell)
        for start, piece in zip(starts, pieces, strict=False)
        for row, cell in piece.bad
    )
    if not bad:
        return Column(np.concatenate(arrays))
    words = (
        piece.words or map(repr, array.tolist())
        for piece, array in zip(pieces, arrays, strict=True)
    )
    return Column(np.concatenate(arrays), tuple(chain.from_iterable(words)), bad)


class _Rows:
    """The rows of a file, and what was met on the way."""

    def __init__(self, file: TextFile) -> None:
        self.file = file
        self.ragged: list[tuple[int, int]] = []
        self.spanning = 0
        self.repeated: list[int] = []
        self.comments: list[int] = []
        self.empty: list[int] = []
        self.ended = True
        self.line = 0

    def __iter__(self) -> Iterator[tuple[int, Sequence[str]]]:
        dialect = self.file.dialect
        width, header = len(dialect.names), dialect.header
        header = () if all(map(is_number, header)) else header
        try:
            for line, cells in self._split():
                if len(cells) == width and cells[0][:1] in _PLAIN:
                    yield line, cells
                    continue
                if not any(map(str.strip, cells)):
                    continue
                if len(cells) > width and not any(map(str.strip, cells[width:])):
                    del cells[width:]
                if cells[0].lstrip().startswith(COMMENTS):
                    self.comments.append(line)
                elif header and tuple(map(str.strip, cells)) == header:
                    self.repeated.append(line)
                elif len(cells) != width:
                    self.ragged.append((line, len(cells)))
                    if not self.spanning and any("\n" in cell for cell in cells):
                        self.spanning = line
                else:
                    yield line, cells
        except csv.Error as error:
            raise LogError(
                f"line {self.line}: {error}. Is a quotation mark missing above?",
                source=str(self.file.path),
            ) from error

    def _split(self) -> Iterator[tuple[int, list[str]]]:
        """Yield the cells of each line below the header, and the number of the line."""
        delimiter, above = self.file.dialect.delimiter, self.file.dialect.first - 1
        with followed(self.file.path) as binary:
            text = io.TextIOWrapper(
                binary, encoding=self.file.encoding, errors="replace", newline=""
            )
            lines = islice(self._lines(text), above, None)
            if not delimiter:
                for line in lines:
                    yield self.line, line.split()
                return
            rows = csv.reader(lines, delimiter=delimiter, skipinitialspace=True)
            for cells in rows:
                yield above + rows.line_num, cells

    def _lines(self, text: io.TextIOWrapper) -> Iterator[str]:
        for line in text:
            self.line += 1
            self.ended = line.endswith(("\n", "\r"))
            if "\0" in line and not line.strip("\0\r\n"):
                self.empty.append(self.line)
                yield "\n"
            else:
                yield line

    def cut(self) -> int:
        """Return the last line where it lacks both its end and cells; else 0."""
        if self.ended or not self.ragged or self.ragged[-1][0] != self.line:
            return 0
        return self.line if self.ragged[-1][1] < len(self.file.dialect.names) else 0

    def check(self) -> None:
        """Raise the faults so far."""
        faults = self.ragged[:-1] if self.cut() else self.ragged
        if not faults:
            return
        dialect = self.file.dialect
        head = "the header has" if dialect.header else "the first rows have"
        head = f"{head} {len(dialect.names)}"
        told = [f"line {line} has {cells} cells, {head}" for line, cells in faults[:_LISTED]]
        if len(faults) > _LISTED:
            told.append(f"so have {len(faults) - _LISTED} more lines")
        told[-1] += f". Cells are told apart by {dialect.called}; mend or drop these lines"
        if self.spanning:
            told.append(f"a cell goes on to line {self.spanning}: is a quotation mark missing?")
        raise LogError(told, source=str(self.file.path))

    def notes(self) -> Iterator[str]:
        """Tell once what was put up with."""
        if cut := self.cut():
            yield f"the last line ({cut}) is cut off; it was left out"
        for lines, what in (
            (self.repeated, "repeats the header"),
            (self.comments, "is a comment"),
            (self.empty, "is filled with zero bytes"),
        ):
            if lines:
                more = f", as do {len(lines) - 1} more lines" if len(lines) > 1 else ""
                yield f"line {lines[0]} {what}{more}; passed over"
                lines.clear()

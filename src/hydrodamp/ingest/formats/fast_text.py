"""Clean text in columns, read by Arrow; anything odd is left to the careful reader."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hydrodamp.advance import By, advance, within
from hydrodamp.arrays import FloatArray
from hydrodamp.ingest.formats.cells import Column
from hydrodamp.ingest.formats.content import GZIP, followed
from hydrodamp.ingest.formats.extras import installed
from hydrodamp.ingest.formats.text_table import COMMENTS, OddTextError, TextColumns, TextFile

_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "none", "NaT"]
_BLOCK = 1 << 19  # larger ones leave the cache and take half as long again
_PIECE = 1 << 23
_END = ord("\n")
_SPACES = re.compile(rb"[ \t]+")
_UNPACKED = 0.6  # what share of the time it takes to unpack, decode and trim a text
_MARGINS = re.compile(rb"(?m)^ +| +(?=\r?$)")


def read(file: TextFile) -> TextColumns:
    """Read all rows of a clean file."""
    if not any(file.dialect.numeric):
        raise OddTextError
    pieces = _pieces(_source(file), file.dialect.first - 1)
    with within(0.0 if _is_plain(file) else _UNPACKED, 1.0):
        kept = _Kept.empty(file, pieces[-1].stop)
        if len(pieces) == 1:
            kept.fill(pieces[0])
        else:
            with ThreadPoolExecutor(len(pieces)) as pool:
                list(pool.map(kept.fill, pieces))
    return kept.columns()


def parts(file: TextFile, rows: int) -> Iterator[TextColumns]:
    """Read the rows of a clean file part by part."""
    if not any(file.dialect.numeric):
        raise OddTextError
    arrow, waiting, done = _arrow(), [], 0
    for batch in _batches(file, _source(file), file.dialect.first - 1):
        waiting.append(batch)
        while sum(map(len, waiting)) >= rows:
            table = arrow.Table.from_batches(waiting)
            yield _part(table.slice(0, rows), file, done)
            done += rows
            waiting = table.slice(rows).to_batches()
    if any(map(len, waiting)):
        yield _part(arrow.Table.from_batches(waiting), file, done)


def _batches(file: TextFile, source: Any, skip: int) -> Iterator[Any]:
    """Yield the rows as Arrow parses them, block by block."""
    csv = _arrow(".csv")
    reader = _arrow().BufferReader(source)
    try:
        for batch in csv.open_csv(reader, **_options(csv, file, skip)):
            if _is_odd(batch, file.dialect.numeric):
                raise OddTextError
            yield batch
    except (ValueError, OverflowError, OSError) as error:
        raise OddTextError from error


@dataclass(frozen=True, eq=False)
class _Piece:
    """Whole lines of a text, and the rows they should be."""

    source: Any
    skip: int
    start: int
    stop: int


@dataclass(frozen=True, eq=False)
class _Kept:
    """The columns of a file, filled piece by piece: numbers in place, words where they belong."""

    file: TextFile
    numbers: tuple[FloatArray | None, ...]
    words: tuple[list[str], ...]
    by: By

    @classmethod
    def empty(cls, file: TextFile, n: int) -> _Kept:
        numeric = file.dialect.numeric
        numbers = tuple(np.empty(n) if it else None for it in numeric)
        return cls(file, numbers, tuple([] if it else [""] * n for it in numeric), advance(n))

    def fill(self, piece: _Piece) -> None:
        """Put the rows of a piece into their places."""
        begin = piece.start
        for batch in _batches(self.file, piece.source, piece.skip):
            end = begin + len(batch)
            if end > piece.stop:
                raise OddTextError
            for column, numbers, words in zip(
                batch.columns, self.numbers, self.words, strict=False
            ):
                if numbers is None:
                    words[begin:end] = column.to_pylist()
                else:
                    numbers[begin:end] = column.to_numpy(zero_copy_only=False)
            begin = end
            self.by(len(batch))
        if begin != piece.stop:
            raise OddTextError

    def columns(self) -> TextColumns:
        dialect, begin, n = self.file.dialect, self.file.dialect.first, 0
        columns = []
        for place, (numbers, words) in enumerate(zip(self.numbers, self.words, strict=True)):
            if numbers is None:
                columns.append(dialect.column(place, words))
            else:
                numbers.setflags(write=False)
                columns.append(Column(numbers))
                n = len(numbers)
        return TextColumns(tuple(columns), range(begin, begin + n))


def _part(table: Any, file: TextFile, skipped: int) -> TextColumns:
    """Return the columns of some rows."""
    dialect = file.dialect
    columns = tuple(
        Column(np.concatenate([it.to_numpy(zero_copy_only=False) for it in column.chunks]))
        if numeric
        else dialect.column(place, column.to_pylist())
        for place, (column, numeric) in enumerate(zip(table.columns, dialect.numeric, strict=False))
    )
    begin = dialect.first + skipped
    return TextColumns(columns, range(begin, begin + len(table)), skipped)


def _source(file: TextFile) -> Any:
    """Return the text as UTF-8 with single delimiters; that of a plain file stays on the disk."""
    arrow = _arrow()
    if _is_plain(file):
        with arrow.memory_map(str(file.path)) as mapped:
            return mapped.read_buffer(mapped.size())
    with within(0.0, _UNPACKED), followed(file.path) as binary:
        text = binary.read()
    if file.encoding != "utf-8":
        text = text.decode(file.encoding, errors="replace").encode()
    if not file.dialect.delimiter:
        text = _MARGINS.sub(b"", _SPACES.sub(b" ", text))
    return arrow.py_buffer(text)


def _pieces(source: Any, skip: int) -> list[_Piece]:
    """Cut a large text into a piece a core, at the ends of lines."""
    cores = max(min(os.cpu_count() or 1, source.size // _PIECE), 1)
    places = [0]
    for core in range(1, cores):
        start = source.size * core // cores
        end = source.slice(start, min(_BLOCK, source.size - start)).to_pybytes().find(b"\n")
        places += [start + end + 1] if end >= 0 else []
    pieces, rows = [], 0
    for start, stop in pairwise([*dict.fromkeys(places), source.size]):
        part = source.slice(start, stop - start)
        stop = rows + _lines(part) - skip
        pieces.append(_Piece(part, skip, rows, max(stop, rows)))
        rows, skip = max(stop, rows), 0
    return pieces


def _lines(text: Any) -> int:
    """Count lines, the last with an end or without."""
    letters = np.frombuffer(text, dtype=np.uint8)
    counts = (
        np.count_nonzero(letters[start : start + _BLOCK] == _END)
        for start in range(0, len(letters), _BLOCK)
    )
    return int(sum(counts)) + (len(letters) > 0 and letters[-1] != _END)


def _arrow(part: str = "") -> Any:
    module = installed(f"pyarrow{part}")
    if module is None:
        raise OddTextError
    return module


def _is_plain(file: TextFile) -> bool:
    """Tell a text that Arrow takes as it lies on the disk."""
    with open(file.path, "rb") as binary:
        packed = binary.read(len(GZIP)) == GZIP
    return file.encoding in ("utf-8", "utf-8-sig") and bool(file.dialect.delimiter) and not packed


def _options(csv: Any, file: TextFile, skip: int) -> dict[str, Any]:
    """Return what Arrow must know of the dialect; its columns are called by their place."""
    arrow, dialect = _arrow(), file.dialect
    places = [str(place) for place in range(dialect.width)]
    kept = places[: len(dialect.names)]
    kinds = [arrow.float64() if numeric else arrow.string() for numeric in dialect.numeric]
    return {
        "read_options": csv.ReadOptions(
            column_names=places, skip_rows=skip, block_size=_BLOCK, use_threads=False
        ),
        "parse_options": csv.ParseOptions(
            delimiter=dialect.delimiter or " ",
            quote_char='"' if file.quoted else False,
            ignore_empty_lines=False,
        ),
        "convert_options": csv.ConvertOptions(
            column_types=dict(zip(kept, kinds, strict=True))
            | dict.fromkeys(places[len(kept) :], arrow.null()),
            null_values=_MISSING,
            decimal_point=dialect.decimal,
            include_columns=places,
        ),
    }


def _is_odd(batch: Any, numeric: Sequence[bool]) -> bool:
    """Tell rows that Arrow reads otherwise than they are meant."""
    first = batch.column(0)
    if (first.null_count or not numeric[0]) and _has_blank_rows(batch.columns, numeric):
        return True
    words = [batch.column(place) for place, is_so in enumerate(numeric) if not is_so]
    return bool(words) and _has_odd_words(words, None if numeric[0] else first)


def _has_blank_rows(columns: Sequence[Any], numeric: Sequence[bool]) -> bool:
    """Tell lines without any value, which Arrow takes for rows."""
    compute = _arrow(".compute")
    blank: Any = None
    for column, is_so in zip(columns, numeric, strict=False):
        empty = column.is_null() if is_so else _is_empty(column)
        blank = empty if blank is None else compute.and_(blank, empty)
        if not compute.any(blank).as_py():
            return False
    return True


def _is_empty(column: Any) -> Any:
    compute = _arrow(".compute")
    return compute.equal(compute.utf8_trim_whitespace(column), "")


def _has_odd_words(words: Sequence[Any], first: Any) -> bool:
    """Tell quotation marks that Arrow takes for letters, and comments among the rows."""
    compute = _arrow(".compute")
    if any(compute.any(compute.match_substring(column, '"')).as_py() for column in words):
        return True
    if first is None:
        return False
    bare = compute.utf8_trim_whitespace(first)
    return any(compute.any(compute.starts_with(bare, mark)).as_py() for mark in COMMENTS)

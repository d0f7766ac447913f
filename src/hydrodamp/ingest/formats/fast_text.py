"""Clean text in columns, read by Arrow; anything odd is left to the careful reader."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.ingest.formats.cells import Column, Part
from hydrodamp.ingest.formats.content import opened
from hydrodamp.ingest.formats.dialect import COMMENTS, WESTERN, Dialect

_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "none", "NaT"]
_BLOCK = 1 << 19  # larger ones leave the cache and take half as long again
_SPACES = re.compile(rb"[ \t]+")
_MARGINS = re.compile(rb"(?m)^ +| +(?=\r?$)")


class OddTextError(Exception):
    """Text that Arrow does not read as it is meant; never seen by a user."""


def read(path: str | Path, dialect: Dialect) -> Part:
    """Read all rows of a clean file."""
    with _arrow_text(path, dialect) as (csv, text, options):
        table = csv.read_csv(text, **options)
        _check(table, dialect)
    columns = tuple(
        Column(numbers_of(column)) if numeric else dialect.column(place, column.to_pylist())
        for place, (column, numeric) in enumerate(zip(table.columns, dialect.numeric, strict=False))
    )
    return Part(columns, range(dialect.first, dialect.first + len(table)))


def numbers_of(column: Any) -> FloatArray:
    """Return the numbers of a column of Arrow in an array that nobody writes; NaN for none."""
    values = np.array(column.to_numpy(), dtype=np.float64)
    values.setflags(write=False)
    return values


@contextmanager
def _arrow_text(path: str | Path, dialect: Dialect) -> Iterator[tuple[Any, IO[bytes], Any]]:
    """Open a text for Arrow, with single delimiters, and say what Arrow must know of it."""
    if not any(dialect.numeric):
        raise OddTextError
    try:
        from pyarrow import csv

        with opened(path) as file:
            text = file
            if not dialect.delimiter:
                bare = file.read().decode(dialect.encoding, errors=WESTERN).encode()
                text = io.BytesIO(_MARGINS.sub(b"", _SPACES.sub(b" ", bare)))
            yield csv, text, _options(csv, dialect)
    except (ImportError, ValueError, OverflowError, OSError) as error:
        raise OddTextError from error


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
            block_size=_BLOCK,
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


def _check(table: Any, dialect: Dialect) -> None:
    """Refuse rows that Arrow reads otherwise than they are meant."""
    from pyarrow import compute

    columns = [*zip(table.columns, dialect.numeric, strict=False)]
    words = [column for column, numeric in columns if not numeric]
    first, numeric = columns[0]
    if numeric and not first.null_count and not words:
        return
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
    if any(compute.any(one).as_py() for one in odd):
        raise OddTextError

"""Apache Arrow: Parquet files, and delimited text without irregularities.

Nested structs and short lists of Parquet become columns.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.formats.cells import (
    COMMENTS,
    Column,
    ColumnNames,
    Dialect,
    make_topic,
    parse_column,
    share_texts,
)
from hydrodamp.ingest.formats.content import (
    check_cells,
    check_columns,
    check_memory,
    check_unpacked,
    open_log,
    open_seekable,
)

_MAX_LIST_LENGTH = 64  # values; longer lists are no samples of one instant
_MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "n/a", "null", "NULL", "None", "none", "NaT"]
_BLOCK_BYTES = 1 << 19  # larger blocks of text exceed the cache: 1.5 times the time
_SPACES = re.compile(rb" [ \t]+|\t[ \t]*")  # but single spaces: a match takes 100 bytes
_LINE_MARGINS = re.compile(rb"(?m)^ +| +(?=\r?$)")
_TICKS_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read_file(path: str | Path) -> Recording:
    """Read a Parquet file."""
    from pyarrow.parquet import read_metadata, read_table

    with open_seekable(path) as file:
        metadata = read_metadata(file)
        groups = [metadata.row_group(k) for k in range(metadata.num_row_groups)]
        check_columns(metadata.num_columns, path)
        check_unpacked(sum(group.total_byte_size for group in groups), path)
        chunks = (group.column(k) for group in groups for k in range(group.num_columns))
        check_cells(sum(chunk.num_values for chunk in chunks), path)  # elements of lists, too
        file.seek(0)
        return _make_recording(read_table(file), path)


def _make_recording(table: Any, path: str | Path) -> Recording:
    """Return the columns of a table as a recording."""
    from pyarrow import types

    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    header = ColumnNames(table.column_names)
    columns: dict[str, Column] = {}
    units: dict[str, str] = {}
    texts: dict[str, str] = {}
    notes: list[str] = [*header.faults.values()]
    for name, field, column in zip(header.names, table.schema, table.columns, strict=True):
        kind = field.type
        stated_unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        unit = stated_unit or header.units.get(name, "")
        if types.is_dictionary(kind):
            kind, column = kind.value_type, column.cast(kind.value_type)
        if types.is_string(kind) or types.is_large_string(kind):
            words = [
                word or ""
                for chunk in column.chunks
                for word in share_texts(chunk.to_pylist(), texts)
            ]
            check_cells(table.num_rows * table.num_columns, path, len(texts))
            columns[name] = parse_column(words, name=name)
            continue
        if types.is_temporal(kind):
            values, unit = {name: _to_seconds(column)}, stated_unit or "s"
        elif _is_number(kind):
            values = {name: _to_numbers(column.cast("float64", safe=False))}
        elif types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
            values = _expand_lists(name, column) if _is_number(kind.value_type) else {}
        else:
            values = {}
        if not values:
            notes.append(f"column `{name}` of type {kind} holds no numbers; it was skipped")
        columns |= {key: Column(array) for key, array in values.items()}
        units |= dict.fromkeys(values, unit) if unit else {}
    topic = make_topic("", columns, units=units)
    notes += topic.faults.values()
    topic = replace(topic, faults={**topic.faults, **header.faults})
    return Recording((topic,), str(path), "Parquet", tuple(notes))


def _is_number(kind: Any) -> bool:
    from pyarrow import types

    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal, types.is_null)
    return any(test(kind) for test in tests)


def _to_seconds(column: Any) -> FloatArray:
    """Return dates (since 1970), times of day and durations [s]."""
    if str(column.type).startswith("date"):
        column = column.cast("timestamp[ms]")
    kind = column.type
    return _to_numbers(column.cast(f"int{kind.bit_width}")) / _TICKS_PER_SECOND[kind.unit]


def _expand_lists(name: str, column: Any) -> dict[str, FloatArray]:
    """Return one column per list index; none where a list is too long."""
    rows = column.to_pylist()
    length = max((len(row) for row in rows if row is not None), default=0)
    if length > _MAX_LIST_LENGTH:
        return {}
    block = np.full((len(rows), length), np.nan)
    for index, row in enumerate(rows):
        block[index, : len(row or ())] = row or ()
    return {f"{name}[{k}]": block[:, k] for k in range(length)}


def read_csv(
    path: str | Path, dialect: Dialect, errors: str
) -> tuple[list[Column], Sequence[int]] | None:
    """Return columns and line numbers of clean delimited text; None where Arrow fails on it."""
    blocks: list[list[Any]] = [[] for _ in dialect.numeric]
    texts: dict[str, str] = {}
    n = 0
    try:
        import pyarrow
        from pyarrow import csv

        with open_log(path) as file:
            text: Any = pyarrow.PythonFile(file, "r")
            if not dialect.delimiter:  # Arrow needs single spaces
                text = pyarrow.TransformInputStream(text, _space_normalizer(dialect, errors))
            check_memory()
            for batch in csv.open_csv(text, **_arrow_options(csv, dialect)):
                if _is_misread(batch, dialect):
                    return None
                for block, column, numeric in zip(
                    blocks, batch.columns, dialect.numeric, strict=False
                ):
                    if numeric:
                        block.append(column.to_numpy(zero_copy_only=False))
                    else:
                        block += share_texts(column.to_pylist(), texts)
                n += len(batch)
                check_cells(n * dialect.width, path, len(texts))
    except HydrodampError:
        raise
    except (ImportError, ValueError, OverflowError, OSError):
        return None
    columns = []
    for k, numeric in enumerate(dialect.numeric):
        block, blocks[k] = blocks[k], []  # so that its memory is free once it is joined
        columns.append(Column(_join(block)) if numeric else dialect.parse_column(k, block))
    return columns, range(dialect.first_line, dialect.first_line + n)


def _space_normalizer(dialect: Dialect, errors: str) -> Callable[[Any], bytes]:
    """Return a function that makes blocks of text UTF-8 with single spaces between the cells."""
    decode = codecs.getincrementaldecoder(dialect.encoding)(errors).decode
    before = b"\n"  # end of the text so far

    def normalize(block: Any) -> bytes:
        nonlocal before
        text = before + decode(bytes(block), not len(block)).encode()
        cells = _LINE_MARGINS.sub(b"", _SPACES.sub(b" ", text.rstrip(b" \t")))
        before = cells[-1:] + b" " * (text[-1:] in b" \t")
        return cells[1:]

    return normalize


def _to_numbers(column: Any) -> FloatArray:
    """Return an Arrow column as a read-only array; NaN for null."""
    return _join([chunk.to_numpy(zero_copy_only=False) for chunk in column.chunks])


def _join(arrays: Sequence[FloatArray]) -> FloatArray:
    """Return arrays one after another, read-only."""
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
            block_size=_BLOCK_BYTES,
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


def _is_misread(batch: Any, dialect: Dialect) -> bool:
    """Return whether Arrow took blank lines, comments or quotation marks for data."""
    from pyarrow import compute

    columns = [*zip(batch.columns, dialect.numeric, strict=False)]
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

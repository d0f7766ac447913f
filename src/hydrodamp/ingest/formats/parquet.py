"""Apache Parquet files, read by pyarrow: nested structs and short lists become columns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats.cells import Column, ColumnNames, make_topic, parse_column
from hydrodamp.ingest.formats.content import check_columns, check_unpacked, open_seekable
from hydrodamp.ingest.formats.delimited import arrow_numbers

_MAX_LIST_LENGTH = 64  # values; longer lists are no samples of one instant
_TICKS_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read_file(path: str | Path) -> Recording:
    """Read a Parquet file."""
    from pyarrow.parquet import read_metadata, read_table

    with open_seekable(path) as file:
        metadata = read_metadata(file)
        sizes = [
            metadata.row_group(number).total_byte_size for number in range(metadata.num_row_groups)
        ]
        check_columns(metadata.num_columns, path)
        check_unpacked(max(sum(sizes), 8 * metadata.num_rows * metadata.num_columns), path)
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
    notes: list[str] = [*header.faults.values()]
    for name, field, column in zip(header.names, table.schema, table.columns, strict=True):
        kind = field.type
        stated_unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        unit = stated_unit or header.units.get(name, "")
        if types.is_dictionary(kind):
            kind, column = kind.value_type, column.cast(kind.value_type)
        if types.is_string(kind) or types.is_large_string(kind):
            columns[name] = parse_column([word or "" for word in column.to_pylist()], name=name)
            continue
        if types.is_temporal(kind):
            values, unit = {name: _to_seconds(column)}, stated_unit or "s"
        elif _is_number(kind):
            values = {name: arrow_numbers(column.cast("float64", safe=False))}
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
    return arrow_numbers(column.cast(f"int{kind.bit_width}")) / _TICKS_PER_SECOND[kind.unit]


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

"""Apache Parquet."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording
from hydrodamp.ingest.formats.cells import Column, Names, column_of, topic_of
from hydrodamp.ingest.formats.content import check_columns, check_unpacked, seekable
from hydrodamp.ingest.formats.delimited import arrow_numbers

_LONGEST = 64  # values of a list
_PARTS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def read(path: str | Path) -> Recording:
    """Read a Parquet file."""
    from pyarrow.parquet import read_metadata, read_table

    with seekable(path) as file:
        about = read_metadata(file)
        groups = [about.row_group(number).total_byte_size for number in range(about.num_row_groups)]
        check_columns(about.num_columns, path)
        check_unpacked(max(sum(groups), 8 * about.num_rows * about.num_columns), path)
        file.seek(0)
        return _recording(read_table(file), path)


def _recording(table: Any, path: str | Path) -> Recording:
    """Return the columns of a table as a recording."""
    from pyarrow import types

    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    called = Names(table.column_names)
    columns: dict[str, Column] = {}
    units: dict[str, str] = {}
    notes: list[str] = [*called.faults.values()]
    for name, field, column in zip(called.names, table.schema, table.columns, strict=True):
        kind = field.type
        stated = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        unit = stated or called.units.get(name, "")
        if types.is_dictionary(kind):
            kind, column = kind.value_type, column.cast(kind.value_type)
        if types.is_string(kind) or types.is_large_string(kind):
            columns[name] = column_of([word or "" for word in column.to_pylist()], name=name)
            continue
        if types.is_temporal(kind):
            found, unit = {name: _seconds(column)}, stated or "s"
        elif _is_number(kind):
            found = {name: arrow_numbers(column.cast("float64", safe=False))}
        elif types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
            found = _places(name, column) if _is_number(kind.value_type) else {}
        else:
            found = {}
        if not found:
            notes.append(f"column `{name}` of type {kind} was left out")
        columns |= {key: Column(values) for key, values in found.items()}
        units |= dict.fromkeys(found, unit) if unit else {}
    topic = topic_of("", columns, units=units)
    notes += topic.faults.values()
    topic = replace(topic, faults={**topic.faults, **called.faults})
    return Recording((topic,), str(path), "Parquet", tuple(notes))


def _is_number(kind: Any) -> bool:
    from pyarrow import types

    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal, types.is_null)
    return any(test(kind) for test in tests)


def _seconds(column: Any) -> FloatArray:
    """Return dates (since 1970), times of day and durations in seconds."""
    if str(column.type).startswith("date"):
        column = column.cast("timestamp[ms]")
    kind = column.type
    return arrow_numbers(column.cast(f"int{kind.bit_width}")) / _PARTS[kind.unit]


def _places(name: str, column: Any) -> dict[str, FloatArray]:
    """Turn lists into a column for each place in them; nothing where they are too long."""
    rows = column.to_pylist()
    longest = max((len(row) for row in rows if row is not None), default=0)
    if longest > _LONGEST:
        return {}
    block = np.full((len(rows), longest), np.nan)
    for place, row in enumerate(rows):
        block[place, : len(row or ())] = row or ()
    return {f"{name}[{k}]": block[:, k] for k in range(longest)}

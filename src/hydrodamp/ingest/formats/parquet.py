"""Apache Parquet, whole or part by part."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.advance import counted
from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats.extras import extra
from hydrodamp.ingest.formats.naming import split_unit, told_apart

FORMAT = "Parquet"
"""How messages call the format."""

_PARTS = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_LONGEST = 64


def read(path: str | Path) -> Recording:
    """Read a Parquet file."""
    arrow, file = extra("pyarrow", path), _opened(path)
    groups = counted(range(file.num_row_groups), file.num_row_groups)
    try:
        parts = [file.read_row_group(group) for group in groups]
        table = arrow.concat_tables(parts) if parts else file.read()
    except (ValueError, OSError) as error:
        raise _damaged(path, error) from error
    return _recording(table, path)


def parts(path: str | Path, rows: int = 100_000) -> Iterator[Recording]:
    """Read a Parquet file part by part, for files larger than the memory."""
    arrow = extra("pyarrow", path)
    batches = _opened(path, pre_buffer=False).iter_batches(batch_size=rows, use_threads=False)
    while True:
        try:
            batch = next(batches, None)
        except (ValueError, OSError) as error:
            raise _damaged(path, error) from error
        if batch is None:
            return
        yield _recording(arrow.Table.from_batches([batch]), path)


def _opened(path: str | Path, **options: Any) -> Any:
    parquet = extra("pyarrow.parquet", path)
    try:
        return parquet.ParquetFile(str(path), **options)
    except FileNotFoundError as error:
        raise FileError(f"{path}: cannot be read: No such file or directory") from error
    except (ValueError, OSError) as error:
        raise _damaged(path, error) from error


def _damaged(path: str | Path, error: Exception) -> LogError:
    why = str(error).strip().split("\n")[0].rstrip(".")
    return LogError(
        f"the Parquet file is cut off or damaged: {why}. Write or copy it again; Parquet keeps its"
        " index at the end, so a file cut off cannot be mended",
        source=str(path),
    )


def _recording(table: Any, path: str | Path) -> Recording:
    """Return the columns of a table as a recording."""
    types = extra("pyarrow", path).types
    while any(types.is_struct(field.type) for field in table.schema):
        table = table.flatten()
    names = [split_unit(name) for name in table.column_names]
    columns = _Columns(types)
    whole = len({stem for stem, _ in names}) < len(names)
    called = told_apart(table.column_names if whole else [stem for stem, _ in names])
    for name, (_, unit), kind, column in zip(
        called, names, table.schema, table.columns, strict=True
    ):
        stated = (kind.metadata or {}).get(b"unit", b"").decode(errors="replace")
        columns.add(name, column, stated or ("" if whole else unit))
    topic = Topic("", None, columns.fields, columns.texts, columns.units)
    return Recording((topic,), str(path), FORMAT, tuple(columns.notes))


class _Columns:
    """Columns sorted into numbers and words."""

    def __init__(self, types: Any) -> None:
        self.types = types
        self.fields: dict[str, FloatArray] = {}
        self.texts: dict[str, tuple[str, ...]] = {}
        self.units: dict[str, str] = {}
        self.notes: list[str] = []

    def add(self, name: str, column: Any, unit: str) -> None:
        types, kind = self.types, column.type
        if types.is_dictionary(kind):
            column, kind = column.cast(kind.value_type), kind.value_type
        if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
            self._add_list(name, column, unit)
        elif types.is_string(kind) or types.is_large_string(kind):
            self.texts[name] = tuple(word or "" for word in column.to_pylist())
        elif types.is_temporal(kind):
            self._add_dates(name, column)
        elif self._is_number(kind):
            self.fields[name] = _numbers(column)
            self.units |= {name: unit} if unit else {}
        else:
            self.notes.append(f"column `{name}` of type {kind} was left out")

    def _is_number(self, kind: Any) -> bool:
        types = self.types
        tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal)
        return any(test(kind) for test in (*tests, types.is_null))

    def _add_dates(self, name: str, column: Any) -> None:
        kind = column.type
        if self.types.is_date(kind):
            kind = "timestamp[ms]"
            column = column.cast(kind)
        unit = str(kind).partition("[")[2].rstrip("]").partition(",")[0]
        self.fields[name] = _numbers(column.cast("int32" if "32" in str(kind) else "int64"))
        self.fields[name] = self.fields[name] / _PARTS[unit]
        self.units[name] = "s"

    def _add_list(self, name: str, column: Any, unit: str) -> None:
        """Turn a list into a column for each place in it."""
        if not self._is_number(column.type.value_type):
            self.notes.append(f"column `{name}` of type {column.type} was left out")
            return
        rows = column.to_pylist()
        longest = max((len(row) for row in rows if row is not None), default=0)
        if longest > _LONGEST:
            self.notes.append(f"column `{name}` holds up to {longest} values a row; left out")
            return
        block = np.full((len(rows), longest), np.nan)
        for place, row in enumerate(rows):
            block[place, : len(row or ())] = row or ()
        for index in range(longest):
            self.fields[f"{name}[{index}]"] = block[:, index]
            self.units |= {f"{name}[{index}]": unit} if unit else {}


def _numbers(column: Any) -> FloatArray:
    """Return the numbers of a column in an array that nobody writes; NaN for none."""
    values = np.empty(len(column), dtype=np.float64)
    start = 0
    for chunk in column.chunks:
        part = chunk.to_numpy(zero_copy_only=False)
        values[start : start + len(chunk)] = part if part.dtype != object else _cast(chunk)
        start += len(chunk)
    values.setflags(write=False)
    return values


def _cast(chunk: Any) -> FloatArray:
    """Return numbers that Arrow hands out as objects: booleans with gaps, decimals."""
    found = [np.nan if value is None else float(value) for value in chunk.to_pylist()]
    return np.array(found, dtype=np.float64)

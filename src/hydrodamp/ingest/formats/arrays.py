"""Named arrays of NumPy, MATLAB, HDF5 and netCDF files, grouped into topics."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, ColumnNames, make_topic, parse_column
from hydrodamp.ingest.formats.content import (
    check_cells,
    check_columns,
    check_unpacked,
    max_unpacked_bytes,
    open_log,
    open_seekable,
    read_head,
)
from hydrodamp.ingest.formats.hdf5 import read_hdf5
from hydrodamp.ingest.formats.netcdf import (
    Attributes,
    Variable,
    decode_variable,
    is_netcdf,
    read_classic,
)

_MAX_COLUMNS = 64  # columns; wider arrays are no samples
_CLOCK_NAMES = ("time", "t", "timestamp", "time_s")
# `python -c` puts the working directory first in sys.path; its files must not be imported.
_CHILD_CODE = (
    "import sys; sys.path[:] = {path!r}; from {module} import load_in_child; load_in_child({bound})"
)
_MEMORY_COPIES = 4  # of the arrays; what reader and npz need at peak
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def read_file(path: str | Path) -> Recording:
    """Read a file of NumPy, MATLAB or HDF5 arrays."""
    start = read_head(path, 520)
    notes: list[str] = []
    attributes: Attributes = {}
    if start.startswith((b"\x93NUMPY", b"PK")):
        form, arrays = "NumPy arrays", dict(_read_numpy(path, notes))
    elif start.startswith(b"CDF"):
        form, arrays = "netCDF", dict(read_classic(path, attributes))
    elif _HDF5_SIGNATURE in (start[:8], start[512:]):
        arrays = dict(read_hdf5(path, notes, attributes))
        form = "netCDF" if is_netcdf(path, attributes.pop("", {})) else "MATLAB file"
    else:
        form, arrays = "MATLAB file", dict(_read_matlab(path, notes))
    variables = {
        name: decode_variable(array, attributes.get(name, {})) for name, array in arrays.items()
    }
    columns = _split_columns({name: variable.values for name, variable in variables.items()}, notes)
    stated = {
        id(column): variables.get(name) or variables[name.rpartition("[")[0]]
        for name, column in columns.items()
    }
    check_columns(len(columns), path)
    is_text = [column.dtype.kind in "US" for column in columns.values()]
    n_cells = [*map(len, columns.values())]
    check_cells(sum(n_cells), path, int(np.dot(n_cells, is_text)))
    if not columns:
        kinds = ", ".join(f"`{name}`" for name in list(arrays)[:5]) or "nothing"
        fault = f"expected arrays with one value per sample; found {kinds}"
        raise LogError([fault, *notes], source=str(path))
    is_table = len({len(column) for column in columns.values()}) == 1
    groups = {"": columns} if is_table else _group_by_clock(columns)
    topics = tuple(_make_topic(name, group, stated, notes) for name, group in groups.items())
    return Recording(topics, str(path), form, tuple(notes))


def _read_numpy(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    with open_log(path) as file:
        loaded = np.load(file, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            yield from _split_structured("" if loaded.dtype.names else "array", loaded)
            return
        check_unpacked(sum(member.file_size for member in loaded.zip.infolist()), path)
        for name in loaded.files:
            try:
                yield from _split_structured(name, loaded[name])
            except ValueError as error:
                if "object" not in str(error).lower():
                    raise
                notes.append(
                    f"`{name}` holds Python objects, which are never loaded; it was skipped"
                )


def _split_structured(name: str, array: Any) -> Iterator[tuple[str, Any]]:
    """Yield an array, or the fields of a structured array."""
    for field in array.dtype.names or ():
        yield f"{name}.{field}".lstrip("."), array[field]
    if not array.dtype.names:
        yield name, array


def _read_matlab(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of a MATLAB file up to version 7.2, named by their path in its structures.

    Damaged files crash SciPy's reader (SIGSEGV, SIGBUS); a child process contains the crash. It
    starts in 0.4 s and returns the arrays as npz, never as pickles.
    """
    with open_seekable(path) as file:
        data = file.read()
    bound = _MEMORY_COPIES * max_unpacked_bytes(path)
    command = [
        sys.executable,
        "-c",
        _CHILD_CODE.format(path=sys.path, module=__name__, bound=bound),
    ]
    process = subprocess.run(command, input=data, capture_output=True, check=False)
    if process.returncode:
        reason = _failure_reason(process)
        check_unpacked(np.inf if "MemoryError" in reason else 0.0, path)
        raise ValueError(reason)
    with np.load(io.BytesIO(process.stdout), allow_pickle=False) as archive:
        names, messages, *arrays = archive.values()
    notes += messages.tolist()
    yield from zip(names.tolist(), arrays, strict=True)


def _failure_reason(done: subprocess.CompletedProcess[bytes]) -> str:
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode > 0 and lines:
        return lines[-1]
    is_signal = -done.returncode in set(signal.Signals)
    name = signal.Signals(-done.returncode).name if is_signal else f"status {done.returncode}"
    return f"it makes SciPy's reader crash ({name})"


def load_in_child(bound: int) -> None:
    """Read a file from standard input and write its arrays as npz (runs in the child process)."""
    import scipy.io

    _limit_memory(bound)
    stream: Any = io.BytesIO(sys.stdin.buffer.read())
    content = scipy.io.loadmat(stream, simplify_cells=True)
    variables = {name: value for name, value in content.items() if not name.startswith("__")}
    notes: list[str] = []
    arrays = dict(_flatten_structure(variables, "", notes))
    out = io.BytesIO()
    names = np.array([*arrays], dtype=np.str_)
    np.savez(out, names, np.array(notes, dtype=np.str_), *map(np.asarray, arrays.values()))
    sys.stdout.buffer.write(out.getbuffer())


def _limit_memory(bound: int) -> None:
    """Limit the further memory of this process, on systems that support it."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        limit = pages * os.sysconf("SC_PAGE_SIZE") + bound
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _flatten_structure(
    structure: Mapping[str, Any], stem: str, notes: list[str]
) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of a structure, named by their path."""
    for name, value in structure.items():
        path = f"{stem}.{name}" if stem else name
        rows = list(value) if isinstance(value, (list, np.ndarray)) and np.ndim(value) == 1 else []
        if isinstance(value, dict):
            yield from _flatten_structure(value, path, notes)
        elif rows and all(isinstance(row, dict) for row in rows):
            columns = {key: np.array([row.get(key, np.nan) for row in rows]) for key in rows[0]}
            yield from _flatten_structure(columns, path, notes)
        elif isinstance(value, (str, bytes)):
            continue
        elif np.asarray(value).dtype == object or np.asarray(value).dtype.names:
            notes.append(
                f"`{path}` is a MATLAB object, such as a table or timeseries; it was skipped."
                " Save its numbers as arrays"
            )
        else:
            yield path, value


def _split_columns(arrays: Mapping[str, Any], notes: list[str]) -> dict[str, Any]:
    """Return the columns of arrays with one row per sample; note the others."""
    columns: dict[str, Any] = {}
    squeezed = {name: np.squeeze(np.asarray(array)) for name, array in arrays.items()}
    rows = _common_length(squeezed)
    for name, block in squeezed.items():
        shape = " x ".join(map(str, np.shape(arrays[name]))) or "one value"
        if block.dtype.kind not in "buifUS" or block.ndim not in (1, 2):
            notes.append(f"`{name}` ({shape}) holds no samples; it was skipped")
        elif block.ndim == 1:
            columns[name] = block
        else:
            is_flat = rows not in block.shape and block.shape[1] > _MAX_COLUMNS
            block_by_row = block.T if block.shape[1] == rows != len(block) or is_flat else block
            if block_by_row.shape[1] > _MAX_COLUMNS:
                fault = f"has more than {_MAX_COLUMNS} columns; it was skipped"
                notes.append(f"`{name}` ({shape}) {fault}")
            else:
                columns |= {f"{name}[{k}]": values for k, values in enumerate(block_by_row.T)}
    return columns


def _common_length(arrays: Mapping[str, Any]) -> int:
    """Return the length of the clock, or else the most common length of vectors."""
    lengths = {name: len(array) for name, array in arrays.items() if array.ndim == 1}
    clocks = [lengths[clock] for clock in _CLOCK_NAMES if clock in lengths]
    return (clocks or [n for n, _ in Counter(lengths.values()).most_common(1)] or [0])[0]


def _group_by_clock(columns: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Group columns by structure, and by the clock of the same length where there are several."""
    groups: dict[str, dict[str, Any]] = defaultdict(dict)
    for name, column in columns.items():
        stem, _, field = name.rpartition(".")
        groups[stem][field] = column
    topics: dict[str, dict[str, Any]] = {}
    for stem, members in groups.items():
        length = _common_length(members)
        counts = Counter(map(len, members.values()))
        if counts[length] == 1 < max(counts.values()):  # the clock is shorter than all others
            length = counts.most_common(1)[0][0]
        clocks = {
            len(column): name
            for name, column in reversed(members.items())
            if len(column) != length and len(column) > 2 and _is_increasing(column)
        }
        for name, column in members.items():
            clock = clocks.get(len(column), "")
            topics.setdefault(".".join(filter(None, (stem, clock))), {})[name] = column
    return topics


def _is_increasing(column: Any) -> bool:
    return column.dtype.kind in "iuf" and bool((np.diff(column.astype(np.float64)) > 0).all())


def _make_topic(
    name: str, columns: Mapping[str, Any], stated: Mapping[int, Variable], notes: list[str]
) -> Topic:
    n = _common_length(columns)
    clock = next((clock for clock in _CLOCK_NAMES if clock in columns), "")
    comparison = f"but `{clock}` has {n}" if clock else f"but most have {n}"
    header = ColumnNames(list(columns))
    samples: dict[str, Column] = {}
    faults: dict[str, str] = {}
    for field, (original, column) in zip(header.names, columns.items(), strict=True):
        if len(column) != n:
            faults[field] = f"`{original}` has {len(column)} values {comparison}; make them equal"
        elif id(column) in stated and (fault := stated[id(column)].fault):
            faults[field] = f"`{original}`: {fault}"
        elif column.dtype.kind in "US":
            samples[field] = parse_column(np.asarray(column, dtype=str).tolist(), name=field)
        else:
            samples[field] = Column(np.asarray(column, dtype=np.float64))
    variables = [*zip(header.names, map(stated.get, map(id, columns.values())), strict=True)]
    units = {field: variable.unit for field, variable in variables if variable and variable.unit}
    names = {
        field: variable.standard_name
        for field, variable in variables
        if variable and variable.standard_name
    }
    topic = make_topic(name, samples, units={**header.units, **units})
    faults |= topic.faults
    notes.extend(faults.values())
    return replace(topic, faults=faults, standard_names=names)

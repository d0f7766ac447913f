"""Named arrays of NumPy (``.npz``), MATLAB (``.mat``) and HDF5 files, grouped into topics."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError, first_few
from hydrodamp.ingest.formats import matlab
from hydrodamp.ingest.formats.cells import Column, ColumnNames, make_topic, parse_column
from hydrodamp.ingest.formats.content import (
    check_columns,
    check_unpacked,
    open_log,
    open_seekable,
    read_head,
)

_MAX_COLUMNS = 64  # columns; wider arrays are no samples
_CLOCK_NAMES = ("time", "t", "timestamp", "time_s")
_HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def read_file(path: str | Path) -> Recording:
    """Read a file of NumPy, MATLAB or HDF5 arrays."""
    start = read_head(path, 520)
    notes: list[str] = []
    if start.startswith((b"\x93NUMPY", b"PK")):
        form, read_arrays = "NumPy arrays", _read_numpy
    else:
        hdf5 = _HDF5_SIGNATURE in (start[:8], start[512:])
        form, read_arrays = "MATLAB file", _read_hdf5 if hdf5 else matlab.read_arrays
    arrays = dict(read_arrays(path, notes))
    columns = _split_columns(arrays, notes)
    check_columns(len(columns), path)
    if not columns:
        kinds = ", ".join(f"`{name}`" for name in list(arrays)[:5]) or "nothing"
        fault = f"expected arrays with one value per sample; found {kinds}"
        raise LogError([fault, *notes], source=str(path))
    is_table = len({len(column) for column in columns.values()}) == 1
    groups = {"": columns} if is_table else _group_by_clock(columns)
    topics = tuple(_make_topic(name, group, notes) for name, group in groups.items())
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


def _read_hdf5(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Read HDF5; MATLAB 7.3 files are HDF5 with transposed arrays."""
    import h5py

    nodes: dict[str, Any] = {}
    with open_seekable(path) as content, h5py.File(content, "r") as file:
        file.visititems(lambda name, node: nodes.update({name: node}))
        _check_storage(file, nodes, path)
        for key, node in nodes.items():
            name, kind = key.replace("/", "."), node.attrs.get("MATLAB_class", b"")
            skipped = name.startswith("#") or not isinstance(node, h5py.Dataset)
            if skipped or kind in (b"char", b"cell") or "MATLAB_empty" in node.attrs:
                continue
            if node.dtype.kind in "buif":
                yield name, node[()].T if kind else node[()]
            else:
                notes.append(f"`{name}` of type {node.dtype} holds no numbers; it was skipped")


def _check_storage(file: Any, nodes: Mapping[str, Any], path: str | Path) -> None:
    """Refuse links to other files and implausible compression ratios."""
    import h5py

    groups = {"": file} | {
        name: node for name, node in nodes.items() if isinstance(node, h5py.Group)
    }
    external = [
        f"`{name}/{key}`".replace("`/", "`")
        for name, group in groups.items()
        for key in group
        if isinstance(group.get(key, getlink=True), h5py.ExternalLink)
    ]
    arrays = {name: node for name, node in nodes.items() if isinstance(node, h5py.Dataset)}
    external += [f"`{name}`" for name, node in arrays.items() if _is_external(node)]
    if external:
        raise LogError(
            f"the values of {', '.join(first_few(external, 3, 'names'))} are stored in other"
            " files, which are never opened: a link can name any file of this computer. Store them"
            " in this file (`h5repack`, or copy the arrays)",
            source=str(path),
        )
    check_unpacked(sum(node.nbytes for node in arrays.values()), path)


def _is_external(node: Any) -> bool:
    """Return whether a dataset is stored in another file."""
    virtual = node.virtual_sources() if node.is_virtual else ()
    return bool(node.external) or any(source.file_name != "." for source in virtual)


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
                notes.append(
                    f"`{name}` ({shape}) has more than {_MAX_COLUMNS} columns; it was skipped"
                )
            else:
                columns |= {
                    f"{name}[{k}]": block_by_row[:, k] for k in range(block_by_row.shape[1])
                }
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
        if (
            counts[length] == 1 < max(counts.values())
        ):  # the clock is shorter than all other columns
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


def _make_topic(name: str, columns: Mapping[str, Any], notes: list[str]) -> Topic:
    n = _common_length(columns)
    clock = next((clock for clock in _CLOCK_NAMES if clock in columns), "")
    comparison = f"but `{clock}` has {n}" if clock else f"but most have {n}"
    header = ColumnNames(list(columns))
    samples: dict[str, Column] = {}
    faults: dict[str, str] = {}
    for field, (original, column) in zip(header.names, columns.items(), strict=True):
        if len(column) != n:
            faults[field] = f"`{original}` has {len(column)} values {comparison}; make them equal"
        elif column.dtype.kind in "US":
            samples[field] = parse_column(np.asarray(column, dtype=str).tolist(), name=field)
        else:
            samples[field] = Column(np.asarray(column, dtype=np.float64))
    topic = make_topic(name, samples, units=header.units)
    faults |= topic.faults
    notes.extend(faults.values())
    return replace(topic, faults=faults)

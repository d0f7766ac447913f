"""Named arrays, sorted into topics: NumPy's, and those of MATLAB and HDF5 files."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import matlab
from hydrodamp.ingest.formats.cells import Column, Names, column_of, topic_of
from hydrodamp.ingest.formats.content import check_columns, check_unpacked, head, opened, seekable
from hydrodamp.text import first_few

_LONGEST = 64  # columns of an array
_CLOCKS = ("time", "t", "timestamp", "time_s")
_HDF5 = b"\x89HDF\r\n\x1a\n"


def read(path: str | Path) -> Recording:
    """Read the arrays of a file of NumPy, MATLAB or HDF5."""
    begin = head(path, 520)
    notes: list[str] = []
    if begin.startswith((b"\x93NUMPY", b"PK")):
        form, read_arrays = "NumPy arrays", _numpy
    else:
        hdf5 = _HDF5 in (begin[:8], begin[512:])
        form, read_arrays = "MATLAB file", _hdf5 if hdf5 else matlab.read_arrays
    arrays = dict(read_arrays(path, notes))
    columns = _columns(arrays, notes)
    check_columns(len(columns), path)
    if not columns:
        kinds = ", ".join(f"`{name}`" for name in list(arrays)[:5]) or "nothing"
        fault = f"there is no array with a value a sample; there is {kinds}"
        raise LogError([fault, *notes], source=str(path))
    whole = len({len(column) for column in columns.values()}) == 1
    groups = {"": columns} if whole else _by_clock(columns)
    topics = tuple(_topic(name, group, notes) for name, group in groups.items())
    return Recording(topics, str(path), form, tuple(notes))


def _numpy(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    with opened(path) as file:
        loaded = np.load(file, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            yield from _parts("" if loaded.dtype.names else "array", loaded)
            return
        check_unpacked(sum(member.file_size for member in loaded.zip.infolist()), path)
        for name in loaded.files:
            try:
                yield from _parts(name, loaded[name])
            except ValueError as error:
                if "object" not in str(error).lower():
                    raise
                notes.append(f"`{name}` holds Python objects, which are never loaded; left out")


def _parts(name: str, array: Any) -> Iterator[tuple[str, Any]]:
    """Yield an array, or those of its parts where its rows are structures."""
    for part in array.dtype.names or ():
        yield f"{name}.{part}".lstrip("."), array[part]
    if not array.dtype.names:
        yield name, array


def _hdf5(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Read HDF5, of which MATLAB's version 7.3 is one: it stores columns as rows."""
    import h5py

    found: dict[str, Any] = {}
    with seekable(path) as content, h5py.File(content, "r") as file:
        file.visititems(lambda name, node: found.update({name: node}))
        _check_storage(file, found, path)
        for key, node in found.items():
            name, kind = key.replace("/", "."), node.attrs.get("MATLAB_class", b"")
            skipped = name.startswith("#") or not isinstance(node, h5py.Dataset)
            if skipped or kind in (b"char", b"cell") or "MATLAB_empty" in node.attrs:
                continue
            if node.dtype.kind in "buif":
                yield name, node[()].T if kind else node[()]
            else:
                notes.append(f"`{name}` of type {node.dtype} was left out")


def _check_storage(file: Any, nodes: Mapping[str, Any], path: str | Path) -> None:
    """Refuse a file whose values lie in other files, or that unpacks out of proportion."""
    import h5py

    groups = {"": file} | {name: it for name, it in nodes.items() if isinstance(it, h5py.Group)}
    elsewhere = [
        f"`{name}/{key}`".replace("`/", "`")
        for name, group in groups.items()
        for key in group
        if isinstance(group.get(key, getlink=True), h5py.ExternalLink)
    ]
    arrays = {name: node for name, node in nodes.items() if isinstance(node, h5py.Dataset)}
    elsewhere += [f"`{name}`" for name, node in arrays.items() if _is_elsewhere(node)]
    if elsewhere:
        raise LogError(
            f"the values of {', '.join(first_few(elsewhere, 3, 'names'))} lie in other files, which"
            " are never opened: such a file can name any file of this machine. Save them into this"
            " one (`h5repack`, or copy the arrays)",
            source=str(path),
        )
    check_unpacked(sum(node.nbytes for node in arrays.values()), path)


def _is_elsewhere(node: Any) -> bool:
    """Return whether the values of a dataset lie in another file."""
    virtual = node.virtual_sources() if node.is_virtual else ()
    return bool(node.external) or any(one.file_name != "." for one in virtual)


def _columns(arrays: Mapping[str, Any], notes: list[str]) -> dict[str, Any]:
    """Return the arrays that hold a row a sample, column by column; note the others."""
    found: dict[str, Any] = {}
    flat = {name: np.squeeze(np.asarray(array)) for name, array in arrays.items()}
    rows = _usual_length(flat)
    for name, block in flat.items():
        shape = " x ".join(map(str, np.shape(arrays[name]))) or "one value"
        if block.dtype.kind not in "buifUS" or block.ndim not in (1, 2):
            notes.append(f"`{name}` ({shape}) holds no samples; left out")
        elif block.ndim == 1:
            found[name] = block
        else:
            is_flat = rows not in block.shape and block.shape[1] > _LONGEST
            tall = block.T if block.shape[1] == rows != len(block) or is_flat else block
            if tall.shape[1] > _LONGEST:
                notes.append(f"`{name}` ({shape}) is too wide for samples; left out")
            else:
                found |= {f"{name}[{k}]": tall[:, k] for k in range(tall.shape[1])}
    return found


def _usual_length(arrays: Mapping[str, Any]) -> int:
    """Return the length most vectors have, the clock's where there is one."""
    lengths = {name: len(array) for name, array in arrays.items() if array.ndim == 1}
    clocks = [lengths[clock] for clock in _CLOCKS if clock in lengths]
    return (clocks or [n for n, _ in Counter(lengths.values()).most_common(1)] or [0])[0]


def _by_clock(columns: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Group columns by the structure they stand in, and by their length where it has a clock."""
    groups: dict[str, dict[str, Any]] = defaultdict(dict)
    for name, column in columns.items():
        stem, _, field = name.rpartition(".")
        groups[stem][field] = column
    whole: dict[str, dict[str, Any]] = {}
    for stem, inside in groups.items():
        usual = _usual_length(inside)
        counts = Counter(map(len, inside.values()))
        if counts[usual] == 1 < max(counts.values()):  # a clock that stops before all else does
            usual = counts.most_common(1)[0][0]
        clocks = {
            len(column): name
            for name, column in reversed(inside.items())
            if len(column) != usual and len(column) > 2 and _rises(column)
        }
        for name, column in inside.items():
            clock = clocks.get(len(column), "")
            whole.setdefault(".".join(filter(None, (stem, clock))), {})[name] = column
    return whole


def _rises(column: Any) -> bool:
    return column.dtype.kind in "iuf" and bool((np.diff(column.astype(np.float64)) > 0).all())


def _topic(name: str, columns: Mapping[str, Any], notes: list[str]) -> Topic:
    n = _usual_length(columns)
    clock = next((clock for clock in _CLOCKS if clock in columns), "")
    beside = f"where `{clock}` has {n}" if clock else f"where most have {n}"
    called = Names(list(columns))
    whole: dict[str, Column] = {}
    faults: dict[str, str] = {}
    for field, (spelt, column) in zip(called.names, columns.items(), strict=True):
        if len(column) != n:
            faults[field] = f"`{spelt}` has {len(column)} values {beside}; make them equal"
        elif column.dtype.kind in "US":
            whole[field] = column_of(np.asarray(column, dtype=str).tolist(), name=field)
        else:
            whole[field] = Column(np.asarray(column, dtype=np.float64))
    topic = topic_of(name, whole, units=called.units)
    faults |= topic.faults
    notes.extend(faults.values())
    return replace(topic, faults=faults)

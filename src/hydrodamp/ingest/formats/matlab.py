"""MATLAB files: up to version 7.2 by SciPy, 7.3 and other HDF5 by h5py."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np

from hydrodamp.advance import counted
from hydrodamp.data.recording import Recording
from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats.content import followed
from hydrodamp.ingest.formats.extras import extra
from hydrodamp.ingest.formats.gather import recording_of

FORMAT = "MATLAB file"
"""How messages call the format."""

_HDF5 = b"\x89HDF\r\n\x1a\n"


def read(path: str | Path) -> Recording:
    """Read the arrays of a ``.mat`` or HDF5 file."""
    try:
        with open(path, "rb") as file:
            begin = file.read(520)
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    newer = begin.startswith(_HDF5) or begin[512:] == _HDF5
    notes: list[str] = []
    arrays = _hdf5(path, notes) if newer else _matlab(path, notes)
    return recording_of(arrays, str(path), FORMAT, tuple(notes))


def _matlab(path: str | Path, notes: list[str]) -> dict[str, Any]:
    import scipy.io

    try:
        with followed(path) as file:
            # Its stubs know no open files; its documentation does.
            content = scipy.io.loadmat(cast("str", file), simplify_cells=True)
    except Exception as error:  # a damaged file fails in ways SciPy does not list
        raise _damaged(path, error) from error
    inside = {name: value for name, value in content.items() if not name.startswith("__")}
    return dict(_flat(inside, "", notes))


def _flat(inside: Mapping[str, Any], stem: str, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of a structure by their paths."""
    for name, value in inside.items():
        path = f"{stem}.{name}" if stem else name
        if isinstance(value, dict):
            yield from _flat(value, path, notes)
        elif _is_struct_array(value):
            keys = value[0].keys()
            rows = {key: np.array([row.get(key, np.nan) for row in value]) for key in keys}
            yield from _flat(rows, path, notes)
        elif isinstance(value, (str, bytes)):
            continue
        elif np.asarray(value).dtype == object or np.asarray(value).dtype.names:
            notes.append(
                f"`{path}` is an object of MATLAB's own, such as a table or timeseries; left out."
                " Save its numbers as arrays"
            )
        else:
            yield path, value


def _is_struct_array(value: Any) -> bool:
    rows = isinstance(value, (list, np.ndarray)) and len(np.shape(value)) == 1 and len(value) > 0
    return rows and all(isinstance(row, dict) for row in value)


def _hdf5(path: str | Path, notes: list[str]) -> dict[str, Any]:
    h5py = extra("h5py", path)
    arrays: dict[str, Any] = {}
    found: list[tuple[str, Any]] = []

    def visit(name: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset) and not name.startswith("#"):
            found.append((name.replace("/", "."), node))

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
            for name, node in counted(found, len(found)):
                _add(arrays, name, node, notes)
    except (OSError, RuntimeError, ValueError, KeyError) as error:
        raise _damaged(path, error) from error
    return arrays


def _add(arrays: dict[str, Any], name: str, node: Any, notes: list[str]) -> None:
    """Take a dataset; MATLAB stores its columns as rows."""
    kind = node.attrs.get("MATLAB_class", b"")
    if kind in (b"char", b"cell") or "MATLAB_empty" in node.attrs:
        return
    if node.dtype.kind not in "buif":
        notes.append(f"`{name}` of type {node.dtype} was left out")
        return
    block = node[()]
    arrays[name] = block.T if kind else block


def _damaged(path: str | Path, error: Exception) -> LogError:
    why = str(error).strip().split("\n")[0] or type(error).__name__
    return LogError(
        f"the MATLAB file is cut off or damaged: {why}. Save it again", source=str(path)
    )

"""NumPy's archives of arrays, and single arrays with named columns."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.advance import counted
from hydrodamp.data.recording import Recording
from hydrodamp.errors import FileError, LogError
from hydrodamp.ingest.formats.gather import recording_of

FORMAT = "NumPy arrays"
"""How messages call the format."""


def read(path: str | Path) -> Recording:
    """Read the arrays of an ``.npz`` or ``.npy`` file."""
    notes: list[str] = []
    try:
        arrays = _arrays(path, notes)
    except FileNotFoundError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror}") from error
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise LogError(
            f"the archive of arrays is cut off or damaged: {error}. Write or copy it again",
            source=str(path),
        ) from error
    return recording_of(arrays, str(path), FORMAT, tuple(notes))


def _arrays(path: str | Path, notes: list[str]) -> dict[str, Any]:
    with open(path, "rb") as file:
        loaded = np.load(file, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            names = loaded.dtype.names
            return {name: loaded[name] for name in names} if names else {"array": loaded}
        return dict(_members(loaded, notes))


def _members(archive: Any, notes: list[str]) -> Iterator[tuple[str, Any]]:
    for name in counted(archive.files, len(archive.files)):
        try:
            yield name, archive[name]
        except ValueError as error:
            if "object" not in str(error).lower():
                raise
            notes.append(f"`{name}` holds Python objects, which are never loaded; left out")

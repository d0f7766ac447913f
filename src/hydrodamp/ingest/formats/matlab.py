"""MATLAB files up to version 7.2, read by `scipy.io.loadmat` in a child process.

Damaged files crash SciPy's reader (SIGSEGV, SIGBUS); a child process contains the crash. It starts
in 0.4 s and returns the arrays as npz, never as pickles.
"""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import numpy as np

from hydrodamp.ingest.formats.content import max_unpacked_bytes, open_seekable

# `python -c` puts the working directory first in sys.path; its files must not be imported.
_CHILD_CODE = (
    "import sys; sys.path[:] = {path!r}; from {module} import load_in_child; load_in_child({bound})"
)
_MEMORY_COPIES = 4  # of the arrays; what reader and npz need at peak


def read_arrays(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of a file, named by their path in its structures."""
    with open_seekable(path) as file:
        data = file.read()
    code = _CHILD_CODE.format(
        path=sys.path, module=__name__, bound=_MEMORY_COPIES * max_unpacked_bytes(path)
    )
    process = subprocess.run(
        [sys.executable, "-c", code], input=data, capture_output=True, check=False
    )
    if process.returncode:
        raise ValueError(_failure_reason(process))
    with np.load(io.BytesIO(process.stdout), allow_pickle=False) as archive:
        names, messages, *arrays = (archive[key] for key in archive.files)
    notes += messages.tolist()
    yield from zip(names.tolist(), arrays, strict=True)


def _failure_reason(done: subprocess.CompletedProcess[bytes]) -> str:
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode > 0 and lines:
        return lines[-1]
    name = f"status {done.returncode}"
    with suppress(ValueError):
        name = signal.Signals(-done.returncode).name
    return f"it makes SciPy's reader crash ({name})"


def load_in_child(bound: int) -> None:
    """Read a file from standard input and write its arrays as npz (runs in the child process)."""
    import scipy.io

    _limit_memory(bound)
    stream = cast(
        "str", io.BytesIO(sys.stdin.buffer.read())
    )  # SciPy accepts a stream, its stubs do not
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

"""MATLAB files up to version 7.2, read by SciPy in a process of its own.

Damaged files crash SciPy's reader (SIGSEGV, SIGBUS); in a child that costs one file, not the work.
The child starts in 0.4 s and hands arrays over as NumPy's npz, never as pickles.
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

from hydrodamp.ingest.formats.content import seekable, unpacked_bound

# `-c` puts the working directory first, whose files are not to be imported.
_CHILD = "import sys; sys.path[:] = {path!r}; from {module} import load; load({bound})"
_COPIES = 4  # of the arrays, that the reader and the hand-over need at once


def read_arrays(path: str | Path, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of a file by their paths in its structures."""
    with seekable(path) as file:
        data = file.read()
    code = _CHILD.format(path=sys.path, module=__name__, bound=_COPIES * unpacked_bound(path))
    done = subprocess.run(
        [sys.executable, "-c", code], input=data, capture_output=True, check=False
    )
    if done.returncode:
        raise ValueError(_reason(done))
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as handed:
        names, texts, *arrays = (handed[key] for key in handed.files)
    notes += texts.tolist()
    yield from zip(names.tolist(), arrays, strict=True)


def _reason(done: subprocess.CompletedProcess[bytes]) -> str:
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode > 0 and lines:
        return lines[-1]
    name = f"status {done.returncode}"
    with suppress(ValueError):
        name = signal.Signals(-done.returncode).name
    return f"it makes SciPy's reader crash ({name})"


def load(bound: int) -> None:
    """Read a file on standard input and write its arrays, in the child."""
    import scipy.io

    _limit_memory(bound)
    stream = cast("str", io.BytesIO(sys.stdin.buffer.read()))  # as SciPy takes it, not its stubs
    content = scipy.io.loadmat(stream, simplify_cells=True)
    inside = {name: value for name, value in content.items() if not name.startswith("__")}
    notes: list[str] = []
    found = dict(_arrays(inside, "", notes))
    out = io.BytesIO()
    names = np.array([*found], dtype=np.str_)
    np.savez(out, names, np.array(notes, dtype=np.str_), *map(np.asarray, found.values()))
    sys.stdout.buffer.write(out.getbuffer())


def _limit_memory(bound: int) -> None:
    """Let this process take so many bytes more, where the system can bound it."""
    with suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        limit = pages * os.sysconf("SC_PAGE_SIZE") + bound
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def _arrays(inside: Mapping[str, Any], stem: str, notes: list[str]) -> Iterator[tuple[str, Any]]:
    """Yield the arrays of a structure by their paths."""
    for name, value in inside.items():
        path = f"{stem}.{name}" if stem else name
        rows = list(value) if isinstance(value, (list, np.ndarray)) and np.ndim(value) == 1 else []
        if isinstance(value, dict):
            yield from _arrays(value, path, notes)
        elif rows and all(isinstance(row, dict) for row in rows):
            columns = {key: np.array([row.get(key, np.nan) for row in rows]) for key in rows[0]}
            yield from _arrays(columns, path, notes)
        elif isinstance(value, (str, bytes)):
            continue
        elif np.asarray(value).dtype == object or np.asarray(value).dtype.names:
            notes.append(
                f"`{path}` is an object of MATLAB's own, such as a table or timeseries; left out."
                " Save its numbers as arrays"
            )
        else:
            yield path, value

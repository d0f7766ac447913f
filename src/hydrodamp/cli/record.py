"""What a run was: its command line, the files it read with their hashes, its versions."""

from __future__ import annotations

import hashlib
import platform
import shlex
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from hydrodamp.cli.guard import warned


def record(inputs: Iterable[str | None]) -> dict[str, str]:
    """Return a run in words, for the provenance of its results."""
    import numpy
    import scipy

    words = {
        "command": shlex.join(["hydrodamp", *sys.argv[1:]]),
        "files": "\n".join(f"{_digest(path)}  {_one_line(path)}" for path in _files(inputs)),
        "versions": f"Python {platform.python_version()}, NumPy {numpy.__version__}, "
        f"SciPy {scipy.__version__}, {platform.system()} {platform.machine()}",
        "warnings": "\n".join(warned()),
    }
    return {key: text for key, text in words.items() if text}


def _files(inputs: Iterable[str | None]) -> Iterator[Path]:
    for path in dict.fromkeys(Path(name) for name in inputs if name):
        if path.is_dir():
            yield from sorted(each for each in path.rglob("*") if each.is_file())
        elif path.is_file():
            yield path


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _one_line(path: Path) -> str:
    return "".join(
        each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in str(path)
    )

"""Checks of ``--out`` before a run, and the provenance of its results."""

from __future__ import annotations

import hashlib
import platform
import shlex
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from hydrodamp.data.canonical import check_log_file
from hydrodamp.errors import FileError, ProblemError
from hydrodamp.ingest.formats.files import split_joined_paths
from hydrodamp.report.files import RESULTS, is_result
from hydrodamp.results import check_new_file, check_results

Inputs = Iterable[str | None]


def check_out_file(out: Path | None, inputs: Inputs, force: bool) -> None:
    """Raise if a file cannot be written, would replace an input, or exists."""
    if out is None:
        return
    for path in _files(inputs):
        if out.exists() and out.samefile(path):
            raise FileError(f"`--out {out}` is one of the inputs: give another file.")
    check_new_file(out, force)


def check_out_log(out: Path | None, inputs: Inputs, force: bool) -> None:
    """Raise also if the suffix is not that of a log."""
    check_out_file(out, inputs, force)
    if out is not None:
        check_log_file(out)


def check_out_folder(out: Path | None, inputs: Inputs, resume: bool, force: bool) -> None:
    """Raise if a folder cannot be written or files in it would be replaced."""
    if out is None:
        if resume:
            raise ProblemError(
                "`--resume` reuses fits of an interrupted run: give its folder with `--out DIR`."
            )
        return
    for path in _files(inputs):
        if is_result(path.resolve(), out.resolve()):
            raise FileError(f"`--out {out}` would replace the input {path}: give another folder.")
    check_results(out, RESULTS, force or resume)


def run_provenance(inputs: Inputs) -> dict[str, str]:
    """Return the command line, input files with hashes, and versions."""
    import numpy
    import scipy

    words = {
        "command": shlex.join(["hydrodamp", *sys.argv[1:]]),
        "files": "\n".join(f"{_digest(path)}  {path}" for path in _all_files(inputs)),
        "versions": f"Python {platform.python_version()}, NumPy {numpy.__version__}, "
        f"SciPy {scipy.__version__}, {platform.system()} {platform.machine()}",
    }
    return {key: text for key, text in words.items() if text}


def _files(inputs: Inputs) -> list[Path]:
    return [path for path in _paths(inputs) if path.is_file()]


def _paths(inputs: Inputs) -> list[Path]:
    """Return the distinct input files and folders."""
    return [*dict.fromkeys(path for name in inputs if name for path in split_joined_paths(name))]


def _all_files(inputs: Inputs) -> Iterator[Path]:
    for path in _paths(inputs):
        if path.is_dir():
            yield from sorted(file for file in path.rglob("*") if file.is_file())
        elif path.is_file():
            yield path


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

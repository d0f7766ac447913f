"""The door to recorded files of every format."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hydrodamp.data.canonical import read_canonical
from hydrodamp.data.log import Log
from hydrodamp.data.mapping import LogMapping, read_mapping
from hydrodamp.data.stretches import concatenate
from hydrodamp.errors import FileError, LogError

SUFFIXES = (".csv",)
"""File names that can be read."""


def read_log(path: str | Path, mapping: LogMapping | str | Path | None = None) -> Log:
    """Read one log.

    Parameters
    ----------
    path : str or Path
        A ``.csv`` file.
    mapping : LogMapping, str or Path, optional
        How its columns are called and measured, or the YAML file that says so;
        without one the file must be in the canonical form.

    Returns
    -------
    log : Log
        In SI units, forward-starboard-down and north-east-down, split in segments.

    Raises
    ------
    FileError
        If a file cannot be opened.
    LogError
        With every fault of the file, or if its format is not supported.

    Warns
    -----
    GapWarning
        Once, if a gap or missing values split the log.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        known = " ".join(SUFFIXES)
        got = f"a file '{suffix}'" if suffix else "a name without suffix"
        raise LogError(f"can read {known} only; got {got}. Convert it to CSV", source=str(path))
    if Path(path).is_dir():
        raise FileError(f"{path}: is a folder; give the files in it")
    if mapping is None:
        return read_canonical(path)
    return (mapping if isinstance(mapping, LogMapping) else read_mapping(mapping)).read(path)


def read_logs(
    paths: Iterable[str | Path] | str | Path, mapping: LogMapping | str | Path | None = None
) -> Log:
    """Read several logs as one, each file at least a segment of its own.

    Parameters
    ----------
    paths : iterable of str or Path, or one of them
        The files; their columns must agree.
    mapping : LogMapping, str or Path, optional
        As for :func:`read_log`, for all of them.

    Returns
    -------
    log : Log
        The logs one after the other.

    Raises
    ------
    FileError
        If a file cannot be opened.
    LogError
        With the faults of every file.
    """
    files = [paths] if isinstance(paths, (str, Path)) else list(paths)
    if mapping is not None and not isinstance(mapping, LogMapping):
        mapping = read_mapping(mapping)
    logs, errors = [], []
    for path in files:
        try:
            logs.append(read_log(path, mapping))
        except LogError as error:
            errors.append(error)
    if len(errors) == 1:
        raise errors[0]
    if errors:
        raise LogError([str(error) for error in errors])
    return concatenate(logs)

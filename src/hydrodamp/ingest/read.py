"""The door to recorded files of every format."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from hydrodamp.conditioning.steps import clean
from hydrodamp.data.log import Log, concatenate
from hydrodamp.data.recording import Recording
from hydrodamp.errors import GapWarning
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.mapping.canonical_table import canonical_record

#: A file or a folder.
Place = str | Path


def read_log(path: Place | Sequence[Place], mapping: LogMapping | str | Path | None = None) -> Log:
    """Read one log, from one file or from several that were recorded together.

    Parameters
    ----------
    path : str or Path, or sequence of them
        A file, the files or the folder of one recording, in any format that can be read.
    mapping : LogMapping, str or Path, optional
        How its topics and columns are called and measured: a mapping, its YAML file, or the name
        of a preset; without one the file must be a table in the canonical form.

    Returns
    -------
    log : Log
        On one clock, in SI units, forward-starboard-down and north-east-down, split in segments.

    Raises
    ------
    FileError
        If a file cannot be opened, or its reader is not installed.
    LogError
        With every fault of the file.

    Warns
    -----
    GapWarning
        Once, if a gap or missing values split the log.
    ClockWarning
        Once, if a clock repeats, runs backwards or leaps.
    """
    given = _mapping(mapping)
    return _log(read_recording(path), given)


def read_recording(path: Place | Sequence[Place]) -> Recording:
    """Read all topics of one recording, as they stand in the file.

    Parameters
    ----------
    path : str or Path, or sequence of them
        A file, the files or the folder of one recording.

    Returns
    -------
    recording : Recording
        Numbers in the units and axes of the file, each topic on its own clock.

    Raises
    ------
    FileError
        If a file cannot be opened, or its reader is not installed.
    LogError
        With every fault of the file.
    """
    from hydrodamp.ingest.formats.files import read

    return read(path)


def read_logs(
    paths: Iterable[Place] | Place, mapping: LogMapping | str | Path | None = None
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
    from hydrodamp.ingest.formats.files import each

    files = [paths] if isinstance(paths, (str, Path)) else list(paths)
    given = _mapping(mapping)
    return concatenate(each(files, lambda path: read_log(path, given)))


def logs_of(recordings: Iterable[Recording], mapping: LogMapping | str | Path | None = None) -> Log:
    """Return several recordings as one log, each at least a segment of its own."""
    from hydrodamp.ingest.formats.files import each

    given = _mapping(mapping)
    return concatenate(each(recordings, lambda recording: _log(recording, given)))


def _log(recording: Recording, mapping: LogMapping | None) -> Log:
    if mapping is not None:
        return mapping.log(recording)
    return Log.from_record(canonical_record(recording))


def read_parts(
    path: Place, mapping: LogMapping | str | Path | None = None, rows: int = 400_000
) -> Iterator[Log]:
    """Read a table larger than memory, one log after the other.

    Parameters
    ----------
    path : str or Path
        A table: text in columns or Parquet.
    mapping : LogMapping, str or Path, optional
        As for :func:`read_log`.
    rows : int, optional
        How many rows a part has.

    Yields
    ------
    log : Log
        The next rows; a segment ends where a part does. Parts in which nothing is known are left
        out, with a warning.

    Raises
    ------
    FileError
        If the file cannot be opened, or its format cannot be read in parts.
    LogError
        With every fault of a part.
    """
    from hydrodamp.ingest.formats.detect import parts

    given = _mapping(mapping)
    for number, part in enumerate(parts(path, rows), start=1):
        if not _is_blank(part, given):
            record = canonical_record(part) if given is None else given.record(part)
            if np.count_nonzero(~record.missing) > 1:
                log = Log.from_record(record)
                yield log if given is None else clean(log, given.steps)
                continue
        blank = f"{path}: part {number} has no two samples with all their values; left out"
        warnings.warn(blank, GapWarning, stacklevel=2)


def _is_blank(part: Recording, mapping: LogMapping | None) -> bool:
    """Return whether a column of a part that is used has no number at all."""
    fields = part.topics[0].fields
    used = set(fields) if mapping is None else {entry.column for entry in mapping.entries}
    return any(bool(np.isnan(fields[name]).all()) for name in used & set(fields))


def _mapping(given: LogMapping | str | Path | None) -> LogMapping | None:
    return read_mapping(given) if isinstance(given, str | Path) else given

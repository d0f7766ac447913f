"""The door to recorded files: through a mapping, or as a table in the canonical form."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.conditioning.pipeline import clean
from hydrodamp.data.canonical import record_of_columns
from hydrodamp.data.channels import QUANTITIES, RESERVED, SEGMENT
from hydrodamp.data.checks import record_faults
from hydrodamp.data.log import Log, concatenate
from hydrodamp.data.record import Record
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats import files
from hydrodamp.ingest.mapping import LogMapping, presets, read_mapping
from hydrodamp.ingest.mapping.columns import FoundColumn, labels_of
from hydrodamp.ingest.mapping.schema import Entry, Source
from hydrodamp.text import first_few

#: A file or a folder.
Place = str | Path

_DRAFT = "Let `hydrodamp probe LOG --draft mapping.yaml` draft one, and give it by `--mapping`"
_UNNAMED = re.compile(r"column \d+")  # how readers call a column without a name
_TWICE = re.compile(r"(.*) \(\d+\)")  # and one whose name another has too


def read_log(path: Place | Sequence[Place], mapping: LogMapping | str | Path | None = None) -> Log:
    """Read one log, from one file or from several that were recorded together.

    Parameters
    ----------
    path : str or Path, or sequence of them
        A file, the files or the folder of one recording, in any format that can be read;
        ``pose.csv+pwm.csv`` joins two.
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
    return _log(read_recording(path, given), given)


def read_recording(
    path: Place | Sequence[Place], mapping: LogMapping | str | Path | None = None
) -> Recording:
    """Read all topics of one recording, as they stand in the file.

    Parameters
    ----------
    path : str or Path, or sequence of them
        A file, the files or the folder of one recording; ``pose.csv+pwm.csv`` joins two.
        Files beside others that cannot be read are left out, with a note.
    mapping : LogMapping, str or Path, optional
        Its ``files`` say which others belong to a file.

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
    given = _mapping(mapping)
    return files.read(path, None if given is None else given.files)


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
    given_paths = [paths] if isinstance(paths, (str, Path)) else list(paths)
    given = _mapping(mapping)
    return concatenate(files.each(given_paths, lambda path: read_log(path, given)))


def logs_of(recordings: Iterable[Recording], mapping: LogMapping | str | Path | None = None) -> Log:
    """Return several recordings as one log, each at least a segment of its own."""
    given = _mapping(mapping)
    return concatenate(files.each(recordings, lambda recording: _log(recording, given)))


def _log(recording: Recording, mapping: LogMapping | None) -> Log:
    if mapping is not None and mapping.entries:
        return mapping.log(recording)
    log = Log.from_record(canonical_record(recording))
    return log if mapping is None else clean(log, mapping.steps)


def _mapping(given: LogMapping | str | Path | None) -> LogMapping | None:
    return read_mapping(given) if isinstance(given, str | Path) else given


def canonical_record(recording: Recording) -> Record:
    """Return the record of a table in the canonical form."""
    if len(recording.topics) != 1 or recording.topics[0].name:
        raise LogError(_no_table(recording), source=recording.source)
    table = recording.topics[0]
    names = dict.fromkeys([*table.fields, *table.texts, *table.faults])
    if names.keys().isdisjoint(VELOCITIES):
        raise LogError(
            "there is no velocity column, none of u v w p q r among"
            f" {', '.join(first_few([*names], 8, 'columns'))}. {_DRAFT}",
            source=recording.source,
        )
    columns = [*_columns(table)]
    faults = {one.field: [*one.faults()] for one in columns}
    # What cannot be read is there all the same, so that nothing else is said to be missing.
    numbers = {
        one.field: np.zeros(table.n) if faults[one.field] else one.values() for one in columns
    }
    if "time" not in numbers and table.time is not None:
        numbers["time"] = table.time
    record, wrong = record_of_columns(
        numbers,
        tuple(name for name in numbers if name not in RESERVED and not _is_odd(name, table)),
        labels_of(table, "segment"),
        table.lines or None,
        recording.source,
    )
    told = [fault for each in faults.values() for fault in each]
    told += [*wrong, *_name_faults((*table.fields, *table.texts))]
    if told and record is not None and not any(faults.values()):
        told += record_faults(record)
    if told or record is None:
        raise LogError(told or ["there are no samples"], source=recording.source)
    return dataclasses.replace(record, notes=recording.notes)


def _columns(table: Topic) -> Iterator[FoundColumn]:
    """Yield the columns, but for the names of segments."""
    for name in dict.fromkeys((*table.faults, *table.fields, *table.texts)):
        if name != SEGMENT or (name in table.faults and name not in table.texts):
            source = Source(column=name)
            yield FoundColumn(Entry("", name, (source,), QUANTITIES.get(name)), source, table, name)


def _is_odd(name: str, table: Topic) -> bool:
    """Return whether a column has no name of its own: none at all, or one that stands twice."""
    twice = _TWICE.fullmatch(name)
    return bool(_UNNAMED.fullmatch(name)) or (twice is not None and twice[1] in table.faults)


def _name_faults(names: Collection[str]) -> Iterator[str]:
    """Yield the names that are empty, or reserved ones (`time` is missed anyway) in other case."""
    for name in names:
        if _UNNAMED.fullmatch(name):
            yield f"{name} has no name; drop it (pandas: `to_csv(..., index=False)`)"
        lower = name.lower()
        if len(name) > 1 and name != lower and lower in RESERVED[1:] and lower not in names:
            yield f"column `{name}` must be spelt `{lower}`; names keep their case"


def _no_table(recording: Recording) -> str:
    names = [topic.name or "(a table)" for topic in recording.topics]
    if len(names) > 1 and all(map(is_canonical, recording.topics)):
        return (
            f"each of {', '.join(names)} is a whole log in the canonical form. Read them one after"
            " another by `read_logs`; `read_log` takes several files as the topics of one recording"
        )
    told = ", ".join(first_few(names, 8, "topics"))
    return (
        f"it holds the topics {told or 'none'}; a mapping must say which is what. {_DRAFT}, or take"
        f" a preset: {', '.join(presets())}"
    )


def is_canonical(topic: Topic) -> bool:
    """Return whether a topic has a time and a velocity by their canonical names."""
    names = {*topic.fields, *topic.texts, *topic.faults}
    return "time" in names and not names.isdisjoint(VELOCITIES)

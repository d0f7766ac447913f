"""Reading of logs from files: with a mapping, or as a table in the canonical form."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.pipeline import clean
from hydrodamp.data.channels import QUANTITIES, RESERVED, SEGMENT
from hydrodamp.data.checks import record_faults
from hydrodamp.data.columns import record_of_columns
from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log
from hydrodamp.data.record import Record
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError, first_few
from hydrodamp.ingest.formats import files
from hydrodamp.ingest.formats.dates import settle_dates
from hydrodamp.ingest.mapping import LogMapping, presets, read_mapping
from hydrodamp.ingest.mapping.channel_schema import Entry, Source
from hydrodamp.ingest.mapping.columns import FoundColumn, read_labels
from hydrodamp.ingest.sparse_table import sparse_mapping

#: A file or a folder.
LogPath = str | Path

_DRAFT_HINT = (
    "Run `hydrodamp probe LOG --draft mapping.yaml` to draft one, and pass it with `--mapping`"
)
_UNNAMED = re.compile(r"column \d+")  # name that readers give to an unnamed column
_DUPLICATE = re.compile(r"(.*) \(\d+\)")  # and to a repeated name


def read_log(
    path: LogPath | Sequence[LogPath], mapping: LogMapping | str | Path | None = None
) -> Log:
    """Read one log, from one file or from several files of one recording.

    Parameters
    ----------
    path : str or Path, or sequence of them
        A file, the files or the folder of one recording, in any supported format;
        ``pose.csv+pwm.csv`` joins two files.
    mapping : LogMapping, str or Path, optional
        Names, units and axes of topics and columns: a mapping, its YAML file, or the name of a
        preset. Without a mapping, the file must be a table in the canonical form.

    Returns
    -------
    log : Log
        On one clock, in SI units, forward-starboard-down and north-east-down, split in segments.

    Raises
    ------
    FileError
        If a file cannot be opened, or its reader is not installed.
    LogError
        With all faults of the file.

    Warns
    -----
    GapWarning
        Once, if a gap or missing values split the log.
    ClockWarning
        Once, if a clock has duplicate or out-of-order timestamps or resets.
    """
    log_mapping = _load_mapping(mapping)
    return _make_log(read_recording(path, log_mapping), log_mapping)


def read_recording(
    path: LogPath | Sequence[LogPath], mapping: LogMapping | str | Path | None = None
) -> Recording:
    """Read all topics of one recording, unconverted.

    Parameters
    ----------
    path : str or Path, or sequence of them
        A file, the files or the folder of one recording; ``pose.csv+pwm.csv`` joins two files.
        Unreadable files of several are skipped with a note.
    mapping : LogMapping, str or Path, optional
        Its ``files`` name the other files of the recording.

    Returns
    -------
    recording : Recording
        Numbers in the units and axes of the file; each topic has its own clock.

    Raises
    ------
    FileError
        If a file cannot be opened, or its reader is not installed.
    LogError
        With all faults of the file.
    """
    return read_recordings([path], mapping)[0]


def read_recordings(
    paths: Iterable[LogPath | Sequence[LogPath]], mapping: LogMapping | str | Path | None = None
) -> list[Recording]:
    """Read recordings with one order of day and month in their dates; raise all faults."""
    log_mapping = _load_mapping(mapping)
    patterns = None if log_mapping is None else log_mapping.files
    read = partial(files.read_files, patterns=patterns)
    return settle_dates(files.map_reporting_all_faults(paths, read))


def read_logs(
    paths: Iterable[LogPath] | LogPath, mapping: LogMapping | str | Path | None = None
) -> Log:
    """Read several logs as one; each file begins a new segment.

    Parameters
    ----------
    paths : iterable of str or Path, or one of them
        The files; their columns must agree.
    mapping : LogMapping, str or Path, optional
        As for :func:`read_log`; applies to all files.

    Returns
    -------
    log : Log
        The concatenated logs.

    Raises
    ------
    FileError
        If a file cannot be opened.
    LogError
        With the faults of all files.
    """
    path_list = [paths] if isinstance(paths, (str, Path)) else list(paths)
    log_mapping = _load_mapping(mapping)
    return combine_recordings(read_recordings(path_list, log_mapping), log_mapping)


def combine_recordings(
    recordings: Iterable[Recording], mapping: LogMapping | str | Path | None = None
) -> Log:
    """Concatenate several recordings to one log; each begins a new segment."""
    make_log = partial(_make_log, mapping=_load_mapping(mapping))
    logs = files.map_reporting_all_faults(recordings, make_log)
    return logs[0] if len(logs) == 1 else concatenate(logs)


def _make_log(recording: Recording, mapping: LogMapping | None) -> Log:
    if mapping is not None and mapping.entries:
        return mapping.log(recording)
    topics = recording.topics
    content = sparse_mapping(topics[0]) if len(topics) == 1 and is_canonical(topics[0]) else {}
    if content:
        log = LogMapping.from_dict(content, recording.source).log(recording)
    else:
        log = Log.from_record(canonical_record(recording))
    return log if mapping is None else clean(log, mapping.steps)


def _load_mapping(mapping: LogMapping | str | Path | None) -> LogMapping | None:
    return read_mapping(mapping) if isinstance(mapping, str | Path) else mapping


def canonical_record(recording: Recording) -> Record:
    """Return the record of a table in the canonical form; raise all faults."""
    if len(recording.topics) != 1 or recording.topics[0].name:
        raise LogError(_describe_topics(recording), source=recording.source)
    table = recording.topics[0]
    names = dict.fromkeys([*table.fields, *table.texts, *table.faults])
    if names.keys().isdisjoint(VELOCITIES):
        raise LogError(
            "expected a velocity column u v w p q r, found"
            f" {', '.join(first_few([*names], 8, 'columns'))}. {_DRAFT_HINT}",
            source=recording.source,
        )
    columns = [*_find_columns(table)]
    faults = {column.field: [*column.faults()] for column in columns}
    # Unreadable columns count as present, so that they are not also reported as missing.
    numbers = {
        column.field: np.zeros(table.n) if faults[column.field] else column.values()
        for column in columns
    }
    if "time" not in numbers and table.time is not None:
        numbers["time"] = table.time
    record, record_messages = record_of_columns(
        numbers,
        tuple(name for name in numbers if name not in RESERVED and not _is_unnamed(name, table)),
        read_labels(table, "segment"),
        table.lines or None,
        recording.source,
    )
    messages = [fault for column_faults in faults.values() for fault in column_faults]
    messages += [*record_messages, *_name_faults((*table.fields, *table.texts))]
    if messages and record is not None and not any(faults.values()):
        messages += record_faults(record)
    if messages or record is None:
        raise LogError(messages or ["the table has no samples"], source=recording.source)
    return dataclasses.replace(record, notes=recording.notes)


def _find_columns(table: Topic) -> Iterator[FoundColumn]:
    """Yield all columns except segment labels."""
    for name in dict.fromkeys((*table.faults, *table.fields, *table.texts)):
        if name != SEGMENT or (name in table.faults and name not in table.texts):
            source = Source(column=name)
            yield FoundColumn(Entry("", name, (source,), QUANTITIES.get(name)), source, table, name)


def _is_unnamed(name: str, table: Topic) -> bool:
    """Return whether a column is unnamed or repeats a name."""
    duplicate = _DUPLICATE.fullmatch(name)
    is_duplicate = duplicate is not None and duplicate[1] in table.faults
    return is_duplicate or bool(_UNNAMED.fullmatch(name))


def _name_faults(names: Collection[str]) -> Iterator[str]:
    """Yield faults of empty names and of reserved names in upper case."""
    for name in names:
        if _UNNAMED.fullmatch(name):
            yield f"{name} has no name; delete it (pandas: `to_csv(..., index=False)`)"
        lower = name.lower()
        if len(name) > 1 and name != lower and lower in RESERVED[1:] and lower not in names:
            yield f"column `{name}` must be named `{lower}`; names are case-sensitive"


def _describe_topics(recording: Recording) -> str:
    names = [topic.name or "(a table)" for topic in recording.topics]
    if len(names) > 1 and all(map(is_canonical, recording.topics)):
        return (
            f"each of {', '.join(names)} is a complete log in the canonical form. Read them with"
            " `read_logs`; `read_log` takes several files as the topics of one recording"
        )
    listed = ", ".join(first_few(names, 8, "topics"))
    return (
        f"it holds the topics {listed or 'none'}; a mapping is required to assign channels."
        f" {_DRAFT_HINT}, or use a preset: {', '.join(presets())}"
    )


def is_canonical_recording(recording: Recording) -> bool:
    """Return whether a recording is one table in the canonical form, which needs no mapping."""
    topics = recording.topics
    return len(topics) == 1 and not topics[0].name and is_canonical(topics[0])


def is_canonical(topic: Topic) -> bool:
    """Return whether a topic has columns `time` and a velocity in the canonical form."""
    names = {*topic.fields, *topic.texts, *topic.faults}
    return "time" in names and not names.isdisjoint(VELOCITIES)

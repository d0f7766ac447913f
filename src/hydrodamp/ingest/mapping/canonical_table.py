"""Recordings whose columns have the canonical names, so that no mapping is needed."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Iterator

import numpy as np

from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.canonical import record_of_columns
from hydrodamp.data.channels import QUANTITIES, RESERVED, SEGMENT
from hydrodamp.data.checks import record_faults
from hydrodamp.data.record import Record
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.mapping.finding import Found, labels_of, listed
from hydrodamp.ingest.mapping.log_mapping import presets
from hydrodamp.ingest.mapping.schema import Entry, Source

_LISTED = 8
_UNNAMED = re.compile(r"column \d+")  # how readers call a column without a name
_TWICE = re.compile(r"(.*) \(\d+\)")  # and one whose name another has too


def canonical_record(recording: Recording) -> Record:
    """Return the record of a table in the canonical form."""
    if len(recording.topics) != 1 or recording.topics[0].name:
        raise LogError(_no_table(recording), source=recording.source)
    table = recording.topics[0]
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


def _columns(table: Topic) -> Iterator[Found]:
    """Yield the columns, but for the names of segments."""
    for name in dict.fromkeys((*table.faults, *table.fields, *table.texts)):
        if name != SEGMENT or (name in table.faults and name not in table.texts):
            source = Source(column=name)
            yield Found(Entry("", name, (source,), QUANTITIES.get(name)), source, table, name)


def _is_odd(name: str, table: Topic) -> bool:
    """Return whether a column has no name of its own: none at all, or one that stands twice."""
    twice = _TWICE.fullmatch(name)
    return bool(_UNNAMED.fullmatch(name)) or (twice is not None and twice[1] in table.faults)


def _name_faults(names: Collection[str]) -> Iterator[str]:
    """Yield the names that are empty, or reserved ones (`time` is missed anyway) in other case."""
    if names and all(map(_UNNAMED.fullmatch, names)):
        yield "there is no line of column names; write one above the numbers"
        return
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
    return (
        f"it holds the topics {listed(names, _LISTED) or 'none'}; a mapping must say which is"
        f" what. Give a mapping file, or a preset: {', '.join(presets())}"
    )


def is_canonical(topic: Topic) -> bool:
    """Return whether a topic has a time and a velocity by their canonical names."""
    names = {*topic.fields, *topic.texts, *topic.faults}
    return "time" in names and not names.isdisjoint(VELOCITIES)

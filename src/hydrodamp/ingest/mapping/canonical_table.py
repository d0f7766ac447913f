"""Recordings whose columns have the canonical names, so that no mapping is needed."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Collection, Iterator

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.canonical import record_of_columns
from hydrodamp.data.channels import QUANTITIES, RESERVED
from hydrodamp.data.checks import record_faults
from hydrodamp.data.record import Record
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.data.units import UNITS, factor, spelt
from hydrodamp.errors import LogError
from hydrodamp.ingest.mapping.finding import NO_UNIT, labels_of, text_faults
from hydrodamp.ingest.mapping.log_mapping import presets

_LISTED = 8
_UNNAMED = re.compile(r"column \d+")  # how readers call a column without a name
_TWICE = re.compile(r"(.*) \(\d+\)")  # and one whose name another has too


def canonical_record(recording: Recording) -> Record:
    """Return the record of a table in the canonical form."""
    if len(recording.topics) != 1 or recording.topics[0].name:
        raise LogError(_no_table(recording), source=recording.source)
    table = recording.topics[0]
    fields = {**table.fields, **_unreadable(table)}
    numbers = {name: values for name, values in fields.items() if name != "segment"}
    if "time" not in numbers and table.time is not None:
        numbers["time"] = table.time
    numbers, unit_faults = _in_si(numbers, table)
    record, wrong = record_of_columns(
        numbers,
        tuple(name for name in numbers if name not in RESERVED and not _is_odd(name, table)),
        labels_of(table, "segment"),
        table.lines or None,
        recording.source,
    )
    names = (*table.fields, *table.texts)
    faults = [*_cell_faults(table), *unit_faults, *wrong, *_name_faults(names)]
    if faults and record is not None and not table.faults:
        faults += record_faults(record)
    if faults or record is None:
        raise LogError(faults or ["there are no samples"], source=recording.source)
    return dataclasses.replace(record, notes=recording.notes)


def _in_si(numbers: dict[str, FloatArray], table: Topic) -> tuple[dict[str, FloatArray], list[str]]:
    """Return the columns in SI units, and what is wrong with the units of the header."""
    turned, faults = dict(numbers), []
    for name, quantity in QUANTITIES.items():
        stated = table.units.get(name, "")
        if name not in numbers or name in table.faults or stated in NO_UNIT:
            continue
        if spelt(stated, quantity):
            scale = factor(stated, quantity)
            turned[name] = numbers[name] if scale == 1.0 else scale * numbers[name]
        else:
            faults.append(
                f"column `{name}` is in {stated} by its header, which is no unit of {quantity}"
                f" known here. Known are: {', '.join(UNITS[quantity])}"
            )
    return turned, faults


def _unreadable(table: Topic) -> dict[str, FloatArray]:
    """Return the columns that hold more than numbers as if they held some: they are there."""
    return {name: np.zeros(table.n) for name in table.faults}


def _is_odd(name: str, table: Topic) -> bool:
    """Tell a column without a name of its own: none at all, or one that stands twice."""
    twice = _TWICE.fullmatch(name)
    return bool(_UNNAMED.fullmatch(name)) or (twice is not None and twice[1] in table.faults)


def _cell_faults(table: Topic) -> Iterator[str]:
    """Name what is no number, but for the names of segments."""
    for name, fault in table.faults.items():
        if name != "segment" or name not in table.texts:
            yield fault
    for name, cells in table.texts.items():
        if name != "segment" and name not in table.faults:
            yield from text_faults(cells, name, table.lines)


def _name_faults(names: Collection[str]) -> Iterator[str]:
    """Say which names are empty, or a reserved one (but `time`, missed anyway) in other case."""
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
    more = len(names) - _LISTED
    listed = ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")
    return (
        f"it holds the topics {listed or 'none'}; a mapping must say which is what. Give a mapping"
        f" file, or a preset: {', '.join(presets())}"
    )


def is_canonical(topic: Topic) -> bool:
    """Return whether a topic has a time and a velocity by their canonical names."""
    names = {*topic.fields, *topic.texts, *topic.faults}
    return "time" in names and not names.isdisjoint(VELOCITIES)

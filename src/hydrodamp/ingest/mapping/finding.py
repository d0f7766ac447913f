"""The channels of a mapping, found in a recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.data.units import UNITS, factor, spelt
from hydrodamp.ingest.mapping.absence import absences
from hydrodamp.ingest.mapping.entries import Entry, Source

_MISSING = frozenset({"", "nan", "na", "n/a", "null", "none"})
_LISTED = 3


@dataclass(frozen=True, eq=False)
class Found:
    """A channel and the field of a topic it is read from."""

    entry: Entry
    source: Source
    topic: Topic | None
    field: str = ""

    @property
    def place(self) -> str:
        """How the channel is called: ``group.name``."""
        return f"{self.entry.group}.{self.entry.name}"

    def values(self) -> FloatArray:
        """Return its numbers in SI units, one a message, with their sign."""
        source, topic = self.source, self.topic
        if topic is None:
            values = np.array([source.value or 0.0])
        else:
            values = topic.fields[self.field]
            if source.scale != 1.0:
                values = values * source.scale
            for name, weight in source.plus:
                values = values + weight * topic.fields[beside(topic, name) or name]
            if source.offset != 0.0:
                values = values + source.offset
        scale = source.sign * self._factor()
        return values if scale == 1.0 else values * scale

    def _factor(self) -> float:
        unit = self.source.unit or self.stated()
        return 1.0 if unit is None else factor(unit)

    def stated(self) -> str | None:
        """Return the unit that the file states, where it counts and is known."""
        source = self.source
        plain = (source.scale, source.offset, source.plus) == (1.0, 0.0, ())
        if self.topic is None or self.entry.quantity is None or not plain:
            return None
        return spelt(self.topic.units.get(self.field, ""))

    def faults(self) -> Iterator[str]:
        """Say what is wrong with the field: words, or a unit of another quantity."""
        if self.topic is None:
            return
        if self.field in self.topic.faults:
            yield self.topic.faults[self.field]
        elif self.field in self.topic.texts and self.field not in self.topic.fields:
            cells = self.topic.texts[self.field]
            yield from text_faults(cells, self.source.column, self.topic.lines)
        unit, quantity = self.stated(), self.entry.quantity
        if unit and quantity and self.source.unit is None and unit not in UNITS[quantity]:
            yield (
                f"`{self.source.column}` is in {unit} by its file, which is no unit of {quantity}"
                f" as `{self.entry.name}` needs. Map another field, or state its unit"
            )


def find(
    entries: Sequence[Entry], recording: Recording, called: str, names: Sequence[str] = ()
) -> tuple[list[Found], list[str]]:
    """Return the channels that a recording has, and what is wrong with the others."""
    found = [_first(entry, recording) for entry in entries]
    faults = [fault for one in found if one is not None for fault in one.faults()]
    absent = [
        entry
        for entry, one in zip(entries, found, strict=True)
        if one is None and not any(source.optional for source in entry.choices)
    ]
    there = [one for one in found if one is not None]
    return there, list(dict.fromkeys([*faults, *absences(absent, recording, called, names)]))


def _first(entry: Entry, recording: Recording) -> Found | None:
    """Return the first choice that the recording has."""
    for source in entry.choices:
        if source.value is not None:
            return Found(entry, source, None)
        place = locate(source.column, recording)
        needed = [name for name, _ in (*source.where, *source.plus)]
        if place is not None and all(beside(place[0], name) is not None for name in needed):
            return Found(entry, source, *place)
    return None


def locate(column: str, recording: Recording) -> tuple[Topic, str] | None:
    """Return the topic and field that a mapping means."""
    for topic in sorted(recording.topics, key=lambda topic: -len(topic.name)):
        field = column.removeprefix(f"{topic.name}.") if topic.name else column
        known = (topic.fields, topic.texts, topic.faults)
        if (not topic.name or field != column) and any(field in names for names in known):
            return topic, field
    return None


def beside(topic: Topic, column: str) -> str | None:
    """Return the field of a topic that a condition means; None where it has none such."""
    for field in (column, column.removeprefix(f"{topic.name}.")):
        if field in topic.fields:
            return field
    return None


def text_faults(
    cells: Sequence[str], column: str, lines: Sequence[int] | None = None
) -> Iterator[str]:
    """Name the cells of a column that are no numbers."""
    bad = [
        f"{cell!r} in row {row + 1}" + (f" (line {lines[row]})" if lines else "")
        for row, cell in enumerate(cells)
        if not _is_number(cell)
    ]
    if not bad:
        return
    more = len(bad) - _LISTED
    tail = f" and {more} more" if more > 0 else ""
    yield f"column `{column}` must hold numbers; got {', '.join(bad[:_LISTED])}{tail}"


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return cell.strip().lower() in _MISSING
    return True

"""The channels of a mapping found in a recording, and what is said of those that are absent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.data.units import UNITS, parse_unit, unit_factor
from hydrodamp.errors import did_you_mean
from hydrodamp.ingest.formats.cells import bad_cells, number
from hydrodamp.ingest.mapping.schema import Entry, Source
from hydrodamp.text import first_few

# What stands where a unit would and is none: time scales, frames, sensors, what was done.
_NO_UNITS = """
- none utc gmt gps tai unix epoch posix local body vehicle base_link frd flu world earth inertial
ned enu nwu map odom sensor dvl imu ins ahrs ekf raw filtered filt est measured meas ref
"""
NO_UNIT = frozenset(("", *_NO_UNITS.split()))

_LISTED = 12

#: For every name that a mapping gives to topics those it may stand for.
Topics = Mapping[str, Sequence[str]]


@dataclass(frozen=True, eq=False)
class FoundColumn:
    """A channel and the field of a topic it is read from; a constant has no topic."""

    entry: Entry
    source: Source
    topic: Topic | None
    field: str = ""

    def values(self) -> FloatArray:
        """Return its numbers in SI units, one a message, with their sign."""
        source, topic = self.source, self.topic
        if topic is None:
            values = np.array([source.value or 0.0])
        else:
            values = topic.fields[self.field]
            if source.scale != 1.0 or source.offset != 0.0:
                values = values * source.scale + source.offset
            for name, weight in source.plus.items():
                values = values + weight * topic.fields[beside(topic, name) or name]
        unit = source.unit or self.stated()
        scale = source.sign * self.entry.sign * (unit_factor(unit) if unit else 1.0)
        return values if scale == 1.0 else values * scale

    def stated(self) -> str:
        """Return the unit that the file states, where it counts."""
        if self.topic is None or self.entry.quantity is None or self.source.unit:
            return ""
        unit = self.topic.units.get(self.field, "")
        return "" if unit.casefold() in NO_UNIT else parse_unit(unit, self.entry.quantity) or unit

    def faults(self) -> Iterator[str]:
        """Yield what is wrong with the field: words, or a unit that leaves its size open."""
        topic, source, called = self.topic, self.source, self.source.column
        if topic is None:
            return
        if self.field in topic.faults:
            yield topic.faults[self.field]
        elif self.field in topic.texts and self.field not in topic.fields:
            words = [*enumerate(topic.texts[self.field])]
            bad = [(row, word) for row, word in words if number(word) is None] or words
            yield from bad_cells(called, bad, topic.lines)
        unit, known = self.stated(), UNITS.get(self.entry.quantity or "", {})
        if unit and unit not in known:
            yield (
                f"column `{called}` is in {unit} by its file, which is no unit of"
                f" {self.entry.quantity} known here. Take another, or state its unit in a mapping."
                f" Known are: {', '.join(known)}"
            )
        elif known.get(unit, 1.0) != 1.0 and (source.plus or source.scale != 1 or source.offset):
            yield (
                f"column `{called}` is in {unit} by its file, and the mapping scales it or adds to"
                " it. State the `unit` of what comes out"
            )


def find(
    entries: Sequence[Entry], recording: Recording, called: str, topics: Topics
) -> tuple[list[FoundColumn], list[str]]:
    """Return the channels that a recording has, and what is wrong with the others."""
    names = meant(topics, recording)
    there, absent = [], []
    for entry in entries:
        sought = entry._replace(choices=tuple(_renamed(one, names) for one in entry.choices))
        if (one := _first(sought, recording)) is not None:
            there.append(one)
        elif not any(source.optional for source in entry.choices):
            absent.append(sought)
    faults = [fault for one in there for fault in one.faults()]
    faults += _absences(absent, recording, called, [*topics])
    return there, list(dict.fromkeys(faults))


def meant(topics: Topics, recording: Recording) -> dict[str, str]:
    """Return the topic of a recording that each name stands for: the first that is there."""
    known = {topic.name for topic in recording.topics}
    there = {name: [one for one in choices if one in known] for name, choices in topics.items()}
    return {name: found[0] for name, found in there.items() if found}


def renamed(column: str, names: Mapping[str, str]) -> str:
    """Return a column with the name of its topic replaced by the topic."""
    for name, topic in names.items():
        if column.startswith(f"{name}."):
            return topic + column.removeprefix(name)
    return column


def _renamed(source: Source, names: Mapping[str, str]) -> Source:
    beside = {
        key: {renamed(name, names): value for name, value in getattr(source, key).items()}
        for key in ("where", "plus")
    }
    return source.model_copy(update={"column": renamed(source.column, names), **beside})


def _first(entry: Entry, recording: Recording) -> FoundColumn | None:
    """Return the first choice that the recording has."""
    for source in entry.choices:
        if source.value is not None:
            return FoundColumn(entry, source, None)
        place = locate(source.column, recording)
        if place is not None and all(
            beside(place[0], name) is not None for name in (*source.where, *source.plus)
        ):
            return FoundColumn(entry, source, *place)
    return None


def locate(column: str, recording: Recording) -> tuple[Topic, str] | None:
    """Return the topic and field that a mapping means."""
    for topic in sorted(recording.topics, key=lambda topic: -len(topic.name)):
        is_meant = not topic.name or column.startswith(f"{topic.name}.")
        if is_meant and (field := column_of(topic, column)) is not None:
            return topic, field
    return None


def column_of(topic: Topic, column: str) -> str | None:
    """Return the column of a topic that a mapping means, of numbers or not."""
    there = {**topic.fields, **topic.texts, **topic.faults}
    return next(
        (one for one in (column, column.removeprefix(f"{topic.name}.")) if one in there), None
    )


def beside(topic: Topic, column: str) -> str | None:
    """Return the field of a topic that a condition means; None where it has none such."""
    field = column_of(topic, column)
    return field if field in topic.fields else None


def labels_of(table: Topic, name: str) -> tuple[str, ...] | None:
    """Return a column as labels, one a row."""
    numbers = table.fields.get(name)
    if name in table.texts or numbers is None:
        return table.texts.get(name)
    return tuple(f"{number:.15g}" for number in numbers.tolist())


def _absences(
    entries: Sequence[Entry], recording: Recording, called: str, names: Sequence[str]
) -> Iterator[str]:
    """Name what is absent, topic by topic, and the nearest there is."""
    known = [topic.name for topic in recording.topics]
    topics: dict[str, list[str]] = {}
    for entry in entries:
        takes = f"which {called} takes for `{entry.name}`"
        inside = [
            topic
            for topic in recording.topics
            if not topic.name or entry.column.startswith(f"{topic.name}.")
        ]
        if inside:
            yield _no_field(entry, max(inside, key=lambda topic: len(topic.name)), takes)
        else:
            given = [name for name in names if entry.column.startswith(f"{name}.")]
            topic = max(given, key=len, default=entry.column.partition(".")[0])
            topics.setdefault(topic, []).append(entry.name)
    there = ", ".join(first_few(known, _LISTED, "topics"))
    for name, channels in topics.items():
        yield (
            f"there is no topic `{name}`, which {called} takes for `{' '.join(channels)}`."
            f"{did_you_mean(name, known)} There are: {there or 'none'}."
            f" If it is called otherwise, say so: `topics: {{{name}: ITS NAME}}`"
        )


def _no_field(entry: Entry, topic: Topic, takes: str) -> str:
    field = entry.column.removeprefix(f"{topic.name}.")
    if field in topic.fields:
        needed = [name for source in entry.choices for name in (*source.where, *source.plus)]
        return f"{called(topic)} lacks one of `{' '.join(needed)}` beside `{field}`, {takes}"
    near = did_you_mean(field, (*topic.fields, *topic.texts))
    return f"{called(topic)} has no {'field' if topic.name else 'column'} `{field}`, {takes}.{near}"


def called(topic: Topic) -> str:
    """Return how messages call a topic."""
    return f"topic `{topic.name}`" if topic.name else "the table"

"""Columns of a recording that a mapping selects, and messages on the missing ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.data.channels import UNITS, parse_unit, unit_factor
from hydrodamp.data.plausibility import FULL_TURN
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError, did_you_mean, first_few
from hydrodamp.ingest.clock import COARSE_SHARE
from hydrodamp.ingest.formats.cells import invalid_cells, parse_number
from hydrodamp.ingest.mapping.channel_schema import RECORDED_TIME, Entry, Source
from hydrodamp.ingest.mapping.geodesy import unfold_minutes

# Words found in place of a unit: time scales, frames, sensors, processing.
_NON_UNIT_TEXT = """
- none utc gmt gps tai unix epoch posix local body vehicle base_link frd flu world earth inertial
ned enu nwu map odom sensor dvl imu ins ahrs ekf raw filtered filt est measured meas ref
"""
NON_UNIT_WORDS = frozenset(("", *_NON_UNIT_TEXT.split()))

_MAX_LISTED = 12
_MAX_RADIANS = 1.1 * FULL_TURN  # rounded angles exceed a full turn

#: Alternative topics of each topic name in a mapping.
TopicNames = Mapping[str, Sequence[str]]


@dataclass(frozen=True, eq=False)
class FoundColumn:
    """A channel, its source in the mapping, and the topic and field that hold its samples.

    A constant channel has no topic.
    """

    entry: Entry
    source: Source
    topic: Topic | None
    field: str = ""

    def values(self) -> FloatArray:
        """Return the samples in SI units with sign, scale and offset applied, shape (n,)."""
        source, topic = self.source, self.topic
        if topic is None:
            values = np.array([source.value or 0.0])
        else:
            values = topic.fields[self.field]
            if source.scale != 1.0 or source.offset != 0.0:
                values = values * source.scale + source.offset
            for name, weight in source.plus.items():
                values = values + weight * topic.fields[find_numeric_field(topic, name) or name]
        unit = source.unit or self.stated_unit() or self.entry.default_unit
        if unit == "ddmm":
            values = unfold_minutes(values)
        scale = source.sign * self.entry.sign * (unit_factor(unit) if unit else 1.0)
        if (direction := self._direction()) is not None:
            values = values * (np.cos if source.along == "x" else np.sin)(direction.values())
        return values if scale == 1.0 else values * scale

    def _direction(self) -> FoundColumn | None:
        """Return the column of the angle between the bow and the quantity; None without one."""
        if self.topic is None or self.source.direction is None:
            return None
        source = Source(**self.source.direction.model_dump())
        field = find_numeric_field(self.topic, source.column) or source.column
        return FoundColumn(Entry("", "direction", (source,), "angle"), source, self.topic, field)

    def stated_unit(self) -> str:
        """Return the unit that the file states; empty if the mapping sets one."""
        if self.topic is None or self.entry.quantity is None or self.source.unit:
            return ""
        unit = self.topic.units.get(self.field, "")
        is_unit = unit.casefold() not in NON_UNIT_WORDS
        return parse_unit(unit, self.entry.quantity) or unit if is_unit else ""

    def faults(self) -> Iterator[str]:
        """Yield faults of the field: text cells, unknown units, ambiguous scales."""
        topic, source, column = self.topic, self.source, self.source.column
        if topic is None:
            return
        if self.field in topic.faults:
            yield topic.faults[self.field]
        elif self.field in topic.texts and self.field not in topic.fields:
            texts = [*enumerate(topic.texts[self.field])]
            invalid = [(row, text) for row, text in texts if parse_number(text) is None] or texts
            yield from invalid_cells(column, invalid, topic.lines)
        unit, units = self.stated_unit(), UNITS.get(self.entry.quantity or "", {})
        if unit and unit not in units:
            yield (
                f"column `{column}` is in {unit} by its file, which is no known unit of"
                f" {self.entry.quantity}. Set `unit` in the mapping, or map another column. Known"
                f" units: {', '.join(units)}"
            )
        elif units.get(unit, 1.0) != 1.0 and (source.plus or source.scale != 1 or source.offset):
            yield (
                f"column `{column}` is in {unit} by its file, and the mapping scales it or adds to"
                " it. Set the `unit` of the result"
            )
        if (direction := self._direction()) is not None:
            yield from direction.faults()
            is_stated = direction.source.unit or direction.stated_unit()
            if not is_stated and (np.abs(topic.fields[direction.field]) > _MAX_RADIANS).any():
                yield (
                    f"`direction` must be in rad; the values of column `{direction.source.column}`"
                    " look like degrees. Set its `unit: deg`"
                )


def find_columns(
    entries: Sequence[Entry], recording: Recording, mapping_name: str, topics: TopicNames
) -> tuple[list[FoundColumn], list[str]]:
    """Return the columns found for the entries of a mapping, and the faults of the others."""
    names = resolve_topics(topics, recording)
    columns, missing = [], []
    for entry in entries:
        choices = tuple(_rename_source(source, names) for source in entry.choices)
        renamed = entry._replace(choices=choices)
        if (column := _find_first_choice(renamed, recording)) is not None:
            columns.append(column)
        elif not any(source.optional for source in entry.choices):
            missing.append(renamed)
    faults = [fault for column in columns for fault in column.faults()]
    faults += _describe_missing(missing, recording, mapping_name, [*topics])
    return columns, list(dict.fromkeys(faults))


def resolve_topics(topics: TopicNames, recording: Recording) -> dict[str, str]:
    """Return for each topic name the first alternative that the recording has."""
    known = {topic.name for topic in recording.topics}
    present = {name: [it for it in choices if it in known] for name, choices in topics.items()}
    return {name: candidates[0] for name, candidates in present.items() if candidates}


def rename_topic(column: str, names: Mapping[str, str]) -> str:
    """Replace the topic name of a column by the topic in the recording."""
    for name, topic in names.items():
        if column.startswith(f"{name}."):
            return topic + column.removeprefix(name)
    return column


def _rename_source(source: Source, names: Mapping[str, str]) -> Source:
    renamed_keys: dict[str, Any] = {
        key: {rename_topic(name, names): value for name, value in getattr(source, key).items()}
        for key in ("where", "plus")
    }
    if (angle := source.direction) is not None:
        column = rename_topic(angle.column, names)
        renamed_keys["direction"] = angle.model_copy(update={"column": column})
    return source.model_copy(update={"column": rename_topic(source.column, names), **renamed_keys})


def _find_first_choice(entry: Entry, recording: Recording) -> FoundColumn | None:
    """Return the first choice of an entry that the recording has; None for none."""
    for source in entry.choices:
        if source.value is not None:
            return FoundColumn(entry, source, None)
        if (location := locate_column(source.column, recording)) is not None:
            needed = source.further_columns
            if all(find_numeric_field(location[0], name) is not None for name in needed):
                return FoundColumn(entry, source, *location)
    return None


def locate_column(column: str, recording: Recording) -> tuple[Topic, str] | None:
    """Return topic and field of a column name in a mapping; None if missing."""
    for topic in sorted(recording.topics, key=lambda topic: -len(topic.name)):
        is_candidate = not topic.name or column.startswith(f"{topic.name}.")
        if is_candidate and (field := find_field(topic, column)) is not None:
            return topic, field
    return None


def find_field(topic: Topic, column: str) -> str | None:
    """Return the field of a topic for a column name, with or without the topic prefix."""
    known = {**topic.fields, **topic.texts, **topic.faults}
    names = (column, column.removeprefix(f"{topic.name}."))
    return next((name for name in names if name in known), None)


def find_numeric_field(topic: Topic, column: str) -> str | None:
    """Return the numeric field of a topic for a column name; None if missing."""
    field = find_field(topic, column)
    return field if field in topic.fields else None


def read_labels(table: Topic, name: str) -> tuple[str, ...] | None:
    """Return a column as text labels, one per row."""
    numbers = table.fields.get(name)
    if name in table.texts or numbers is None:
        return table.texts.get(name)
    return tuple(f"{number:.15g}" for number in numbers.tolist())


def _describe_missing(
    entries: Sequence[Entry], recording: Recording, mapping_name: str, names: Sequence[str]
) -> Iterator[str]:
    """Yield a message per missing topic or field, with the nearest name."""
    known = [topic.name for topic in recording.topics]
    topics: dict[str, list[str]] = {}
    for entry in entries:
        purpose = f"which {mapping_name} maps to `{entry.name}`"
        if candidates := [
            topic
            for topic in recording.topics
            if not topic.name or entry.column.startswith(f"{topic.name}.")
        ]:
            longest = max(candidates, key=lambda topic: len(topic.name))
            yield _describe_missing_field(entry, longest, purpose)
        else:
            aliases = [name for name in names if entry.column.startswith(f"{name}.")]
            topic = max(aliases, key=len, default=entry.column.partition(".")[0])
            topics.setdefault(topic, []).append(entry.name)
    listed = ", ".join(first_few(known, _MAX_LISTED, "topics"))
    for name, channels in topics.items():
        yield (
            f"there is no topic `{name}`, which {mapping_name} maps to `{' '.join(channels)}`."
            f"{did_you_mean(name, known)} Topics: {listed or 'none'}."
            f" If it has another name, set `topics: {{{name}: NAME}}`"
        )


def _describe_missing_field(entry: Entry, topic: Topic, purpose: str) -> str:
    field = entry.column.removeprefix(f"{topic.name}.")
    if field in topic.fields:
        needed = [name for source in entry.choices for name in source.further_columns]
        return f"{describe_topic(topic)} lacks one of `{' '.join(needed)}` for `{field}`, {purpose}"
    suggestion = did_you_mean(field, (*topic.fields, *topic.texts))
    kind = "field" if topic.name else "column"
    return f"{describe_topic(topic)} has no {kind} `{field}`, {purpose}.{suggestion}"


def describe_topic(topic: Topic) -> str:
    """Return the name of a topic for messages."""
    return f"topic `{topic.name}`" if topic.name else "the table"


def find_interleaved(columns: Sequence[FoundColumn]) -> dict[str, BoolArray]:
    """Return the valid rows of channels in tables of interleaved topics (few complete rows)."""
    interleaved: dict[str, BoolArray] = {}
    for topic in {id(column.topic): column.topic for column in columns if column.topic}.values():
        by_channel = {column.entry.channel: column for column in columns if column.topic is topic}
        filled = {
            channel: np.isfinite(topic.fields[column.field])
            for channel, column in by_channel.items()
            if np.isfinite(topic.fields.get(column.field, np.empty(0))).any()
        }
        max_count = max((int(rows.sum()) for rows in filled.values()), default=0)
        if filled and 2 * np.logical_and.reduce([*filled.values()]).sum() < max_count:
            interleaved |= filled
    return interleaved


def read_timestamps(topic: Topic, time: Sequence[Source]) -> FloatArray:
    """Return the timestamps of a topic [s]; raise LogError if it has no clock."""
    subject = describe_topic(topic)
    stamps: FloatArray | None = None
    for source in time:
        if source.rate is not None:
            return np.arange(topic.n) / source.rate
        if source.column == RECORDED_TIME and topic.time is not None:
            return topic.time
        if (name := find_field(topic, source.column)) is None:
            continue
        column = FoundColumn(Entry("time", "time", (source,), "time"), source, topic, name)
        if faults := [*column.faults()]:
            raise LogError(faults)
        stamps = column.values()
        if len(stamps) == 0 or np.fmin.reduce(stamps) < np.fmax.reduce(stamps):
            return stamps
    if stamps is not None:  # constant, such as of an unused message header
        return stamps
    columns = [source.column for source in time]
    if columns == [RECORDED_TIME]:
        raise LogError(f"{subject} has no recorded time; set the column of its clock in `time`")
    suggestion = did_you_mean(columns[0], (*topic.fields, *topic.texts))
    alternative = "" if topic.time is None else "; `time: recorded` uses the time of recording"
    raise LogError(f"{subject} has no field `{columns[0]}`, its clock{alternative}.{suggestion}")


def find_new_rows(topic: Topic, stamps: FloatArray) -> BoolArray | None:
    """Return which rows differ from the previous row; None if few timestamps repeat."""
    if 2 * np.count_nonzero(np.diff(stamps) == 0) < len(stamps) * COARSE_SHARE:
        return None
    is_new = np.zeros(len(stamps), np.bool_)
    for values in topic.fields.values():
        is_new[1:] |= np.diff(np.nan_to_num(values)) != 0
    is_new[:1] = True
    return is_new

"""Streams: channels of a recording grouped by their clock, with cleaned timestamps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.conditioning.dropouts import is_invalid_velocity
from hydrodamp.data.recording import Topic
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.ingest.clock import COARSE_SHARE, Clock, Timestamps, clean_timestamps
from hydrodamp.ingest.mapping.columns import (
    FoundColumn,
    describe_topic,
    find_field,
    find_numeric_field,
    read_labels,
)
from hydrodamp.ingest.mapping.schema import RECORDED_TIME, Entry, Source

_MAX_FLOAT = np.finfo(np.float64).max
_LINEAR = tuple(f"velocity.{name}" for name in "uvw")


@dataclass(eq=False)
class Stream:
    """Channels of one topic with the same clock offset (`delay`) and row conditions (`where`).

    ``rows`` selects the rows of the topic; ``stamps`` are the cleaned timestamps of these rows.
    """

    topic: Topic
    clock: Clock
    rows: BoolArray | None
    channels: dict[str, FoundColumn] = field(default_factory=dict)
    stamps: Timestamps = field(init=False)

    def __post_init__(self) -> None:
        """Clean the timestamps."""
        self.stamps = clean_timestamps(self.clock)

    @property
    def has_velocity(self) -> bool:
        """Whether it holds a velocity, so that it may be the reference clock."""
        return any(channel.startswith("velocity.") for channel in self.channels)

    def values(self, channel: str) -> FloatArray:
        """Return the samples of a channel at the cleaned timestamps, in SI units."""
        values = self.channels[channel].values()
        is_outlier = (
            is_invalid_velocity(values, _MAX_FLOAT) if channel in _LINEAR else np.isinf(values)
        )
        if is_outlier.any():
            values = np.where(is_outlier, np.nan, values)
        if self.rows is not None:
            values = values[self.rows]
        return values if len(self.stamps.rows) == len(values) else values[self.stamps.rows]


def build_streams(
    columns: Sequence[FoundColumn], time: Sequence[Source], segment: tuple[Topic, str] | None
) -> tuple[list[Stream], list[str]]:
    """Group channels by clock; return the streams, and the faults of topics without a clock."""
    streams: dict[object, Stream] = {}
    clocks: dict[str, Clock] = {}
    faults: list[str] = []
    interleaved = _find_interleaved([column for column in columns if column.topic is not None])
    for column in columns:
        if column.topic is None:
            continue
        rows = interleaved.get(column.entry.channel)
        row_key = b"" if rows is None else rows.tobytes()
        key = (column.topic.name, row_key, column.source.delay, *column.source.where.items())
        try:
            if column.topic.name not in clocks:
                clocks[column.topic.name] = Clock(
                    column.topic.name, read_timestamps(column.topic, time)
                )
            clock = clocks[column.topic.name]
            streams[key] = streams.get(key) or _make_stream(
                column.topic, column.source, clock, segment, rows
            )
        except LogError as error:
            faults += error.faults
        else:
            streams[key].channels[column.entry.channel] = column
    if faults:
        return [], list(dict.fromkeys(faults))
    return [
        stream
        for stream in streams.values()
        if len(stream.stamps.rows)
        or not all(column.source.optional for column in stream.channels.values())
    ], []


def _find_interleaved(columns: Sequence[FoundColumn]) -> dict[str, BoolArray]:
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


def _make_stream(
    topic: Topic,
    source: Source,
    clock: Clock,
    segment: tuple[Topic, str] | None,
    rows: BoolArray | None = None,
) -> Stream:
    """Return a stream without channels, of the rows that meet the conditions of a source."""
    stamps = clock.time - source.delay
    labels = read_labels(topic, segment[1]) if segment and segment[0] is topic else None
    for name, value in source.where.items():
        flags = topic.fields[find_numeric_field(topic, name) or name]
        matches = (flags != 0) & ~np.isnan(flags) if value is None else flags == value
        rows = matches if rows is None else rows & matches
    run = None
    if rows is not None:
        # Resets are found in all rows, since selected rows may hide them.
        run, stamps = clock.runs[rows], stamps[rows]
        labels = None if labels is None else tuple(np.array(labels, dtype=object)[rows])
    is_new = _find_new_rows(topic, stamps) if rows is None else None
    return Stream(topic, Clock(topic.name, stamps, labels, is_new, run), rows)


def _find_new_rows(topic: Topic, stamps: FloatArray) -> BoolArray | None:
    """Return which rows differ from the previous row; None if few timestamps repeat."""
    if 2 * np.count_nonzero(np.diff(stamps) == 0) < len(stamps) * COARSE_SHARE:
        return None
    is_new = np.zeros(len(stamps), np.bool_)
    for values in topic.fields.values():
        is_new[1:] |= np.diff(np.nan_to_num(values)) != 0
    is_new[:1] = True
    return is_new


def read_timestamps(topic: Topic, time: Sequence[Source]) -> FloatArray:
    """Return the timestamps of a topic [s]; raise LogError if it has no clock."""
    subject = describe_topic(topic)
    constant_stamps: FloatArray | None = None
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
        constant_stamps = stamps  # such as an unused message header
    if constant_stamps is not None:
        return constant_stamps
    columns = [source.column for source in time]
    if columns == [RECORDED_TIME]:
        raise LogError(f"{subject} has no recorded time; set the column of its clock in `time`")
    suggestion = did_you_mean(columns[0], (*topic.fields, *topic.texts))
    alternative = "" if topic.time is None else "; `time: recorded` uses the time of recording"
    raise LogError(f"{subject} has no field `{columns[0]}`, its clock{alternative}.{suggestion}")

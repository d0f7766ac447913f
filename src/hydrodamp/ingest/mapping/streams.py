"""The channels of a mapping by the clocks they stand on, and which stamps those clocks have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.conditioning.dropouts import is_invalid_velocity
from hydrodamp.data.recording import Topic
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.ingest.clock import COARSE, Clock, Stamps, set_right
from hydrodamp.ingest.mapping.columns import FoundColumn, beside, called, column_of, labels_of
from hydrodamp.ingest.mapping.schema import RECORDED, Entry, Source

_LARGEST = np.finfo(np.float64).max
_LINEAR = tuple(f"velocity.{name}" for name in "uvw")


@dataclass(eq=False)
class Stream:
    """Channels of one topic that share their clock: the same delay, the same conditions."""

    topic: Topic
    clock: Clock
    rows: BoolArray | None
    channels: dict[str, FoundColumn] = field(default_factory=dict)
    stamps: Stamps = field(init=False)

    def __post_init__(self) -> None:
        """Set its clock right."""
        self.stamps = set_right(self.clock)

    @property
    def moves(self) -> bool:
        """Whether it holds a velocity, so that its clock may be followed."""
        return any(place.startswith("velocity.") for place in self.channels)

    def values(self, place: str) -> FloatArray:
        """Return the numbers of a channel at the usable messages, in SI units."""
        values = self.channels[place].values()
        lost = is_invalid_velocity(values, _LARGEST) if place in _LINEAR else np.isinf(values)
        if lost.any():
            values = np.where(lost, np.nan, values)
        if self.rows is not None:
            values = values[self.rows]
        return values if len(self.stamps.rows) == len(values) else values[self.stamps.rows]


def streams_of(
    found: Sequence[FoundColumn], time: Sequence[Source], segment: tuple[Topic, str] | None
) -> tuple[list[Stream], list[str]]:
    """Return the channels by the clocks they stand on, and a fault for every topic without one."""
    streams: dict[object, Stream] = {}
    clocks: dict[str, Clock] = {}
    faults: list[str] = []
    apart = _in_turns([one for one in found if one.topic is not None])
    for one in found:
        if one.topic is None:
            continue
        rows = apart.get(one.entry.place)
        own = b"" if rows is None else rows.tobytes()
        key = (one.topic.name, own, one.source.delay, *one.source.where.items())
        try:
            if one.topic.name not in clocks:
                clocks[one.topic.name] = Clock(one.topic.name, stamps_of(one.topic, time))
            clock = clocks[one.topic.name]
            streams[key] = streams.get(key) or _stream(one.topic, one.source, clock, segment, rows)
        except LogError as error:
            faults += error.faults
        else:
            streams[key].channels[one.entry.place] = one
    if faults:
        return [], list(dict.fromkeys(faults))
    return [
        one
        for one in streams.values()
        if len(one.stamps.rows) or not all(it.source.optional for it in one.channels.values())
    ], []


def _in_turns(found: Sequence[FoundColumn]) -> dict[str, BoolArray]:
    """Return the rows of channels of tables where topics take turns: few rows are whole."""
    apart: dict[str, BoolArray] = {}
    for topic in {id(one.topic): one.topic for one in found if one.topic}.values():
        inside = {one.entry.place: one for one in found if one.topic is topic}
        filled = {
            place: np.isfinite(topic.fields[one.field])
            for place, one in inside.items()
            if np.isfinite(topic.fields.get(one.field, np.empty(0))).any()
        }
        most = max((int(rows.sum()) for rows in filled.values()), default=0)
        if filled and 2 * np.logical_and.reduce([*filled.values()]).sum() < most:
            apart |= filled
    return apart


def _stream(
    topic: Topic,
    source: Source,
    clock: Clock,
    segment: tuple[Topic, str] | None,
    rows: BoolArray | None = None,
) -> Stream:
    """Return a stream without channels, with the rows that meet the conditions of a source."""
    stamps = clock.time - source.delay
    labels = labels_of(topic, segment[1]) if segment and segment[0] is topic else None
    for name, wanted in source.where.items():
        flags = topic.fields[beside(topic, name) or name]
        fits = (flags != 0) & ~np.isnan(flags) if wanted is None else flags == wanted
        rows = fits if rows is None else rows & fits
    run = None
    if rows is not None:
        # Of few rows, stamps do not tell where the clock ran anew; those of all rows do.
        run, stamps = clock.runs[rows], stamps[rows]
        labels = None if labels is None else tuple(np.array(labels, dtype=object)[rows])
    fresh = _fresh(topic, stamps) if rows is None else None
    return Stream(topic, Clock(topic.name, stamps, labels, fresh, run), rows)


def _fresh(topic: Topic, stamps: FloatArray) -> BoolArray | None:
    """Return which rows hold other numbers than the one before, if many have its stamp."""
    if 2 * np.count_nonzero(np.diff(stamps) == 0) < len(stamps) * COARSE:
        return None
    fresh = np.zeros(len(stamps), np.bool_)
    for values in topic.fields.values():
        fresh[1:] |= np.diff(np.nan_to_num(values)) != 0
    fresh[:1] = True
    return fresh


def stamps_of(topic: Topic, time: Sequence[Source]) -> FloatArray:
    """Return the stamps of a topic in seconds, or say that it has none."""
    its = called(topic)
    dead: FloatArray | None = None
    for source in time:
        if source.rate is not None:
            return np.arange(topic.n) / source.rate
        if source.column == RECORDED and topic.time is not None:
            return topic.time
        if (name := column_of(topic, source.column)) is None:
            continue
        found = FoundColumn(Entry("time", "time", (source,), "time"), source, topic, name)
        if faults := [*found.faults()]:
            raise LogError(faults)
        stamps = found.values()
        if len(stamps) == 0 or np.fmin.reduce(stamps) < np.fmax.reduce(stamps):
            return stamps
        dead = stamps  # as of a header that nobody fills
    if dead is not None:
        return dead
    columns = [source.column for source in time]
    if columns == [RECORDED]:
        raise LogError(f"{its} has no clock of its own; name its column in `time`")
    near = did_you_mean(columns[0], (*topic.fields, *topic.texts))
    own = "" if topic.time is None else "; `time: recorded` takes when it was recorded"
    raise LogError(f"{its} has no field `{columns[0]}`, its clock{own}.{near}")

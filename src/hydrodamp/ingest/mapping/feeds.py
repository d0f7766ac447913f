"""What a mapping takes from each topic, and the clock it stands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.conditioning.bottom_lock import lost_lock
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.data.units import factor, spelt
from hydrodamp.errors import did_you_mean
from hydrodamp.ingest.clock.stamps import Clock, Stamps, set_right
from hydrodamp.ingest.mapping.entries import RECORDED, Entry
from hydrodamp.ingest.mapping.finding import Found, beside, locate
from hydrodamp.ingest.mapping.plain import labels_of

Key = tuple[str, float, tuple[tuple[str, float | None], ...]]
"""Topic, delay and conditions: what channels of one clock have in common."""


_LINEAR = tuple(f"velocity.{name}" for name in ("u", "v", "w"))


@dataclass(eq=False)
class Feed:
    """Channels of one topic that share their clock."""

    key: Key
    topic: Topic
    clock: Clock
    rows: BoolArray | None
    channels: dict[str, Found] = field(default_factory=dict)

    @property
    def moves(self) -> bool:
        """Whether it holds a velocity, so that its clock may be followed."""
        return any(place.startswith("velocity.") for place in self.channels)

    @property
    def is_optional(self) -> bool:
        """Whether a log may do without it."""
        return all(one.source.optional for one in self.channels.values())

    def values(self, place: str, stamps: Stamps) -> FloatArray:
        """Return the numbers of a channel at the usable messages, in SI units."""
        values = self.channels[place].values()
        if np.isinf(values).any():
            values = np.where(np.isinf(values), np.nan, values)
        if place in _LINEAR:
            values = np.where(lost_lock(values, np.inf), np.nan, values)
        if self.rows is not None:
            values = values[self.rows]
        return values if len(stamps.rows) == len(values) else values[stamps.rows]


@dataclass(frozen=True, eq=False)
class Feeds:
    """All that a mapping takes from a recording."""

    feeds: tuple[Feed, ...]
    stamps: tuple[Stamps, ...]
    constants: tuple[Found, ...]

    def holding(self, place: str) -> int | None:
        """Return the number of the feed that holds a channel."""
        for number, feed in enumerate(self.feeds):
            if place in feed.channels:
                return number
        return None


def feeds_of(
    found: Sequence[Found], time: Entry, segment: str | None, recording: Recording
) -> tuple[Feeds, list[str]]:
    """Return the channels by the clocks they stand on."""
    feeds: dict[Key, Feed] = {}
    faults: list[str] = []
    constants = tuple(one for one in found if one.topic is None)
    for one in found:
        if one.topic is None:
            continue
        key = (one.topic.name, one.source.delay, one.source.where)
        if key not in feeds:
            stamped, wrong = _time(one.topic, time)
            faults += wrong
            if stamped is None:
                continue
            feeds[key] = _feed(key, one.topic, stamped, _labels(one.topic, segment, recording))
        feeds[key].channels[one.place] = one
    if faults:
        return Feeds((), (), constants), list(dict.fromkeys(faults))
    stamps = set_right([feed.clock for feed in feeds.values()])
    kept = [
        (feed, mine)
        for feed, mine in zip(feeds.values(), stamps, strict=True)
        if len(mine.rows) or not feed.is_optional
    ]
    return Feeds(tuple(one for one, _ in kept), tuple(one for _, one in kept), constants), []


def _feed(key: Key, topic: Topic, time: FloatArray, labels: tuple[str, ...] | None) -> Feed:
    """Return the feed of a key, with the rows that meet its conditions."""
    _, delay, conditions = key
    rows: BoolArray | None = None
    for name, wanted in conditions:
        flags = topic.fields[beside(topic, name) or name]
        met = (flags != 0) & ~np.isnan(flags) if wanted is None else flags == wanted
        rows = met if rows is None else rows & met
    if rows is not None:
        time = time[rows]
        labels = None if labels is None else tuple(np.array(labels, dtype=object)[rows])
    return Feed(key, topic, Clock(topic.name, time - delay if delay else time, labels), rows)


def _time(topic: Topic, time: Entry) -> tuple[FloatArray | None, list[str]]:
    """Return the stamps of a topic in seconds, or say that it has none."""
    for source in time.choices:
        name = beside(topic, source.column)
        if name is not None:
            stated = source.unit or spelt(topic.units.get(name, ""))
            values = topic.fields[name] * source.scale + source.offset
            return values * (factor(stated, "time") if stated else 1.0), []
    columns = [source.column for source in time.choices]
    if RECORDED in columns and topic.time is not None:
        return topic.time, []
    if columns == [RECORDED]:
        return None, [f"{_called(topic)} has no clock of its own; name its column in `time`"]
    near = did_you_mean(columns[0], (*topic.fields, *topic.texts))
    own = "" if topic.time is None else "; `time: recorded` takes when it was recorded"
    return None, [f"{_called(topic)} has no field `{columns[0]}`, its clock{own}.{near}"]


def _called(topic: Topic) -> str:
    return f"topic `{topic.name}`" if topic.name else "the table"


def _labels(topic: Topic, segment: str | None, recording: Recording) -> tuple[str, ...] | None:
    """Return the segment of each row, where the column stands in the same topic."""
    place = None if segment is None else locate(segment, recording)
    if place is None or place[0] is not topic:
        return None
    return labels_of(topic, place[1])

"""Synchroniser: samples on one clock from the messages of several topics.

It applies the offline mapping to a buffer of recent messages at intervals, so that samples are
those of a recording, bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError, ProblemError, first_few
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.mapping.assemble import Assembly, build_resampler
from hydrodamp.ingest.mapping.channel_schema import Source
from hydrodamp.ingest.mapping.columns import read_timestamps
from hydrodamp.ingest.mapping.resampling import Stream
from hydrodamp.ingest.mapping.schema import Clock
from hydrodamp.live.samples import Row

UPDATE_INTERVAL = 0.2  # s, between two runs of the mapping; by choice
MAX_DELAY = 1.0  # s, that a sample waits for a late topic; by choice
DROPOUT_TIME = 10.0  # s, after which a silent topic is absent; by choice
REPORT_DELAY = 3.0  # s without a sample, after which the reason is reported; by choice
HISTORY_LENGTH = 30  # messages of a topic before the last sample, for interpolation
MAX_UNUSED_TOPICS, MAX_LISTED_TOPICS = 1000, 12  # that are remembered, and reported
MAX_MESSAGES = 20_000  # of a topic in the buffer
UNUSED_KEYS = ("position", "specific_force", "acceleration", "segment")  # by live estimators
NO_UNITS: Mapping[str, str] = MappingProxyType({})


class Message(NamedTuple):
    """Numbers of one topic at one time; no fields for one that cannot be read."""

    topic: str
    received: float  # s
    fields: Mapping[str, float]
    units: Mapping[str, str] = NO_UNITS


def stream_mapping(mapping: LogMapping, on_message: Callable[[str], None]) -> LogMapping:
    """Return a mapping without what a stream does not need; refuse one that needs a whole log."""
    if mapping.steps:
        raise ProblemError(
            f"the steps of `--mapping {mapping.name}` need a whole log, and a stream has none."
            " Write a mapping that `extends` this one and has `steps: []`."
        )
    if mapping.clock.rate is not None:
        on_message(f"`clock: {{rate: {mapping.clock.rate:g}}}` is ignored: live uses each sample.")
    if any(source.rate for source in mapping.time):
        raise ProblemError(
            f"`time` of `--mapping {mapping.name}` counts rows, and a stream may lose some: name"
            " the field of the time, or `recorded`."
        )
    clock = Clock(topic=mapping.clock.topic)
    return mapping.model_copy(update={**dict.fromkeys(UNUSED_KEYS), "clock": clock})


@dataclass(eq=False)
class TopicBuffer:
    """Recent messages of one topic, and their times."""

    fields: frozenset[str]
    is_held: bool  # sample and hold: the last value counts without limit
    messages: list[Message] = field(default_factory=list)
    time: FloatArray = field(default_factory=lambda: np.empty(0))

    def topic(self) -> Topic:
        """Return the messages as a topic of a recording."""
        name, rows = self.messages[0].topic, [message.fields for message in self.messages]
        present = [key for key in self.fields if any(key in row for row in rows)]
        columns = {key: np.array([row.get(key, np.nan) for row in rows]) for key in present}
        units = {key: unit for key, unit in self.messages[0].units.items() if key in columns}
        received = np.array([message.received for message in self.messages])
        return Topic(name, received if name else None, columns, units=units)

    @property
    def last(self) -> float:
        """Time of the last message, by its own clock [s]."""
        return float(self.time[-1])

    def is_present(self, now: float) -> bool:
        """Return whether the topic has no dropout, or is held."""
        return self.is_held or self.last > now - DROPOUT_TIME

    def discard_before(self, time: float) -> None:
        """Discard messages that later samples do not need."""
        n = int(np.searchsorted(self.time, time, side="right"))
        del self.messages[: max(0, n - HISTORY_LENGTH)]


@dataclass
class MessageSynchroniser:
    """Buffers of all topics that a mapping uses, and the samples made from them."""

    mapping: LogMapping
    on_message: Callable[[str], None]
    n_discarded: int = 0  # repeated, late or surplus messages
    _buffers: dict[str, TopicBuffer] = field(default_factory=dict)
    _unused_topics: dict[str, None] = field(default_factory=dict)
    _latest: TopicBuffer | None = None  # of the last message
    _sample_time: float = -math.inf  # of the last sample
    _now: float = math.nan  # by the clock of the receiver, as all below
    _next_update: float = math.nan
    _last_update: float = math.nan  # of a sample
    _is_reported: bool = False  # why there is no sample

    def synchronise(self, messages: Iterable[Message | None]) -> Iterator[Row | None]:
        """Yield samples, None for an interval without messages, and unreadable messages as {}."""
        for message in messages:
            if message is None:
                yield from self._make_samples(MAX_DELAY)
                yield None
            elif not message.fields:
                yield {}
            else:
                self._add(message)
                if not self._next_update - UPDATE_INTERVAL <= self._now < self._next_update:
                    self._next_update = self._now + UPDATE_INTERVAL  # also after a clock set back
                    yield from self._make_samples(MAX_DELAY)
        self._now = math.inf
        yield from self._make_samples(0.0)

    def _add(self, message: Message) -> None:
        topic, self._now = message.topic, message.received
        if math.isnan(self._last_update):
            self._last_update = self._now
        buffer = self._buffers.get(topic)
        if buffer is None:
            if topic in self._unused_topics or (buffer := self._make_buffer(topic)) is None:
                if len(self._unused_topics) < MAX_UNUSED_TOPICS:
                    self._unused_topics[topic] = None
                return
            self._buffers[topic] = buffer
        fields = {name: value for name, value in message.fields.items() if name in buffer.fields}
        buffer.messages.append(message._replace(fields=fields))
        self._latest = buffer
        if len(buffer.messages) > MAX_MESSAGES:
            self.n_discarded += MAX_MESSAGES // 2
            del buffer.messages[: MAX_MESSAGES // 2]

    def accepts(self, topic: str) -> bool:
        """Return whether the mapping uses a field of a topic."""
        return self._make_buffer(topic) is not None

    def _make_buffer(self, topic: str) -> TopicBuffer | None:
        """Return a buffer for a topic; None where the mapping uses none of its fields."""
        names = (name for name, aliases in self.mapping.topics.items() if topic in aliases)
        prefixes = tuple(f"{name}." for name in (topic, *names)) if topic else ("",)
        sources = [
            source
            for entry in self.mapping.entries
            for source in entry.choices
            if source.column.startswith(prefixes)
        ]
        if not sources:
            return None
        columns = {name for each in (*sources, *self.mapping.time) for name in _columns(each)}
        fields = (
            name.removeprefix(next(filter(name.startswith, prefixes), "")) for name in columns
        )
        return TopicBuffer(frozenset(fields), all(source.hold for source in sources))

    def _make_samples(self, max_delay: float) -> list[Row]:
        """Return new samples, and discard messages that later ones do not need."""
        try:
            sampler = build_resampler(self.mapping, self._recording())
            assembly = Assembly(self.mapping, sampler)
            if assembly.faults:
                raise LogError(assembly.faults)
            time, end = sampler.ticks.time, _ready_time(sampler.streams, max_delay)
        except LogError as error:
            self._report(str(error))
            return []
        except Exception as error:  # bad messages must not end the run
            self.n_discarded += sum(len(buffer.messages) for buffer in self._buffers.values())
            self._buffers.clear()
            self._report(f"{type(error).__name__}: {error}")
            return []
        is_ready = (time > self._sample_time) & (time <= end)
        if not is_ready.any():
            return []
        self._sample_time, self._last_update = float(time[is_ready][-1]), self._now
        self._is_reported = False
        buffers = self._nonempty()
        present = [buffer.last for buffer in buffers if buffer.is_present(self._sample_time)]
        for buffer in buffers:
            buffer.discard_before(min([self._sample_time, *present]))
        rows = zip(
            *(values[is_ready].tolist() for values in assembly.numbers.values()), strict=True
        )
        return [dict(zip(assembly.numbers, row, strict=True)) for row in rows]

    def _nonempty(self) -> list[TopicBuffer]:
        return [buffer for buffer in self._buffers.values() if buffer.messages]

    def _recording(self) -> Recording:
        """Return the topics without a dropout, each in the order of its clock."""
        topics = {buffer: self._sort(buffer) for buffer in self._nonempty()}
        buffers = self._nonempty()
        if not buffers:
            return Recording((), "the stream", "stream")
        now = (self._latest if self._latest in buffers else buffers[-1]).last
        if self._sample_time > now + DROPOUT_TIME:  # the clock was set back
            self._sample_time = -math.inf
        for buffer in buffers:
            if buffer.last > now + DROPOUT_TIME:
                buffer.messages = []
        recent = [topics[each] for each in buffers if each.messages and each.is_present(now)]
        return Recording(tuple(recent), "the stream", "stream")

    def _sort(self, buffer: TopicBuffer) -> Topic:
        """Discard repeated and late messages, and those before the clock was set back."""
        topic = buffer.topic()
        stamps = read_timestamps(topic, self.mapping.time)
        set_back = np.flatnonzero(np.diff(stamps) < -DROPOUT_TIME)
        first = int(set_back[-1]) + 1 if len(set_back) else 0
        latest = np.fmax.accumulate(np.append(-np.inf, stamps[first:]))
        rows = first + np.flatnonzero(stamps[first:] > latest[:-1])
        buffer.time = stamps[rows]
        if len(rows) < topic.n:
            self.n_discarded += topic.n - first - len(rows)
            buffer.messages = [buffer.messages[row] for row in rows.tolist()]
        return topic if len(rows) in (0, topic.n) else buffer.topic()

    def _report(self, reason: str) -> None:
        """Report why there is no sample, once per dropout."""
        if self._now - self._last_update > REPORT_DELAY and not self._is_reported:
            self._is_reported = True
            unused = ", ".join(first_few([*self._unused_topics], MAX_LISTED_TOPICS, "topics"))
            suffix = f" Unused topics: {unused}." if unused else ""
            self.on_message(f"the messages give no sample: {reason.rstrip('.')}.{suffix}")


def _columns(source: Source) -> Iterator[str]:
    yield from (source.column, *source.further_columns)


def _ready_time(streams: Sequence[Stream], max_delay: float) -> float:
    """Return the time up to which every topic has spoken, or is late by ``max_delay``."""
    required = [
        stream
        for stream in streams
        if not all(channel.source.hold for channel in stream.channels.values())
    ]
    last = [float(stream.stamps.time[-1]) for stream in required or streams]
    return max(min(last), max(last) - max_delay)

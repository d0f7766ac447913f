"""From messages of several topics to samples, by the mapping that serves a recording of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.record import first_few
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError, ProblemError
from hydrodamp.ingest.mapping import LogMapping
from hydrodamp.ingest.mapping.assemble import Assembly, build_resampler
from hydrodamp.ingest.mapping.columns import read_timestamps
from hydrodamp.ingest.mapping.resampling import Stream
from hydrodamp.ingest.mapping.schema import Clock, Source
from hydrodamp.live.samples import Row

_EACH = 0.2  # s, between two makings of samples
_PATIENCE = 1.0  # s, that a sample waits for a topic that is late
_SILENT = 10.0  # s, after which a topic is as good as absent
_UNTOLD = 3.0  # s without a sample, after which the reason is told
_HISTORY = 30  # messages of a topic that are kept behind the last sample
_NAMES, _LISTED = 1000, 12  # topics of which nothing is taken that are remembered, and told
_ROOM = 20_000  # messages of a topic that may wait
_UNUSED = ("position", "specific_force", "acceleration", "segment")  # by what runs on board
_NOTHING: Mapping[str, str] = MappingProxyType({})


class Message(NamedTuple):
    """What one topic says at one moment: numbers as they stand there; none is junk."""

    topic: str
    received: float  # s
    fields: Mapping[str, float]
    units: Mapping[str, str] = _NOTHING


def for_streams(mapping: LogMapping, say: Callable[[str], None]) -> LogMapping:
    """Return what counts of a mapping on board; refuse one that needs the whole log."""
    if mapping.steps:
        raise ProblemError(
            f"the steps of `--mapping {mapping.name}` work on a whole log, and a stream has none."
            " Write a mapping without them, that `extends` this one and says `steps: []`."
        )
    if mapping.clock.rate is not None:
        say(f"`clock: {{rate: {mapping.clock.rate:g}}}` thins a log; on board each sample counts.")
    if any(one.rate for one in mapping.time):
        raise ProblemError(
            f"`time` of `--mapping {mapping.name}` counts rows, and a stream may lose some: name"
            " the field that tells the time, or say `recorded`."
        )
    clock = Clock(topic=mapping.clock.topic)
    return mapping.model_copy(update={**dict.fromkeys(_UNUSED), "clock": clock})


@dataclass(eq=False)
class _TopicBuffer:
    """The messages of one topic that still count, and their times."""

    fields: frozenset[str]
    holds: bool  # what it said last, however long
    messages: list[Message] = field(default_factory=list)
    time: FloatArray = field(default_factory=lambda: np.empty(0))

    def topic(self) -> Topic:
        """Return the messages as a topic."""
        name, said = self.messages[0].topic, [message.fields for message in self.messages]
        there = [key for key in self.fields if any(key in one for one in said)]
        columns = {key: np.array([one.get(key, np.nan) for one in said]) for key in there}
        units = {key: unit for key, unit in self.messages[0].units.items() if key in columns}
        received = np.array([message.received for message in self.messages])
        return Topic(name, received if name else None, columns, units=units)

    @property
    def last(self) -> float:
        """When it spoke last, by its own clock [s]."""
        return float(self.time[-1])

    def speaks(self, now: float) -> bool:
        """Return whether it spoke lately, or has no need to."""
        return self.holds or self.last > now - _SILENT

    def forget(self, before: float) -> None:
        """Forget what is no longer needed once there are samples up to a time."""
        behind = int(np.searchsorted(self.time, before, side="right"))
        del self.messages[: max(0, behind - _HISTORY)]


@dataclass
class MessageSynchroniser:
    """Messages that samples are made of, once every topic has spoken past them.

    They are brought to one clock by what does so with a recording, so the numbers are the same.
    """

    mapping: LogMapping
    say: Callable[[str], None]
    passed_over: int = 0  # messages that came twice, late, or too many to wait
    _heard: dict[str, _TopicBuffer] = field(default_factory=dict)
    _others: dict[str, None] = field(default_factory=dict)  # topics of which nothing is taken
    _latest: _TopicBuffer | None = None  # who spoke last
    _made: float = -math.inf  # time of the last sample
    _now: float = math.nan  # by the clock of the receiver, as all of these
    _due: float = math.nan  # when samples are made again
    _since: float = math.nan  # when the last one was made
    _is_told: bool = False  # why there is none since then

    def over(self, messages: Iterable[Message | None]) -> Iterator[Row | None]:
        """Yield samples, and None where there was nothing for a while; junk passes through."""
        for message in messages:
            if message is None:
                yield from self._samples(_PATIENCE)
                yield None
            elif not message.fields:
                yield {}
            else:
                self._keep(message)
                if not self._due - _EACH <= self._now < self._due:  # it may be set back
                    self._due = self._now + _EACH
                    yield from self._samples(_PATIENCE)
        self._now = math.inf
        yield from self._samples(0.0)

    def _keep(self, message: Message) -> None:
        topic, self._now = message.topic, message.received
        if math.isnan(self._since):
            self._since = self._now
        heard = self._heard.get(topic)
        if heard is None:
            if topic in self._others or (heard := self._wanted(topic)) is None:
                if len(self._others) < _NAMES:
                    self._others[topic] = None
                return
            self._heard[topic] = heard
        fields = {name: one for name, one in message.fields.items() if name in heard.fields}
        heard.messages.append(message._replace(fields=fields))
        self._latest = heard
        if len(heard.messages) > _ROOM:
            self.passed_over += _ROOM // 2
            del heard.messages[: _ROOM // 2]

    def wants(self, topic: str) -> bool:
        """Return whether the mapping takes something of a topic."""
        return self._wanted(topic) is not None

    def _wanted(self, topic: str) -> _TopicBuffer | None:
        """Return the place for a topic, where the mapping takes something of it."""
        names = (name for name, those in self.mapping.topics.items() if topic in those)
        called = tuple(f"{name}." for name in (topic, *names)) if topic else ("",)
        sources = [source for one in self.mapping.entries for source in one.choices]
        own = [source for source in sources if source.column.startswith(called)]
        if not own:
            return None
        columns = {name for one in (*own, *self.mapping.time) for name in _columns(one)}
        whole = [next(filter(name.startswith, called), "") for name in columns]
        fields = [name.removeprefix(start) for name, start in zip(columns, whole, strict=True)]
        return _TopicBuffer(frozenset(fields), all(source.hold for source in own))

    def _samples(self, patience: float) -> list[Row]:
        """Return the samples that can be made; forget messages that raise an error."""
        try:
            return [*self._made_of_messages(patience)]
        except Exception as error:  # whatever messages say, the next ones may do
            self.passed_over += sum(len(one.messages) for one in self._heard.values())
            self._heard.clear()
            self._tell(f"{type(error).__name__}: {error}")
            return []

    def _made_of_messages(self, patience: float) -> Iterator[Row]:
        """Yield the samples that can be made, and forget what they were made of."""
        try:
            sampler = build_resampler(self.mapping, self._recording())
            made = Assembly(self.mapping, sampler)
            if made.faults:
                raise LogError(made.faults)
        except LogError as error:
            self._tell(str(error))
            return
        time = sampler.ticks.time
        ready = (time > self._made) & (time <= _until(sampler.streams, patience))
        if not ready.any():
            return
        columns = {name: values[ready].tolist() for name, values in made.numbers.items()}
        for values in zip(*columns.values(), strict=True):
            yield dict(zip(columns, values, strict=True))
        self._made, self._since, self._is_told = float(time[ready][-1]), self._now, False
        heard = [one for one in self._heard.values() if one.messages]
        begun = min([self._made, *(one.last for one in heard if one.speaks(self._made))])
        for one in heard:
            one.forget(begun)

    def _recording(self) -> Recording:
        """Return what was heard lately, each topic in the order of its clock."""
        heard = [one for one in self._heard.values() if one.messages]
        topics = {one: self._in_order(one) for one in heard}
        heard = [one for one in heard if one.messages]
        if not heard:
            return Recording((), "the stream", "stream")
        now = next((one.last for one in heard if one is self._latest), heard[-1].last)
        if self._made > now + _SILENT:  # the clock was set back
            self._made = -math.inf
        for one in heard:
            if one.last > now + _SILENT:
                one.messages = []
        lately = [topics[one] for one in heard if one.messages and one.speaks(now)]
        return Recording(tuple(lately), "the stream", "stream")

    def _in_order(self, one: _TopicBuffer) -> Topic:
        """Return a topic without what came twice or late, or before its clock was set back."""
        topic = one.topic()
        stamps = read_timestamps(topic, self.mapping.time)
        back = np.flatnonzero(np.diff(stamps) < -_SILENT)
        begun = int(back[-1]) + 1 if len(back) else 0
        latest = np.fmax.accumulate(np.append(-np.inf, stamps[begun:]))
        rows = begun + np.flatnonzero(stamps[begun:] > latest[:-1])
        one.time = stamps[rows]
        if len(rows) < topic.n:
            self.passed_over += topic.n - begun - len(rows)
            one.messages = [one.messages[row] for row in rows.tolist()]
        return topic if len(rows) in (0, topic.n) else one.topic()

    def _tell(self, reason: str) -> None:
        """Say why there is no sample, once it lasts."""
        if self._now - self._since > _UNTOLD and not self._is_told:
            self._is_told = True
            others = ", ".join(first_few([*self._others], _LISTED, "topics"))
            also = f" Heard besides: {others}." if others else ""
            why = reason.rstrip(".")
            self.say(f"no sample can be made of what is heard: {why}.{also}")


def _columns(source: Source) -> Iterator[str]:
    yield from (source.column, *source.where, *source.plus)


def _until(streams: Sequence[Stream], patience: float) -> float:
    """Return the time that every topic has spoken past, or has had the time to."""
    waited_for = [one for one in streams if not all(it.source.hold for it in one.channels.values())]
    spoken = [float(one.stamps.time[-1]) for one in waited_for or streams]
    return max(min(spoken), max(spoken) - patience)

"""The channels of all topics, their clocks set right, at the ticks of one clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.ingest.clock import (
    Brackets,
    Ticks,
    at_rate,
    brackets,
    held,
    interpolated,
    matched,
    turned,
)
from hydrodamp.ingest.irregularity import Irregularity, Oddity
from hydrodamp.ingest.mapping.columns import FoundColumn, called
from hydrodamp.ingest.mapping.streams import Stream


class Sampler:
    """Gives the channels at the ticks of one clock."""

    def __init__(
        self,
        found: Sequence[FoundColumn],
        streams: Sequence[Stream],
        topic: str | None,
        rate: float | None,
    ) -> None:
        self.streams = streams
        self.base = base = _followed(streams, topic)
        self.is_even = rate is not None
        plain = Ticks(base.stamps.time, base.stamps.run)
        self.ticks = plain if rate is None else at_rate(base.stamps, rate)
        if faults := [*_strangers(streams, base)]:
            raise LogError(faults)
        self.irregularities = list(
            dict.fromkeys(one for stream in streams for one in stream.stamps.irregularities)
        )
        for stream in streams:
            stream.stamps = matched(stream.stamps, base.stamps)
        self.constants = {
            one.entry.place: float(one.values()[0]) for one in found if one.topic is None
        }
        self._of = {place: stream for stream in streams for place in stream.channels}
        self._found: dict[tuple[int, bytes], Brackets] = {}

    @property
    def n(self) -> int:
        """The number of ticks."""
        return len(self.ticks.time)

    def has(self, place: str) -> bool:
        """Return whether there is a channel of this ``group.name``."""
        return place in self._of or place in self.constants

    def labels(self) -> tuple[str, ...] | None:
        """Return the label of each tick; None where no column names the segments."""
        if self.base.clock.labels is None:
            return None
        stamps = self.base.stamps
        at = brackets(stamps, self.ticks).before if self.is_even else slice(None)
        return tuple(np.array(self.base.clock.labels, dtype=object)[stamps.rows][at].tolist())

    def lines(self) -> Sequence[int] | None:
        """Return the line of the file of each tick; None where it has none."""
        lines, rows = self.base.topic.lines, self.base.stamps.rows
        if self.is_even or not len(lines) or self.base.rows is not None:
            return None
        return lines if len(rows) == len(lines) else [lines[row] for row in rows.tolist()]

    def is_direct(self, place: str) -> bool:
        """Return whether a channel stands on the clock that is followed."""
        return self._of.get(place) is self.base and not self.is_even

    def together(self, places: Sequence[str]) -> bool:
        """Return whether channels stand in one topic, on one clock."""
        streams = [self._of.get(place) for place in places]
        return streams[0] is not None and all(one is streams[0] for one in streams)

    def number(self, place: str, *, is_command: bool = False) -> FloatArray:
        """Return a channel at the ticks, shape (n,); NaN where it is not known."""
        stream = self._of.get(place)
        if stream is None:
            return np.full(self.n, self.constants[place])
        values, hold = stream.values(place), stream.channels[place].source.hold
        if self.is_direct(place):
            return _filled(values, self.ticks.run) if hold else values
        if hold or (is_command and hold is None):
            return self._brought(values, place, partial(held, until_next=hold is True))
        return self._brought(values, place, interpolated)

    def angle(self, place: str) -> FloatArray:
        """Return an angle at the ticks, shape (n,), interpolated the shorter way round."""
        if place in self.constants or self.is_direct(place):
            return self.number(place)
        return self._brought(
            self.raw(place), place, lambda angle, found: interpolated(np.unwrap(angle), found)
        )

    def raw(self, place: str) -> FloatArray:
        """Return a channel at the messages of its topic."""
        stream = self._of.get(place)
        return np.array([self.constants[place]]) if stream is None else stream.values(place)

    def turned(self, quaternions: FloatArray, place: str) -> FloatArray:
        """Return attitudes at the ticks, shape (n, 4)."""
        if place in self.constants or self.is_direct(place):
            return quaternions
        norm = np.sqrt(np.einsum("ni,ni->n", quaternions, quaternions))
        # An estimator that has not started sends zeros.
        unit = quaternions / np.where(norm > 0.5, norm, np.nan)[:, np.newaxis]
        return self._brought(unit, place, turned)

    def _brought(
        self, values: FloatArray, place: str, way: Callable[[FloatArray, Brackets], FloatArray]
    ) -> FloatArray:
        """Bring what is a number among values of a topic to the ticks; say which are none."""
        stream, known = self._of[place], np.isfinite(values if values.ndim == 1 else values[:, 0])
        if not known.any():
            return np.full((self.n, *values.shape[1:]), np.nan)
        is_whole = bool(known.all())
        key = (id(stream), b"" if is_whole else known.tobytes())
        if key not in self._found:
            stamps, name = stream.stamps, stream.topic.name
            if not is_whole:
                what = place.partition(".")[2] if values.ndim == 1 else "attitude"
                first, count = float(stamps.time[np.argmin(known)]), int(np.sum(~known))
                odd = Irregularity(name, Oddity.EMPTY, count, first, what=what)
                self.irregularities.append(odd)
            self._found[key] = brackets(stamps.kept(known), self.ticks)
        return way(values if is_whole else values[known], self._found[key])


def _followed(streams: Sequence[Stream], topic: str | None) -> Stream:
    """Return the stream whose clock is followed."""
    choice = [one for one in streams if one.moves] or list(streams)
    if topic is not None:
        named = [one for one in streams if one.topic.name == topic]
        choice = [one for one in named if one.moves] or named
    if not choice:
        names = dict.fromkeys(one.topic.name for one in streams)
        raise LogError(
            f"`clock` names the topic `{topic}`, of which the mapping takes nothing."
            f"{did_you_mean(topic or '', names)} It takes: {', '.join(names)}"
        )
    base = min(choice, key=lambda one: one.stamps.step or np.inf)
    if (count := len(base.stamps.rows)) < 2:
        held = "one message" if count == 1 else "no message"
        raise LogError(
            f"{called(base.topic)} has {held} with a time in order; at least two are needed"
        )
    return base


def _strangers(streams: Sequence[Stream], base: Stream) -> Iterator[str]:
    """Name topics without a message, or with no time in common with the one that is followed."""
    followed = base.stamps.time
    for stream in streams:
        time, name = stream.stamps.time, stream.topic.name
        if not len(time):
            yield f"topic `{name}` has no message with a time; set its channels to null"
            continue
        until_next = all(one.source.hold for one in stream.channels.values())
        late = time.min() > followed.max()
        if late or (time.max() < followed.min() and not until_next):
            yield (
                f"the clock of `{name}` runs {_span(stream)} and that of"
                f" `{base.topic.name}` {_span(base)}: they have nothing in common. Choose another"
                " `time`, or set the channels of one to null"
            )


def _span(stream: Stream) -> str:
    time = stream.clock.time[np.isfinite(stream.clock.time)]
    return f"from {time.min():.3f} s to {time.max():.3f} s"


def _filled(values: FloatArray, run: IntArray) -> FloatArray:
    """Fill NaN with the last value before it in its run."""
    begun = np.searchsorted(run, run)
    last = np.maximum.accumulate(np.where(np.isnan(values), begun, np.arange(len(values))))
    return values[last]

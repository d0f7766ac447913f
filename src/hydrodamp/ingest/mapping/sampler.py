"""The channels of all topics at the ticks of one clock."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.ingest.clock.base import at_rate, fastest, matched
from hydrodamp.ingest.clock.met import Met, Oddity
from hydrodamp.ingest.clock.sampling import (
    Brackets,
    Ticks,
    brackets,
    held,
    interpolated,
    parts_of,
    turned,
)
from hydrodamp.ingest.clock.stamps import Stamps
from hydrodamp.ingest.mapping.feeds import Feed, Feeds

_TURN = 2 * np.pi


class Sampler:
    """Gives the channels of feeds at the ticks of one clock."""

    def __init__(self, feeds: Feeds, topic: str | None = None, rate: float | None = None) -> None:
        self.feeds = feeds
        self.base = _base(feeds, topic)
        self.base_stamps = feeds.stamps[self.base]
        self.is_even = rate is not None
        self.ticks = (
            Ticks(self.base_stamps.time, self.base_stamps.run)
            if rate is None
            else at_rate(self.base_stamps, rate)
        )
        if faults := [*_strangers(feeds, self.base)]:
            raise LogError(faults)
        self.met = list(dict.fromkeys(one for stamps in feeds.stamps for one in stamps.met))
        self._found: dict[tuple[int, bytes], Brackets] = {}

    @property
    def n(self) -> int:
        """The number of ticks."""
        return len(self.ticks.time)

    def has(self, place: str) -> bool:
        """Tell whether there is a channel of this ``group.name``."""
        return self.feeds.holding(place) is not None or place in self._constants()

    def _constants(self) -> dict[str, float]:
        return {one.place: float(one.values()[0]) for one in self.feeds.constants}

    def labels(self, stem: str) -> tuple[str, ...] | None:
        """Return the segment of each tick; None where there is one run without a name."""
        labels, stamps = self.feeds.feeds[self.base].clock.labels, self.base_stamps
        run = self.ticks.run
        if labels is None and len(parts_of(run)) == 1:
            return None
        named = np.full(self.n, stem, dtype=object)
        if labels is not None:
            at = brackets(stamps, self.ticks).before if self.is_even else np.arange(self.n)
            named = np.array(labels, dtype=object)[stamps.rows][at]
        changes = (named[1:] != named[:-1]) | (run[1:] != run[:-1])
        starts = np.append(0, np.flatnonzero(changes) + 1)
        names = named[starts].tolist()
        told = [
            f"{name}.{names[: place + 1].count(name)}"
            if name in _neighbours(names, place)
            else name
            for place, name in enumerate(names)
        ]
        return tuple(np.repeat(np.array(told, dtype=object), np.diff(np.append(starts, self.n))))

    def lines(self) -> Sequence[int] | None:
        """Return the line of the file of each tick; None where it has none."""
        feed = self.feeds.feeds[self.base]
        if self.is_even or not len(feed.topic.lines) or feed.rows is not None:
            return None
        rows = self.base_stamps.rows
        lines = feed.topic.lines
        return lines if len(rows) == len(lines) else [lines[row] for row in rows.tolist()]

    def is_direct(self, place: str) -> bool:
        """Tell whether a channel stands on the clock that is followed."""
        return self.feeds.holding(place) == self.base and not self.is_even

    def together(self, places: Sequence[str]) -> bool:
        """Tell whether channels stand in one topic, on one clock."""
        return len({self.feeds.holding(place) for place in places}) == 1 and (
            self.feeds.holding(places[0]) is not None
        )

    def number(self, place: str, *, is_command: bool = False) -> FloatArray:
        """Return a channel at the ticks, shape (n,); NaN where it is not known."""
        number = self.feeds.holding(place)
        if number is None:
            return np.full(self.n, self._constants()[place])
        feed, stamps = self.feeds.feeds[number], self.feeds.stamps[number]
        values, hold = feed.values(place, stamps), feed.channels[place].source.hold
        if self.is_direct(place):
            return _filled(values) if hold else values
        found, values = self._sound(number, values, place)
        if hold or (is_command and hold is None):
            return held(values, found, until_next=hold is True)
        return interpolated(values, found)

    def angle(self, place: str) -> FloatArray:
        """Return an angle at the ticks, shape (n,), interpolated the shorter way round."""
        number = self.feeds.holding(place)
        if number is None or self.is_direct(place):
            return self.number(place)
        values = self.feeds.feeds[number].values(place, self.feeds.stamps[number])
        found, values = self._sound(number, values, place)
        return interpolated(np.unwrap(values), found)

    def raw(self, place: str) -> FloatArray:
        """Return a channel at the messages of its topic."""
        number = self.feeds.holding(place)
        if number is None:
            return np.array([self._constants()[place]])
        return self.feeds.feeds[number].values(place, self.feeds.stamps[number])

    def turned(self, quaternions: FloatArray, place: str) -> FloatArray:
        """Return attitudes at the ticks, shape (n, 4)."""
        number = self.feeds.holding(place)
        if number is None or self.is_direct(place):
            return quaternions
        norm = np.sqrt(np.einsum("ni,ni->n", quaternions, quaternions))
        # An estimator that has not started sends zeros.
        sound = np.isfinite(norm) & (norm > 0.5)
        found = self._brackets(number, sound, "attitude")
        unit = quaternions if sound.all() else quaternions[sound]
        return turned(unit / norm[sound][:, np.newaxis], found)

    def _sound(self, number: int, values: FloatArray, place: str) -> tuple[Brackets, FloatArray]:
        """Return the values that are numbers and where the ticks lie among them."""
        sound = np.isfinite(values)
        found = self._brackets(number, sound, place.partition(".")[2])
        return found, values if sound.all() else values[sound]

    def _brackets(self, number: int, sound: BoolArray, what: str) -> Brackets:
        key = (number, b"" if sound.all() else sound.tobytes())
        if key not in self._found:
            stamps = matched(self.feeds.stamps[number], self.base_stamps)
            if key[1]:
                stamps = self._without(stamps, sound, self.feeds.feeds[number], what)
            self._found[key] = brackets(stamps, self.ticks)
        return self._found[key]

    def _without(self, stamps: Stamps, sound: BoolArray, feed: Feed, what: str) -> Stamps:
        """Drop the messages without a number, and say so."""
        first = float(stamps.time[int(np.argmin(sound))])
        count = int(np.count_nonzero(~sound))
        self.met.append(Met(feed.topic.name, Oddity.EMPTY, count, first, what=what))
        return dataclasses.replace(
            stamps, rows=stamps.rows[sound], time=stamps.time[sound], run=stamps.run[sound]
        )


def _base(feeds: Feeds, topic: str | None) -> int:
    """Return the number of the feed whose clock is followed."""
    names = [feed.topic.name for feed in feeds.feeds]
    moving = [number for number, feed in enumerate(feeds.feeds) if feed.moves]
    choice = moving or list(range(len(names)))
    if topic is not None:
        choice = [number for number, name in enumerate(names) if name == topic]
        choice = [number for number in choice if number in moving] or choice
    if not choice:
        raise LogError(
            f"`clock` names the topic `{topic}`, of which the mapping takes nothing."
            f"{did_you_mean(topic or '', names)} It takes: {', '.join(dict.fromkeys(names))}"
        )
    base = fastest({number: feeds.stamps[number] for number in choice})
    if (count := len(feeds.stamps[base].rows)) < 2:
        called = f"topic `{names[base]}`" if names[base] else "the table"
        held = "one message" if count == 1 else "no message"
        raise LogError(f"{called} has {held} with a time in order; at least two are needed")
    return base


def _strangers(feeds: Feeds, base: int) -> Iterator[str]:
    """Name topics without a message, or with no time in common with the one that is followed."""
    followed = feeds.stamps[base].time
    for feed, stamps in zip(feeds.feeds, feeds.stamps, strict=True):
        if not len(stamps.time):
            yield f"topic `{feed.topic.name}` has no message with a time; set its channels to null"
            continue
        until_next = all(one.source.hold for one in feed.channels.values())
        late = stamps.time.min() > followed.max()
        if late or (stamps.time.max() < followed.min() and not until_next):
            other = feeds.feeds[base]
            yield (
                f"the clock of `{feed.topic.name}` runs {_span(feed)} and that of"
                f" `{other.topic.name}` {_span(other)}: they have nothing in common. Choose another"
                " `time`, or set the channels of one to null"
            )


def _span(feed: Feed) -> str:
    time = feed.clock.time[np.isfinite(feed.clock.time)]
    return f"from {time.min():.10g} s to {time.max():.10g} s"


def _neighbours(names: Sequence[str], place: int) -> tuple[str, ...]:
    """Return the names before and after one."""
    return (*names[max(place - 1, 0) : place], *names[place + 1 : place + 2])


def _filled(values: FloatArray) -> FloatArray:
    """Fill NaN with the last value before it."""
    last = np.maximum.accumulate(np.where(np.isnan(values), 0, np.arange(len(values))))
    return values[last]


def runs_in_degrees(name: str, angle: FloatArray) -> bool:
    """Tell an angle in degrees taken for one in radians."""
    if name == "pitch":
        return bool((np.abs(angle) > _TURN).any())
    wrap = np.abs(np.diff(angle))
    return bool(((wrap > 340) & (wrap < 380)).any())

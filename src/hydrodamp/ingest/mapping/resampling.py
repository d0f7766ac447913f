"""Resampling of all channels to a reference clock: linear, slerp, or sample and hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.ingest.clock import (
    Brackets,
    Ticks,
    align_runs,
    bracket_ticks,
    interpolate,
    interpolate_attitude,
    make_even_ticks,
    sample_and_hold,
)
from hydrodamp.ingest.irregularity import Irregularity, IrregularityKind
from hydrodamp.ingest.mapping.columns import FoundColumn, describe_topic
from hydrodamp.ingest.mapping.streams import Stream


class Resampler:
    """Returns channels at the ticks of the reference clock: a topic's timestamps, or a rate."""

    def __init__(
        self,
        columns: Sequence[FoundColumn],
        streams: Sequence[Stream],
        topic: str | None,
        rate: float | None,
    ) -> None:
        self.streams = streams
        self.base = base = _choose_reference(streams, topic)
        self.has_rate = rate is not None
        reference_ticks = Ticks(base.stamps.time, base.stamps.run)
        self.ticks = reference_ticks if rate is None else make_even_ticks(base.stamps, rate)
        if faults := [*_find_disjoint(streams, base)]:
            raise LogError(faults)
        self.irregularities = list(
            dict.fromkeys(
                irregularity for stream in streams for irregularity in stream.stamps.irregularities
            )
        )
        for stream in streams:
            stream.stamps = align_runs(stream.stamps, base.stamps)
        self.constants = {
            column.entry.channel: float(column.values()[0])
            for column in columns
            if column.topic is None
        }
        self._streams_by_channel = {
            channel: stream for stream in streams for channel in stream.channels
        }
        self._brackets: dict[tuple[int, bytes], Brackets] = {}

    @property
    def n(self) -> int:
        """Number of ticks."""
        return len(self.ticks.time)

    def has(self, channel: str) -> bool:
        """Return whether a channel ``group.name`` exists."""
        return channel in self._streams_by_channel or channel in self.constants

    def labels(self) -> tuple[str, ...] | None:
        """Return the segment label of each tick; None without a segment column."""
        if self.base.clock.labels is None:
            return None
        stamps = self.base.stamps
        indices = bracket_ticks(stamps, self.ticks).before if self.has_rate else slice(None)
        return tuple(np.array(self.base.clock.labels, dtype=object)[stamps.rows][indices].tolist())

    def lines(self) -> Sequence[int] | None:
        """Return the file line of each tick; None if unknown."""
        lines, rows = self.base.topic.lines, self.base.stamps.rows
        if self.has_rate or not len(lines) or self.base.rows is not None:
            return None
        return lines if len(rows) == len(lines) else [lines[row] for row in rows.tolist()]

    def is_direct(self, channel: str) -> bool:
        """Return whether a channel has the reference clock."""
        return self._streams_by_channel.get(channel) is self.base and not self.has_rate

    def share_clock(self, channels: Sequence[str]) -> bool:
        """Return whether channels share one topic and clock."""
        streams = [self._streams_by_channel.get(channel) for channel in channels]
        return streams[0] is not None and all(stream is streams[0] for stream in streams)

    def number(self, channel: str, *, is_command: bool = False) -> FloatArray:
        """Return a channel at the ticks, shape (n,); NaN where unknown."""
        stream = self._streams_by_channel.get(channel)
        if stream is None:
            return np.full(self.n, self.constants[channel])
        values, hold = stream.values(channel), stream.channels[channel].source.hold
        if self.is_direct(channel):
            return _forward_fill(values, self.ticks.run) if hold else values
        if hold or (is_command and hold is None):
            return self._resample(
                values, channel, partial(sample_and_hold, until_next=hold is True)
            )
        return self._resample(values, channel, interpolate)

    def angle(self, channel: str) -> FloatArray:
        """Return an angle at the ticks, shape (n,), interpolated after unwrapping."""
        if channel in self.constants or self.is_direct(channel):
            return self.number(channel)
        return self._resample(
            self.raw(channel),
            channel,
            lambda angle, brackets: interpolate(np.unwrap(angle), brackets),
        )

    def raw(self, channel: str) -> FloatArray:
        """Return a channel at its own timestamps."""
        stream = self._streams_by_channel.get(channel)
        return np.array([self.constants[channel]]) if stream is None else stream.values(channel)

    def attitude(self, quaternions: FloatArray, channel: str) -> FloatArray:
        """Return quaternions at the ticks, shape (n, 4); normalised if resampled."""
        if channel in self.constants or self.is_direct(channel):
            return quaternions
        norm = np.sqrt(np.einsum("ni,ni->n", quaternions, quaternions))
        # Estimators send zeros before they are initialised.
        unit = quaternions / np.where(norm > 0.5, norm, np.nan)[:, np.newaxis]
        return self._resample(unit, channel, interpolate_attitude)

    def _resample(
        self, values: FloatArray, channel: str, method: Callable[[FloatArray, Brackets], FloatArray]
    ) -> FloatArray:
        """Resample the finite values of a channel to the ticks; report the others."""
        stream, valid = (
            self._streams_by_channel[channel],
            np.isfinite(values if values.ndim == 1 else values[:, 0]),
        )
        if not valid.any():
            return np.full((self.n, *values.shape[1:]), np.nan)
        is_complete = bool(valid.all())
        key = (id(stream), b"" if is_complete else valid.tobytes())
        if key not in self._brackets:
            stamps, name = stream.stamps, stream.topic.name
            if not is_complete:
                name_of_channel = channel.partition(".")[2] if values.ndim == 1 else "attitude"
                first, count = float(stamps.time[np.argmin(valid)]), int(np.sum(~valid))
                irregularity = Irregularity(
                    name, IrregularityKind.INVALID, count, first, channel=name_of_channel
                )
                self.irregularities.append(irregularity)
            self._brackets[key] = bracket_ticks(stamps.select(valid), self.ticks)
        return method(values if is_complete else values[valid], self._brackets[key])


def _choose_reference(streams: Sequence[Stream], topic: str | None) -> Stream:
    """Return the stream with the reference clock: the shortest step with a velocity."""
    candidates = [stream for stream in streams if stream.has_velocity] or list(streams)
    if topic is not None:
        named = [stream for stream in streams if stream.topic.name == topic]
        candidates = [stream for stream in named if stream.has_velocity] or named
    if not candidates:
        names = dict.fromkeys(stream.topic.name for stream in streams)
        raise LogError(
            f"`clock` is the topic `{topic}`, which has no mapped channel."
            f"{did_you_mean(topic or '', names)} Mapped topics: {', '.join(names)}"
        )
    base = min(candidates, key=lambda one: one.stamps.step or np.inf)
    if (count := len(base.stamps.rows)) < 2:
        amount = "one message" if count == 1 else "no message"
        raise LogError(
            f"{describe_topic(base.topic)} has {amount} with increasing time; two are required"
        )
    return base


def _find_disjoint(streams: Sequence[Stream], base: Stream) -> Iterator[str]:
    """Yield a fault per topic without messages or without overlap with the reference clock."""
    reference = base.stamps.time
    for stream in streams:
        time, name = stream.stamps.time, stream.topic.name
        if not len(time):
            yield f"topic `{name}` has no message with a timestamp; set its channels to null"
            continue
        until_next = all(column.source.hold for column in stream.channels.values())
        late = time.min() > reference.max()
        if late or (time.max() < reference.min() and not until_next):
            yield (
                f"the clocks of `{name}` ({_describe_span(stream)}) and `{base.topic.name}`"
                f" ({_describe_span(base)}) do not overlap. Set another `time`, or set the channels"
                " of one topic to null"
            )


def _describe_span(stream: Stream) -> str:
    time = stream.clock.time[np.isfinite(stream.clock.time)]
    return f"from {time.min():.3f} s to {time.max():.3f} s"


def _forward_fill(values: FloatArray, run: IntArray) -> FloatArray:
    """Replace NaN by the last value before it in the same run."""
    run_start = np.searchsorted(run, run)
    last = np.maximum.accumulate(np.where(np.isnan(values), run_start, np.arange(len(values))))
    return values[last]

"""Resampling of all channels to a reference clock: linear, slerp, or sample and hold."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.dropouts import is_invalid_velocity
from hydrodamp.data.recording import Topic
from hydrodamp.errors import LogError, did_you_mean
from hydrodamp.ingest.clock import (
    Brackets,
    Clock,
    Irregularity,
    IrregularityKind,
    Ticks,
    Timestamps,
    align_runs,
    bracket_ticks,
    clean_timestamps,
    interpolate,
    interpolate_attitude,
    make_even_ticks,
    sample_and_hold,
)
from hydrodamp.ingest.mapping.channel_schema import COORDINATES, Source
from hydrodamp.ingest.mapping.columns import (
    FoundColumn,
    describe_topic,
    find_interleaved,
    find_new_rows,
    find_numeric_field,
    read_labels,
    read_timestamps,
)
from hydrodamp.ingest.mapping.geodesy import mask_missing_fixes

_MAX_FLOAT = np.finfo(np.float64).max
_LINEAR = tuple(f"velocity.{name}" for name in "uvw")
_PARTNERS = dict(zip(COORDINATES, COORDINATES[::-1], strict=True))


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
    def is_optional(self) -> bool:
        """Whether the log may lack all channels."""
        return all(column.source.optional for column in self.channels.values())

    @property
    def has_velocity(self) -> bool:
        """Whether it holds a velocity, so that it may be the reference clock."""
        return any(channel.startswith("velocity.") for channel in self.channels)

    def values(self, channel: str) -> FloatArray:
        """Return the samples of a channel at the cleaned timestamps, in SI units."""
        values = self.channels[channel].values()
        is_velocity = channel in _LINEAR
        invalid = is_invalid_velocity(values, _MAX_FLOAT) if is_velocity else np.isinf(values)
        if invalid.any():
            values = np.where(invalid, np.nan, values)
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
    interleaved = find_interleaved(columns)
    for column in columns:
        if (topic := column.topic) is None:
            continue
        rows = interleaved.get(column.entry.channel)
        row_key = b"" if rows is None else rows.tobytes()
        key = (topic.name, row_key, column.source.delay, *column.source.where.items())
        try:
            if topic.name not in clocks:
                clocks[topic.name] = Clock(topic.name, read_timestamps(topic, time))
            if key not in streams:
                clock = clocks[topic.name]
                streams[key] = _make_stream(topic, column.source, clock, segment, rows)
            streams[key].channels[column.entry.channel] = column
        except LogError as error:
            faults += error.faults
    return [it for it in streams.values() if len(it.stamps.rows) or not it.is_optional], [
        *dict.fromkeys(faults)
    ]


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
    is_new = find_new_rows(topic, stamps) if rows is None else None
    return Stream(topic, Clock(topic.name, stamps, labels, is_new, run), rows)


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
        irregularities = dict.fromkeys(
            it for stream in streams for it in stream.stamps.irregularities
        )
        self.irregularities = [*irregularities]
        for stream in streams:
            stream.stamps = align_runs(stream.stamps, base.stamps)
        constants = (column for column in columns if column.topic is None)
        self.constants = {it.entry.channel: float(it.values()[0]) for it in constants}
        self._streams_by_channel = {name: stream for stream in streams for name in stream.channels}
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
        values, hold = self._read_values(channel), stream.channels[channel].source.hold
        if self.is_direct(channel):
            return _forward_fill(values, self.ticks.run) if hold else values
        is_held = hold or (is_command and hold is None)
        method = partial(sample_and_hold, until_next=hold is True) if is_held else interpolate
        return self._resample(values, channel, method)

    def angle(self, channel: str) -> FloatArray:
        """Return an angle at the ticks, shape (n,), interpolated after unwrapping."""
        if channel in self.constants or self.is_direct(channel):
            return self.number(channel)
        # Only valid angles are unwrapped.
        return self._resample(self.raw(channel), channel, lambda a, b: interpolate(np.unwrap(a), b))

    def raw(self, channel: str) -> FloatArray:
        """Return a channel at its own timestamps."""
        if channel in self.constants:
            return np.array([self.constants[channel]])
        return self._read_values(channel)

    def _read_values(self, channel: str) -> FloatArray:
        """Return a channel at its own timestamps; fixes of a receiver without position are NaN."""
        stream, partner = self._streams_by_channel[channel], _PARTNERS.get(channel, "")
        values = stream.values(channel)
        if (source := self._streams_by_channel.get(partner)) is None:
            return values
        return mask_missing_fixes(
            values, stream.stamps.time, source.values(partner), source.stamps.time
        )

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
        stream = self._streams_by_channel[channel]
        valid = np.isfinite(values if values.ndim == 1 else values[:, 0])
        if not valid.any():
            return np.full((self.n, *values.shape[1:]), np.nan)
        is_complete = bool(valid.all())
        key = (id(stream), b"" if is_complete else valid.tobytes())
        if key not in self._brackets:
            stamps, name = stream.stamps, stream.topic.name
            if not is_complete:
                label = channel.partition(".")[2] if values.ndim == 1 else "attitude"
                first, count = float(stamps.time[np.argmin(valid)]), int(np.sum(~valid))
                kind = IrregularityKind.INVALID
                self.irregularities.append(Irregularity(name, kind, count, first, channel=label))
            self._brackets[key] = bracket_ticks(stamps.select(valid), self.ticks)
        return method(values if is_complete else values[valid], self._brackets[key])


def _choose_reference(streams: Sequence[Stream], topic: str | None) -> Stream:
    """Return the stream with the reference clock: the shortest step with a velocity."""
    named = [stream for stream in streams if topic in (None, stream.topic.name)]
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

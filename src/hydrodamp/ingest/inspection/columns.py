"""Columns of a recording: clocks, time series, and their synchronisation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.channels import UNITS
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.clock import (
    Clock,
    Ticks,
    Timestamps,
    align_runs,
    bracket_ticks,
    clean_timestamps,
    interpolate,
)
from hydrodamp.ingest.inspection.names import NO_ROLE, guess_role, split_unit, unit_of, words

_TIME_WORDS = {"time", "timestamp", "t", "stamp", "secs", "seconds", "clock", "elapsed", "timeus"}
_SECOND_WORDS = {"sec", "secs", "s"}
_NANOSECOND_WORDS = {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"}
_MIN_INCREASING_SHARE = 0.98  # share of increasing steps; the others are joins
_MIN_STOPPED_ROWS = 20  # rows (and times the usual number) with the last stamp of a stopped clock
_MAX_JITTER = 0.05  # jitter up to which a constant rate replaces the clock
_MIN_EPOCHS = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # 1973 and later, since 1970
_MAX_MAGNITUDE = 1e30  # of any unit; larger values are invalid
_MAX_STEP_S = 5.0  # s; longer median steps indicate another unit
_MAX_SAMPLES = 60_000  # samples; longer clocks are decimated


@dataclass(frozen=True, eq=False)
class TopicClock:
    """The clock of a topic."""

    column: str | None  # None for the arrival time that the file records
    seconds: FloatArray
    unit: str
    confidence: int
    evidence: str
    fraction: str = ""  # the column of nanoseconds that belongs to that of seconds
    rate: float | None = None  # constant rate of rows, if no column is a clock


def find_clock(topic: Topic) -> TopicClock | None:
    """Return the clock of a topic, or None; sensor stamps take precedence over arrival times."""
    fields = {name: _mask_implausible(values) for name, values in topic.fields.items()}
    halves = _split_stamps(topic)
    rising = [name for name, values in fields.items() if _is_increasing(values)]
    named = [name for name in rising if _TIME_WORDS & {*words(name)} or name in halves]
    stamped = [name for name in named if "header" in words(name) or name in halves]
    arrival = None if topic.time is None else _mask_implausible(topic.time)
    is_recorded = arrival is not None and bool(np.isfinite(arrival).any())
    if arrival is not None and is_recorded and not stamped:
        return TopicClock(None, arrival, "s", 100, "arrival time recorded by the file")
    plain = (name for name in rising if _is_plain_clock(fields[name]) and _has_no_role(topic, name))
    name = next(iter((*stamped, *named, *plain)), None)
    if name is None:
        return None
    confidence, reason = (95, "its name, and it increases") if named else (70, "it increases")
    reason = "sensor time stamp, preferred to the arrival time" if is_recorded else reason
    stated = "s" if name in halves else unit_of(topic, name)
    unit = stated if stated in UNITS["time"] else _unit_by_size(fields[name])
    seconds = fields[name] * UNITS["time"][unit]
    if name in halves:
        seconds = seconds + 1e-9 * fields[halves[name]]
    evidence = f"{reason}; {unit} by {'file or name' if unit == stated else 'magnitude'}"
    if rate := _rate_before_stop(seconds):
        evidence = f"`{name}` stops before the last row: its rate is used for all rows"
        seconds = np.arange(len(seconds)) / rate
    return TopicClock(name, seconds, unit, confidence, evidence, halves.get(name, ""), rate)


def _has_no_role(topic: Topic, name: str) -> bool:
    """Return whether a name suggests no role, so that the column may be a clock."""
    return guess_role(topic.name, name, None, topic.fields) == (NO_ROLE, 0)


def find_clocks(recording: Recording) -> dict[str, TopicClock]:
    """Return the clocks of topics; a clock alone in its topic gives the rate of topics without."""
    topics = recording.topics
    clocks = {topic.name: clock for topic in topics if (clock := find_clock(topic))}
    lone = [
        clock
        for topic in topics
        if (clock := clocks.get(topic.name)) and {*topic.fields} == {clock.column}
    ]
    if len(lone) == 1 and (rate := even_rate(lone[0].seconds)):
        reason = f"the rate of `{lone[0].column}`, which stops before the last row"
        return {topic.name: clock_at_rate(topic, rate, reason) for topic in topics} | clocks
    return clocks


def clock_at_rate(topic: Topic, rate: float, why: str = "") -> TopicClock:
    """Return a clock of constant rate."""
    return TopicClock(None, np.arange(float(topic.n)) / rate, "s", 70, why, rate=rate)


def _split_stamps(topic: Topic) -> dict[str, str]:
    """Return the columns of nanoseconds of columns of whole seconds."""
    split = {name: (words(name)[:-1], {*words(name)[-1:]}) for name in topic.fields}
    nanos = {stem: name for name, (stem, last) in split.items() if last & _NANOSECOND_WORDS}
    return {
        name: nanos[stem]
        for name, (stem, last) in split.items()
        if last & _SECOND_WORDS and stem in nanos
    }


def _is_plain_clock(values: FloatArray) -> bool:
    """Return whether values increase as a clock does and are not row numbers."""
    steps = np.diff(values[np.isfinite(values)])
    numbers_rows = bool((steps == 1.0).all()) and values[0] in (0.0, 1.0)
    return bool(np.mean(steps > 0.0) >= _MIN_INCREASING_SHARE) and not numbers_rows


def _rate_before_stop(seconds: FloatArray) -> float | None:
    """Return the rate of a uniform clock that stops before the last row."""
    moves = np.flatnonzero(np.diff(seconds) > 0)
    still = len(seconds) - 2 - moves[-1] if len(moves) else 0
    if still < _MIN_STOPPED_ROWS * max(1.0, len(seconds) / (len(moves) + 1)):
        return None
    return even_rate(seconds[: moves[-1] + 2])


def even_rate(seconds: FloatArray) -> float | None:
    """Return the rate of a uniform clock [Hz]."""
    steps = np.diff(seconds)
    step = float(np.median(steps)) if len(steps) else 0.0
    is_even = step > 0 and float(np.quantile(np.abs(steps - step), 0.95)) < _MAX_JITTER * step
    return float(f"{1 / step:.6g}") if is_even else None


def _mask_implausible(values: FloatArray) -> FloatArray:
    return np.where(np.abs(values) < _MAX_MAGNITUDE, values, np.nan)


def _unit_by_size(values: FloatArray) -> str:
    """Return the unit that makes the epoch or the step plausible."""
    finite = values[np.isfinite(values)]
    for unit, least in _MIN_EPOCHS.items():
        if float(np.median(finite)) > least:
            return unit
    step = float(np.median(np.diff(finite)))
    units = {"s": _MAX_STEP_S, "ms": _MAX_STEP_S * 1e3, "us": _MAX_STEP_S * 1e6}
    return next((unit for unit, most in units.items() if step < most), "ns")


def _is_increasing(values: FloatArray) -> bool:
    """Return whether values increase, except repeats of a coarse clock."""
    finite = values[np.isfinite(values)]
    steps = np.diff(finite)
    moving = steps[steps != 0.0]
    if len(finite) < max(2, len(values) // 2) or len(moving) < max(1, len(steps) // 100):
        return False
    return bool(np.mean(moving > 0.0) >= _MIN_INCREASING_SHARE)


@dataclass(frozen=True, eq=False)
class Series:
    """A field of numbers with its times."""

    topic: str
    field: str
    unit: str | None
    seconds: FloatArray
    values: FloatArray

    @property
    def column(self) -> str:
        """Name in a mapping."""
        return f"{self.topic}.{self.field}" if self.topic else self.field


def topic_series(topic: Topic, clock: TopicClock | None) -> list[Series]:
    """Return the fields of a topic without its clock and other times."""
    column, seconds = (None, np.empty(0)) if clock is None else (clock.column, clock.seconds)
    return [
        Series(topic.name, name, unit_of(topic, name), seconds, values)
        for name, raw in topic.fields.items()
        if name != column and not is_stamp(name)
        if np.isfinite(values := _mask_implausible(raw)).any()
    ]


def is_stamp(name: str) -> bool:
    """Return whether a name is that of a time stamp."""
    return split_unit(name)[0][-1:] in (("time",), ("timestamp",), ("stamp",)) or "stamp." in name


def synchronise(series: Sequence[Series]) -> tuple[FloatArray, FloatArray]:
    """Synchronise series to the slowest clock: elapsed time and columns, a NaN row at gaps."""
    try:
        times = {item.topic: item.seconds for item in series}
        stamps = {topic: clean_timestamps(Clock(topic, time)) for topic, time in times.items()}
    except LogError:  # not a clock
        return np.empty(0), np.empty((0, len(series)))
    base = max(stamps.values(), key=lambda item: item.step)
    thin = slice(None, None, every := 1 + len(base.time) // _MAX_SAMPLES)
    ticks = Ticks(base.time[thin], base.run[thin])
    columns = [_interpolate_at(ticks, base, stamps[item.topic], item.values) for item in series]
    values = np.column_stack(columns)
    steps = np.diff(ticks.time, prepend=ticks.time[:1])
    limit = base.limit + (every - 1) * base.step
    broken = (np.diff(ticks.run, prepend=ticks.run[:1]) != 0) | (steps > limit)
    values[broken] = np.nan
    return np.cumsum(np.where(broken, base.step, steps)), values


def _interpolate_at(
    ticks: Ticks, base: Timestamps, stamps: Timestamps, values: FloatArray
) -> FloatArray:
    """Interpolate the values of a topic at ticks."""
    stamps = align_runs(stamps.select(np.isfinite(values[stamps.rows])), base)
    if not len(stamps.rows):
        return np.full(len(ticks.time), np.nan)
    return interpolate(values[stamps.rows], bracket_ticks(stamps, ticks))

"""The columns of a recording: the clocks among them, the others as series, several on one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.data.units import UNITS
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
_MIN_INCREASING_SHARE = 0.98  # share of steps; the rest are joins
_MIN_STOPPED_ROWS = (
    20  # rows, and times the usual number, that the last stamp of a clock which stops has
)
_MAX_JITTER = 0.05  # jitter of a clock that rows at a rate can stand for
_MIN_EPOCHS = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # 1973 and later, counted from 1970
_MAX_MAGNITUDE = 1e30  # of any unit; more was not measured
_MAX_STEP_S = 5.0  # s, a median step longer than that of any log
_MAX_SAMPLES = 60_000  # samples; a longer clock is thinned, as motion is slower than that


@dataclass(frozen=True, eq=False)
class TopicClock:
    """The clock of a topic."""

    column: str | None  # None for what the file itself says of arrival
    seconds: FloatArray
    unit: str
    confidence: int
    evidence: str
    fraction: str = ""  # the column of nanoseconds beside that of seconds
    rate: float | None = None  # of rows, where no column counts on


def find_clock(topic: Topic) -> TopicClock | None:
    """Return the clock of a topic, a sensor's before that of arrival; None where there is none."""
    fields = {name: _mask_implausible(values) for name, values in topic.fields.items()}
    halves = _split_stamps(topic)
    rising = [name for name, values in fields.items() if _is_increasing(values)]
    named = [name for name in rising if _TIME_WORDS & {*words(name)} or name in halves]
    stamped = [name for name in named if "header" in words(name) or name in halves]
    is_recorded = topic.time is not None and bool(np.isfinite(_mask_implausible(topic.time)).any())
    if topic.time is not None and is_recorded and not stamped:
        return TopicClock(
            None, _mask_implausible(topic.time), "s", 100, "when it was recorded, by the file"
        )
    plain = (name for name in rising if _is_plain_clock(fields[name]) and _has_no_role(topic, name))
    name = next(iter((*stamped, *named, *plain)), None)
    if name is None:
        return None
    sure, why = (95, "its name, and it increases") if named else (70, "it increases")
    why = "the sensor's own stamp, before that of arrival" if is_recorded else why
    stated = "s" if name in halves else unit_of(topic, name)
    unit = stated if stated in UNITS["time"] else _unit_by_size(fields[name])
    seconds = fields[name] * UNITS["time"][unit]
    if name in halves:
        seconds = seconds + 1e-9 * fields[halves[name]]
    told = f"{why}; {unit} by its {'file or name' if unit == stated else 'size'}"
    if rate := _rate_before_stop(seconds):
        told = f"`{name}` stands still before the rows end: they are counted at its rate"
        seconds = np.arange(len(seconds)) / rate
    return TopicClock(name, seconds, unit, sure, told, halves.get(name, ""), rate)


def _has_no_role(topic: Topic, name: str) -> bool:
    """Return whether a name is of no measurement and of nothing else, so that it may be a clock."""
    return guess_role(topic.name, name, None, topic.fields) == (NO_ROLE, 0)


def find_clocks(recording: Recording) -> dict[str, TopicClock]:
    """Return the clocks of topics; one that stands alone, shorter, has the rate of all others."""
    clocks = {topic.name: clock for topic in recording.topics if (clock := find_clock(topic))}
    lone = [one for name, one in clocks.items() if {*recording.topic(name).fields} == {one.column}]
    if len(lone) == 1 and (rate := even_rate(lone[0].seconds)):
        why = f"the rate of `{lone[0].column}`, which stops before the rows end"
        clocks = {one.name: clock_at_rate(one, rate, why) for one in recording.topics} | clocks
    return clocks


def clock_at_rate(topic: Topic, rate: float, why: str = "") -> TopicClock:
    """Return the clock of rows that come at a rate."""
    return TopicClock(None, np.arange(float(topic.n)) / rate, "s", 70, why, rate=rate)


def _split_stamps(topic: Topic) -> dict[str, str]:
    """Return for columns of whole seconds those of nanoseconds beside them."""
    split = {name: words(name) for name in topic.fields}
    nanos = {its[:-1]: name for name, its in split.items() if {*its[-1:]} & _NANOSECOND_WORDS}
    return {
        name: nanos[its[:-1]]
        for name, its in split.items()
        if {*its[-1:]} & _SECOND_WORDS and its[:-1] in nanos
    }


def _is_plain_clock(values: FloatArray) -> bool:
    """Return whether values without a telling name increase always, and do not number the rows."""
    steps = np.diff(values[np.isfinite(values)])
    numbers_rows = bool((steps == 1.0).all()) and values[0] in (0.0, 1.0)
    return bool(np.mean(steps > 0.0) >= _MIN_INCREASING_SHARE) and not numbers_rows


def _rate_before_stop(seconds: FloatArray) -> float | None:
    """Return the rate of an even clock that stands still at its end."""
    moves = np.flatnonzero(np.diff(seconds) > 0)
    still = len(seconds) - 2 - moves[-1] if len(moves) else 0
    if still < _MIN_STOPPED_ROWS * max(1.0, len(seconds) / (len(moves) + 1)):
        return None
    return even_rate(seconds[: moves[-1] + 2])


def even_rate(seconds: FloatArray) -> float | None:
    """Return the rate of an even clock."""
    steps = np.diff(seconds)
    step = float(np.median(steps)) if len(steps) else 0.0
    is_even = step > 0 and float(np.quantile(np.abs(steps - step), 0.95)) < _MAX_JITTER * step
    return float(f"{1 / step:.6g}") if is_even else None


def _mask_implausible(values: FloatArray) -> FloatArray:
    return np.where(np.abs(values) < _MAX_MAGNITUDE, values, np.nan)


def _unit_by_size(values: FloatArray) -> str:
    """Return the unit that makes an epoch or a step of a likely size."""
    finite = values[np.isfinite(values)]
    for unit, least in _MIN_EPOCHS.items():
        if float(np.median(finite)) > least:
            return unit
    step = float(np.median(np.diff(finite)))
    units = {"s": _MAX_STEP_S, "ms": _MAX_STEP_S * 1e3, "us": _MAX_STEP_S * 1e6}
    return next((unit for unit, most in units.items() if step < most), "ns")


def _is_increasing(values: FloatArray) -> bool:
    """Return whether values increase, but for repeats, as a clock does, be it a coarse one."""
    finite = values[np.isfinite(values)]
    steps = np.diff(finite)
    moving = steps[steps != 0.0]
    if len(finite) < max(2, len(values) // 2) or len(moving) < max(1, len(steps) // 100):
        return False
    return bool(np.mean(moving > 0.0) >= _MIN_INCREASING_SHARE)


@dataclass(frozen=True, eq=False)
class Series:
    """A field of numbers and when each was sent."""

    topic: str
    field: str
    unit: str | None
    seconds: FloatArray
    values: FloatArray

    @property
    def column(self) -> str:
        """How a mapping calls it."""
        return f"{self.topic}.{self.field}" if self.topic else self.field


def topic_series(topic: Topic, clock: TopicClock | None) -> list[Series]:
    """Return the fields of a topic, but its clock and other times beside it."""
    column, seconds = (None, np.empty(0)) if clock is None else (clock.column, clock.seconds)
    return [
        Series(topic.name, name, unit_of(topic, name), seconds, values)
        for name, values in (
            (name, _mask_implausible(values)) for name, values in topic.fields.items()
        )
        if name != column and not is_stamp(name) and bool(np.isfinite(values).any())
    ]


def is_stamp(name: str) -> bool:
    """Return whether a name is that of a time."""
    return split_unit(name)[0][-1:] in (("time",), ("timestamp",), ("stamp",)) or "stamp." in name


def synchronise(series: Sequence[Series]) -> tuple[FloatArray, FloatArray]:
    """Bring series to the clock of the slowest: elapsed time and columns, a row of NaN at gaps."""
    try:
        times = {one.topic: one.seconds for one in series}
        stamps = {topic: clean_timestamps(Clock(topic, time)) for topic, time in times.items()}
    except LogError:  # what seemed a clock is none
        return np.empty(0), np.empty((0, len(series)))
    base = max(stamps.values(), key=lambda one: one.step)
    thin = slice(None, None, every := 1 + len(base.time) // _MAX_SAMPLES)
    ticks = Ticks(base.time[thin], base.run[thin])
    values = np.column_stack(
        [_interpolate_at(ticks, base, stamps[one.topic], one.values) for one in series]
    )
    steps = np.diff(ticks.time, prepend=ticks.time[:1])
    limit = base.limit + (every - 1) * base.step
    broken = (np.diff(ticks.run, prepend=ticks.run[:1]) != 0) | (steps > limit)
    values[broken] = np.nan
    return np.cumsum(np.where(broken, base.step, steps)), values


def _interpolate_at(
    ticks: Ticks, base: Timestamps, stamps: Timestamps, values: FloatArray
) -> FloatArray:
    """Interpolate the numbers of a topic at ticks."""
    stamps = align_runs(stamps.select(np.isfinite(values[stamps.rows])), base)
    if not len(stamps.rows):
        return np.full(len(ticks.time), np.nan)
    return interpolate(values[stamps.rows], bracket_ticks(stamps, ticks))

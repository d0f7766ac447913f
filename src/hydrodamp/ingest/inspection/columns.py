"""Columns of a recording: clocks, time series, and their synchronisation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

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
from hydrodamp.ingest.wrapped_counters import unwrap_counter

_TIME_WORDS = {"time", "timestamp", "t", "stamp", "secs", "seconds", "clock", "elapsed", "timeus"}
_TIME_WORDS |= {"zeit", "zeitstempel", "temps", "tiempo", "tempo", "utc", "tow"}
_SECOND_WORDS = {"sec", "secs", "s"}
_NANOSECOND_WORDS = {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"}
_MIN_INCREASING_SHARE = 0.98  # share of increasing steps; the others are joins
_MIN_STOPPED_ROWS = 20  # rows (and times the usual number) with the last stamp of a stopped clock
_MAX_JITTER = 0.05  # jitter up to which a constant rate replaces the clock
_MIN_EPOCHS = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # 1973 and later, since 1970
_EPOCH_SECONDS = (6e8, 2.1e9)  # s since 1970: 1989 to 2036
_EPOCH_DAYS = (9131.0, 23741.0)  # d since 1970: 1995 to 2034
# Day numbers of 1970-01-01: Unix, spreadsheets, MJD, MATLAB, Julian
_EPOCHS_OF_DAYS = (0.0, 25569.0, 40587.0, 719529.0, 2440587.5)
_GPS_EPOCH_S = 315964800.0  # s; 1980-01-06 since 1970
_WEEK_S = 604800.0  # s
_WEEK_WORDS = {"week", "weeks", "wk", "gwk", "wn", "wno", "weekno", "gpsweek"}
_TIME_OF_WEEK_WORDS = {"tow", "itow", "sow", "gms", "gpst", "gps", "week", "sec", "secs", "seconds"}
_MAX_MAGNITUDE = 1e30  # of any unit; larger values are invalid
_MIN_STEP_S, _MAX_STEP_S = 1e-3, 5.0  # s; other median steps indicate another unit
_MAX_EPOCH_STEP_S = 120.0  # s; of a clock since 1970 in seconds
_MAX_SAMPLES = 60_000  # samples; longer series are decimated


@dataclass(frozen=True, eq=False)
class TopicClock:
    """The clock of a topic."""

    column: str | None  # None for the arrival time that the file records
    seconds: FloatArray
    unit: str
    confidence: int
    evidence: str
    plus: Mapping[str, float] = field(default_factory=dict)  # columns that belong to it
    rate: float | None = None  # constant rate of rows, if no column is a clock
    offset: float = 0.0  # added to the column, in its unit
    stated: str = ""  # unit by the file
    is_certain: bool = True  # its unit needs no confirmation by the motion

    @property
    def alternatives(self) -> list[TopicClock]:
        """The clocks in the units that its steps allow, in order of preference."""
        if self.is_certain:
            return [self]
        factors = UNITS["time"]
        units = dict.fromkeys((self.unit, self.stated, "s", "ms", "us", "ns"))
        return [self.in_unit(unit) for unit in units if unit in factors]

    def in_unit(self, unit: str) -> TopicClock:
        """Return the clock in another unit."""
        if unit == self.unit:
            return self
        seconds = self.seconds / UNITS["time"][self.unit] * UNITS["time"][unit]
        evidence = f"{unit} by the rates, which agree with the attitude"
        return replace(self, seconds=seconds, unit=unit, evidence=evidence)


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
    stated = stated if stated in UNITS["time"] else ""
    unit, offset, is_certain = _unit_by_size(fields[name])
    evidence = f"{reason}; {unit} by magnitude"
    if stated:
        step = UNITS["time"][stated] * _typical_step(fields[name])
        is_certain = _MIN_STEP_S <= step <= _MAX_STEP_S or stated == unit
        if step < _MIN_STEP_S and stated != unit:
            evidence = (
                f"{evidence}: {stated}, as the file states, would give a step of {step:.2g} s"
            )
            confidence = 70
        else:
            unit, evidence = stated, f"{reason}; {stated} by file or name"
    factor = UNITS["time"][unit]
    plus = {halves[name]: 1e-9} if name in halves else {}
    if week := _find_week(topic, name, fields[name] * factor):
        plus, offset = {week: _WEEK_S / factor}, _GPS_EPOCH_S / factor
        evidence += f"; time of the GPS week in `{week}`"
    seconds = fields[name] + offset
    for added, weight in plus.items():
        seconds = seconds + weight * fields[added]
    seconds = unwrap_counter(seconds * factor)
    if rate := _rate_before_stop(seconds):
        evidence = f"`{name}` stops before the last row: its rate is used for all rows"
        seconds = np.arange(len(seconds)) / rate
    return TopicClock(
        name, seconds, unit, confidence, evidence, plus, rate, offset, stated, is_certain
    )


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


def _find_week(topic: Topic, name: str, seconds: FloatArray) -> str:
    """Return the column of GPS weeks that a time of the week belongs to; empty for none."""
    if not _TIME_OF_WEEK_WORDS & {*words(name)} or not 0.0 <= np.nanmin(seconds) <= _WEEK_S:
        return ""
    weeks = (key for key in topic.fields if key != name and _WEEK_WORDS & {*words(key)})
    return next((key for key in weeks if 0.0 < np.nanmin(topic.fields[key]) < 1e4), "")


def _typical_step(values: FloatArray) -> float:
    """Return the median step of a clock, per row of a coarse one."""
    steps = np.diff(values[np.isfinite(values)])
    moving = steps[steps > 0.0]
    return float(np.median(moving)) * len(moving) / len(steps)


def _unit_by_size(values: FloatArray) -> tuple[str, float, bool]:
    """Return the unit, and the offset, that make epoch or step plausible; whether by the epoch."""
    size, step = float(np.nanmedian(values)), _typical_step(values)
    for unit, least in _MIN_EPOCHS.items():
        if size > least:
            return unit, 0.0, True
    if _EPOCH_SECONDS[0] < size < _EPOCH_SECONDS[1] and step < _MAX_EPOCH_STEP_S:
        return "s", 0.0, step >= _MIN_STEP_S
    for epoch in _EPOCHS_OF_DAYS if step < _MIN_STEP_S else ():
        if _EPOCH_DAYS[0] < size - epoch < _EPOCH_DAYS[1]:
            return "d", -epoch, True
    units = {"s": _MAX_STEP_S, "ms": _MAX_STEP_S * 1e3, "us": _MAX_STEP_S * 1e6}
    return next((unit for unit, most in units.items() if step < most), "ns"), 0.0, False


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

    def decimate(self) -> Series:
        """Return the series without most samples of a long one."""
        return replace(self, seconds=decimate(self.seconds), values=decimate(self.values))


def decimate(samples: FloatArray) -> FloatArray:
    """Return every k-th of many samples."""
    return samples[:: 1 + len(samples) // _MAX_SAMPLES]


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
    ticks = Ticks(base.time, base.run)
    columns = [_interpolate_at(ticks, base, stamps[item.topic], item.values) for item in series]
    values = np.column_stack(columns)
    steps = np.diff(ticks.time, prepend=ticks.time[:1])
    broken = (np.diff(ticks.run, prepend=ticks.run[:1]) != 0) | (steps > base.limit)
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

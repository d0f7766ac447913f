"""Topics and their clocks: which column is the time, what a topic holds, several on one clock."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Topic
from hydrodamp.data.units import UNITS
from hydrodamp.errors import LogError
from hydrodamp.ingest.clock.sampling import Ticks, brackets, interpolated, matched
from hydrodamp.ingest.clock.stamps import Clock, Stamps, set_right
from hydrodamp.ingest.probing.names import parted, unit_of, words

_TIMES = {"time", "timestamp", "t", "stamp", "secs", "seconds", "clock", "elapsed", "timeus"}
_INCREASES = 0.98  # share of steps; the rest are repeats and joins
_EPOCHS = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # 1973 and later, counted from 1970
_LARGEST = 1e30  # of any unit; more was not measured
_SLOW = 5.0  # s, a median step longer than that of any log
_MANY = 60_000  # samples; a longer clock is thinned, as motion is slower than that


@dataclass(frozen=True, eq=False)
class Ticking:
    """The clock of a topic."""

    column: str | None
    seconds: FloatArray
    unit: str
    confidence: int
    evidence: str


def ticking(topic: Topic) -> Ticking | None:
    """Return the clock of a topic, or None where no column increases."""
    if topic.time is not None and np.isfinite(_measured(topic.time)).any():
        return Ticking(None, _measured(topic.time), "s", 100, "stamped by the file")
    fields = {name: _measured(values) for name, values in topic.fields.items()}
    rising = [name for name, values in fields.items() if _share_rising(values) >= _INCREASES]
    if not rising:
        return None
    named = [name for name in rising if _TIMES & set(words(name))]
    name = named[0] if named else min(rising, key=lambda name: _unevenness(fields[name]))
    sure, why = (95, "its name, and it increases") if named else (70, "it has the most even steps")
    stated = unit_of(topic, name)
    is_stated = stated in UNITS["time"]
    unit = stated if stated and is_stated else _unit_by_size(fields[name])
    told = f"{why}; {unit} by its {'file or name' if is_stated else 'size'}"
    return Ticking(name, fields[name] * UNITS["time"][unit], unit, sure, told)


def _measured(values: FloatArray) -> FloatArray:
    return np.where(np.abs(values) < _LARGEST, values, np.nan)


def _unit_by_size(values: FloatArray) -> str:
    """Return the unit that makes an epoch or a step of a likely size."""
    finite = values[np.isfinite(values)]
    for unit, least in _EPOCHS.items():
        if float(np.median(finite)) > least:
            return unit
    step = float(np.median(np.diff(finite)))
    units = {"s": _SLOW, "ms": _SLOW * 1e3, "us": _SLOW * 1e6}
    return next((unit for unit, most in units.items() if step < most), "ns")


def _share_rising(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    if len(finite) < max(2, len(values) // 2):
        return 0.0
    return float(np.mean(np.diff(finite) > 0.0))


def _unevenness(values: FloatArray) -> float:
    steps = np.diff(values[np.isfinite(values)])
    return float(np.std(steps) / np.mean(steps))


@dataclass(frozen=True)
class TopicFacts:
    """One topic of a recording in numbers."""

    name: str
    n: int
    n_fields: int
    rate: float | None
    jitter: float | None
    longest_gap: float | None
    start: float | None
    end: float | None
    backward: int
    units: tuple[tuple[str, str], ...]
    faults: tuple[str, ...]


def facts_of(topic: Topic, clock: Ticking | None) -> TopicFacts:
    """Return how many messages a topic has, how often, with what gaps."""
    times = np.empty(0) if clock is None else clock.seconds[np.isfinite(clock.seconds)]
    steps = np.diff(times)
    ahead = steps[steps > 0.0]
    known = len(ahead) > 0
    step = float(np.median(ahead)) if known else 0.0
    low, high = np.quantile(ahead, (0.05, 0.95)) if known else (0.0, 0.0)
    return TopicFacts(
        name=topic.name,
        n=topic.n,
        n_fields=len(topic.fields),
        rate=1 / step if known else None,
        jitter=float(high - low) / 2 / step if known else None,
        longest_gap=float(ahead.max()) if known else None,
        start=float(times[0]) if len(times) else None,
        end=float(times[-1]) if len(times) else None,
        backward=int(np.count_nonzero(steps <= 0.0)),
        units=tuple((name, unit) for name, unit in topic.units.items() if unit),
        faults=tuple(topic.faults.values()),
    )


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

    @property
    def varies(self) -> bool:
        """Whether it has two different numbers."""
        known = self.values[np.isfinite(self.values)]
        return len(known) > 1 and bool(known.min() < known.max())


def series_of(topic: Topic, clock: Ticking | None) -> list[Series]:
    """Return the fields of a topic, but its clock and other times beside it."""
    column, seconds = (None, np.empty(0)) if clock is None else (clock.column, clock.seconds)
    return [
        Series(topic.name, name, unit_of(topic, name), seconds, values)
        for name, values in ((name, _measured(values)) for name, values in topic.fields.items())
        if name != column and not _is_stamp(name) and bool(np.isfinite(values).any())
    ]


def _is_stamp(name: str) -> bool:
    return parted(name)[0][-1:] in (("time",), ("timestamp",), ("stamp",)) or "stamp." in name


@dataclass(frozen=True, eq=False)
class Together:
    """Several series on one clock; a row of NaN where it begins anew."""

    elapsed: FloatArray
    values: FloatArray


def together(series: Sequence[Series]) -> Together:
    """Bring series to the clock of the slowest of them, NaN over gaps."""
    clocks = {one.topic: Clock(one.topic, one.seconds) for one in series}
    try:
        stamps = dict(zip(clocks, set_right(list(clocks.values())), strict=True))
    except LogError:  # what seemed a clock is none
        return Together(np.empty(0), np.empty((0, len(series))))
    base = max(stamps.values(), key=lambda one: one.step)
    thin = slice(None, None, 1 + len(base.time) // _MANY)
    ticks = Ticks(base.time[thin], base.run[thin])
    values = np.column_stack([_at(ticks, base, stamps[one.topic], one.values) for one in series])
    steps = np.diff(ticks.time, prepend=ticks.time[:1])
    broken = (np.diff(ticks.run, prepend=ticks.run[:1]) != 0) | (steps > base.limit)
    values[broken] = np.nan
    return Together(np.cumsum(np.where(broken, base.step, steps)), values)


def _at(ticks: Ticks, base: Stamps, stamps: Stamps, values: FloatArray) -> FloatArray:
    """Interpolate the numbers of a topic at ticks."""
    known = np.isfinite(values[stamps.rows])
    kept = {name: getattr(stamps, name)[known] for name in ("rows", "time", "run")}
    stamps = matched(dataclasses.replace(stamps, **kept), base)
    return interpolated(values[stamps.rows], brackets(stamps, ticks))

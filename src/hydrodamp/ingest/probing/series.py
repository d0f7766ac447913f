"""Channels of a recording, each with its clock, and several of them on one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Topic
from hydrodamp.ingest.probing.clocks import Ticking, sane
from hydrodamp.ingest.probing.words import parted, unit_of

_MANY = 60_000  # samples; a longer clock is thinned, as motion is slower than that
_GAP = (5.0, 1.0)  # median steps, and seconds: as in a log


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


def series_of(topic: Topic, clock: Ticking) -> list[Series]:
    """Return the fields of a topic, but its clock."""
    return [
        Series(topic.name, name, unit_of(topic, name), clock.seconds, values)
        for name, values in ((name, sane(values)) for name, values in topic.fields.items())
        if name != clock.column and not _is_stamp(name) and bool(np.isfinite(values).any())
    ]


def _is_stamp(name: str) -> bool:
    """Tell another time beside the clock."""
    return parted(name)[0][-1:] in (("time",), ("timestamp",), ("stamp",)) or "stamp." in name


@dataclass(frozen=True, eq=False)
class Together:
    """Several series on one clock."""

    elapsed: FloatArray
    values: FloatArray


def together(series: Sequence[Series]) -> Together:
    """Bring series to the clock of the slowest of them."""
    base = max(series, key=lambda one: _step(one.seconds)).seconds
    same = all(one.seconds is base for one in series)
    if not same:
        base = _rising(base)[0]
        first = max(float(np.nanmin(one.seconds)) for one in series)
        last = min(float(np.nanmax(one.seconds)) for one in series)
        base = base[(base >= first) & (base <= last)]
    thin = slice(None, None, 1 + len(base) // _MANY)
    base = base[thin]
    columns = [one.values[thin] if same else _at(base, one) for one in series]
    known = np.isfinite(base)
    values = np.column_stack(columns)[known]
    steps = np.diff(base[known], prepend=base[known][:1])
    usual = _step(base)
    broken = (steps < 0.0) | (steps > max(_GAP[0] * usual, _GAP[1]))
    values[broken] = np.nan
    return Together(np.cumsum(np.where(broken, usual, steps)), values)


def _at(base: FloatArray, one: Series) -> FloatArray:
    """Interpolate a series, but not over its gaps."""
    time, kept = _rising(one.seconds)
    values = one.values[kept]
    fine = np.isfinite(values)
    time, values = time[fine], values[fine]
    if len(time) < 2:
        return np.full(len(base), np.nan)
    after = np.clip(np.searchsorted(time, base), 1, len(time) - 1)
    wide = time[after] - time[after - 1] > max(_GAP[0] * _step(time), _GAP[1])
    outside = (base < time[0]) | (base > time[-1])
    return np.where(wide | outside, np.nan, np.interp(base, time, values))


def _rising(time: FloatArray) -> tuple[FloatArray, np.ndarray[tuple[int, ...], np.dtype[np.bool_]]]:
    """Return the times that are later than all before, and which they are."""
    known = np.where(np.isfinite(time), time, -np.inf)
    before = np.concatenate(([-np.inf], np.maximum.accumulate(known)[:-1]))
    kept = known > before
    return time[kept], kept


def _step(time: FloatArray) -> float:
    steps = np.diff(time[np.isfinite(time)])
    ahead = steps[steps > 0.0]
    return float(np.median(ahead)) if len(ahead) else 1.0

"""Which column of a topic is its time, and in what unit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Topic
from hydrodamp.data.units import UNITS
from hydrodamp.ingest.probing.words import unit_of, words

_TIMES = {"time", "timestamp", "t", "stamp", "secs", "seconds", "clock", "elapsed", "timeus"}
_INCREASES = 0.98  # share of steps; the rest are repeats and joins
_EPOCHS = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # 1973 and later, counted from 1970
_LARGEST = 1e30  # of any unit
_SLOW = 5.0  # s, a median step longer than that of any log


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
    if topic.time is not None and np.isfinite(sane(topic.time)).any():
        return Ticking(None, sane(topic.time), "s", 100, "stamped by the file")
    fields = {name: sane(values) for name, values in topic.fields.items()}
    rising = [name for name, values in fields.items() if _share_rising(values) >= _INCREASES]
    if not rising:
        return None
    named = [name for name in rising if _TIMES & set(words(name))]
    if named:
        return _as_clock(topic, named[0], 95, "its name, and it increases")
    steadiest = min(rising, key=lambda name: _unevenness(fields[name]))
    return _as_clock(topic, steadiest, 70, "it increases, by the most even steps")


def sane(values: FloatArray) -> FloatArray:
    """Return numbers without those too large to be measured."""
    return np.where(np.abs(values) < _LARGEST, values, np.nan)


def _as_clock(topic: Topic, name: str, confidence: int, evidence: str) -> Ticking:
    values = sane(topic.fields[name])
    stated = unit_of(topic, name)
    unit = stated if stated in UNITS["time"] else _unit_by_size(values)
    told = f"{evidence}; {unit} by its {'file or name' if stated in UNITS['time'] else 'size'}"
    return Ticking(name, values * UNITS["time"][unit], unit, confidence, told)


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

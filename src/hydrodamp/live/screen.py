"""Which samples of a stream are taken, and where a run begins anew: junk is counted, not fatal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.data.checks import FASTEST
from hydrodamp.data.record import longest_step

#: What becomes of a sample; those of ``BEGIN`` are taken, the first ones of a run.
TAKEN = "taken"
BEGIN = {
    "first": "a first sample",
    "joined": "another segment",
    "gap": "a gap",
    "clock": "a clock that was set back",
    "again": "samples that were left out",
    "leapt": "velocities that leapt and stayed",
}
LEFT_OUT = {
    "unreadable": "not a sample at all",
    "incomplete": "without a time, a velocity, an attitude or a command that is needed",
    "absurd": "with a number beyond all measure",
    "repeated": "with the time of the one before",
    "late": "older than the one before",
    "spike": "with a velocity that leapt",
    "frozen": "with velocities that stood still for seconds",
}

_LATE = 20  # samples in a row with an older time are a clock that was set back
_SPIKES = 3  # samples in a row that leapt are a velocity that changed
_LEAP, _LEAPS = 0.5, 20.0  # m/s or rad/s, and in the usual change from sample to sample
_STILL = 2.0  # s
_RECENT = 25  # steps


class Screen(NamedTuple):
    """What is remembered of samples to judge the next."""

    time: float = math.nan
    velocity: tuple[float, ...] = ()
    segment: str = ""
    steps: tuple[float, ...] = ()
    changes: tuple[float, ...] = (0.0,) * 6  # usual size, from sample to sample
    since: tuple[float, float] = (0.0, 0.0)  # linear and angular velocities stand still
    late: tuple[float, int] = (0.0, 0)  # the last that came late, and how many in a row
    spikes: int = 0
    is_broken: bool = False  # the next one taken begins a run


def judge(
    screen: Screen, time: float, velocity: Sequence[float], segment: str
) -> tuple[Screen, str]:
    """Return what becomes of a sample, and what to remember; NaN is what was not told."""
    if not math.isfinite(time) or not all(map(math.isfinite, velocity)):
        return screen._replace(is_broken=True), "incomplete"
    if max(map(abs, velocity)) > FASTEST:
        return screen._replace(is_broken=True), "absurd"
    now = tuple(velocity)
    if not screen.velocity or segment != screen.segment:
        return _begun(time, now, segment), "joined" if screen.velocity else "first"
    step = time - screen.time
    if step <= 0.0:
        return _late(screen, time, now, step)
    if step > 1.0 and step > longest_step(np.array(screen.steps)):
        return _begun(time, now, segment), "gap"
    change = [abs(new - old) for new, old in zip(now, screen.velocity, strict=True)]
    if any(c > _LEAP and c > _LEAPS * u for c, u in zip(change, screen.changes, strict=True)):
        if screen.spikes + 1 < _SPIKES:
            return screen._replace(spikes=screen.spikes + 1), "spike"
        return _begun(time, now, segment), "leapt"
    usual = tuple(u + 0.01 * (c - u) for c, u in zip(change, screen.changes, strict=True))
    since = (
        screen.since[0] if not any(change[:3]) and any(now[:3]) else time,
        screen.since[1] if not any(change[3:]) and any(now[3:]) else time,
    )
    steps = (*screen.steps[1 - _RECENT :], step)
    is_frozen = time - min(since) > _STILL
    told = "frozen" if is_frozen else "again" if screen.is_broken else TAKEN
    return Screen(time, now, segment, steps, usual, since, is_broken=is_frozen), told


def _begun(time: float, velocity: tuple[float, ...], segment: str) -> Screen:
    return Screen(time, velocity, segment, since=(time, time))


def _late(
    screen: Screen, time: float, velocity: tuple[float, ...], step: float
) -> tuple[Screen, str]:
    """Leave out what is not newer, until so many of them follow one another in order."""
    if step == 0.0:
        return screen, "repeated"
    last, count = screen.late
    count = count + 1 if time > last else 1
    if count < _LATE:
        return screen._replace(late=(time, count)), "late"
    return _begun(time, velocity, screen.segment), "clock"

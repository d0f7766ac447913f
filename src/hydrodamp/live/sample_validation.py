"""Which samples of a stream are taken, and where a run begins anew: junk is counted, not fatal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.data.checks import MAX_VELOCITY
from hydrodamp.data.record import max_step
from hydrodamp.live.ranges import SENTINELS, Ranges

#: What becomes of a sample; those of ``BEGIN`` are taken, the first ones of a run.
TAKEN = "taken"
BEGIN = {
    "first": "a first sample",
    "joined": "another segment",
    "gap": "a gap",
    "clock": "a clock that was set back",
    "again": "samples that were left out",
    "leapt": "velocities, commands or wrenches that leapt and stayed",
}
LEFT_OUT = {
    "unreadable": "that cannot be read",
    "incomplete": "without a time, a velocity, an attitude or a command that is needed",
    "absurd": "with a number beyond all measure",
    "overflow": "that would make the estimate infinite",
    "failed": "that raises an error",
    "repeated": "with the time of the one before",
    "late": "older than the one before",
    "spike": "with a velocity, a command or a wrench that leapt",
    "frozen": "with velocities that stood still for seconds",
}

_LATE = 20  # samples in a row with an older time are a clock that was set back
_SPIKES = 3  # samples in a row that leapt are a velocity that changed
_LEAP, _LEAPS = 0.5, 20.0  # m/s or rad/s, and in the usual change from sample to sample
_INPUT_RATIO = 3.0  # of the largest accepted magnitude, beyond which an input is an outlier
_STILL = 2.0  # s
_RECENT = 25  # steps


class SampleValidator(NamedTuple):
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
    inputs: tuple[float, ...] = ()  # largest accepted magnitudes of commands and wrenches
    before: float | None = None  # s, the time before the gap that began this run


def classify(
    screen: SampleValidator,
    time: float,
    velocity: Sequence[float],
    segment: str,
    inputs: Sequence[float] = (),
    ranges: Ranges = Ranges((), (), ()),  # noqa: B008 - immutable
) -> tuple[SampleValidator, str]:
    """Return what becomes of a sample, and what to remember; NaN is what was not told."""
    if not all(map(math.isfinite, (time, *velocity, *inputs))):
        return screen._replace(is_broken=True), "incomplete"
    beyond = [x for x, most in zip(inputs, ranges.largest, strict=True) if abs(x) > most]
    if beyond or max(map(abs, velocity)) > MAX_VELOCITY:
        is_unknown = beyond and SENTINELS.issuperset(beyond)
        return screen._replace(is_broken=True), "incomplete" if is_unknown else "absurd"
    now, accepted = tuple(velocity), screen.inputs or (0.0,) * len(inputs)
    reached = tuple(max(old, abs(new)) for old, new in zip(accepted, inputs, strict=True))
    step = time - screen.time
    is_next = bool(screen.velocity) and segment == screen.segment
    if is_next and step <= 0.0:
        return _late(screen, time, now, step, reached)
    if screen.velocity and _input_leaps(accepted, inputs, ranges) and screen.spikes + 1 < _SPIKES:
        return screen._replace(spikes=screen.spikes + 1), "spike"
    if not is_next:
        return _begun(time, now, segment, reached), "joined" if screen.velocity else "first"
    if step > 1.0 and step > max_step(np.array(screen.steps)):
        return _begun(time, now, segment, reached)._replace(before=screen.time), "gap"
    change = [abs(new - old) for new, old in zip(now, screen.velocity, strict=True)]
    if any(c > _LEAP and c > _LEAPS * u for c, u in zip(change, screen.changes, strict=True)):
        if screen.spikes + 1 < _SPIKES:
            return screen._replace(spikes=screen.spikes + 1), "spike"
        return _begun(time, now, segment, reached), "leapt"
    if _input_leaps(accepted, inputs, ranges):
        return _begun(time, now, segment, reached), "leapt"
    usual = tuple(u + 0.01 * (c - u) for c, u in zip(change, screen.changes, strict=True))
    since = (
        screen.since[0] if not any(change[:3]) and any(now[:3]) else time,
        screen.since[1] if not any(change[3:]) and any(now[3:]) else time,
    )
    steps = (*screen.steps[1 - _RECENT :], step)
    is_frozen = time - min(since) > _STILL
    told = "frozen" if is_frozen else "again" if screen.is_broken else TAKEN
    before = screen.before if len(steps) < _SPIKES - 1 else None
    rest = is_frozen, reached, before
    return SampleValidator(time, now, segment, steps, usual, since, (0.0, 0), 0, *rest), told


def _input_leaps(accepted: Sequence[float], inputs: Sequence[float], ranges: Ranges) -> bool:
    """Return whether an input is far beyond all accepted ones, and beyond an ordinary one."""
    triples = zip(inputs, accepted, ranges.ordinary, strict=True)
    return any(
        abs(x) > ordinary and abs(x) > _INPUT_RATIO * usual and (usual or ordinary)
        for x, usual, ordinary in triples
    )


def _begun(
    time: float, velocity: tuple[float, ...], segment: str, inputs: tuple[float, ...]
) -> SampleValidator:
    return SampleValidator(time, velocity, segment, since=(time, time), inputs=inputs)


def _late(
    screen: SampleValidator,
    time: float,
    velocity: tuple[float, ...],
    step: float,
    inputs: tuple[float, ...],
) -> tuple[SampleValidator, str]:
    """Leave out what is not newer, until so many of them follow one another in order.

    Where only one or two samples were taken since a gap, and this one continues the clock from
    before it, those came from the future: a run begins at once.
    """
    if step == 0.0:
        return screen, "repeated"
    if screen.before is not None and time > screen.before:
        return _begun(time, velocity, screen.segment, inputs), "clock"
    last, count = screen.late
    count = count + 1 if time > last else 1
    if count < _LATE:
        return screen._replace(late=(time, count)), "late"
    return _begun(time, velocity, screen.segment, inputs), "clock"

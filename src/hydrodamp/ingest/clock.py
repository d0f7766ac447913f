"""Clocks set right, and the values of topics at the ticks of one of them, never over gaps."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import slerp
from hydrodamp.data.record import EPOCH_GAP_S, label_changes, max_step
from hydrodamp.errors import LogError
from hydrodamp.ingest.irregularity import Irregularity, Oddity

#: Share of rows with the stamp of the one before, from which a clock is a coarse one.
COARSE = 0.25

_MOST_RUNS = 200
_STOPPED = 20  # rows, and times the usual number, with the last stamp of all


@dataclass(frozen=True, eq=False)
class Clock:
    """The time stamps of a topic as they stand in the file."""

    topic: str
    time: FloatArray
    labels: Sequence[str] | None = None
    fresh: BoolArray | None = None  # which rows are no copies of the one before
    run: IntArray | None = None  # of each row, where these are some rows of a table

    @cached_property
    def runs(self) -> IntArray:
        """The run that each row belongs to."""
        stamps = set_right(self)
        run = np.zeros(len(self.time), dtype=np.int64)
        run[stamps.rows] = stamps.run
        return np.maximum.accumulate(run)


@dataclass(frozen=True, eq=False)
class Stamps:
    """The usable messages of a topic, in order."""

    rows: IntArray
    time: FloatArray
    run: IntArray
    step: float
    limit: float
    irregularities: tuple[Irregularity, ...] = ()

    def kept(self, keep: BoolArray) -> Stamps:
        """Return some of the messages."""
        if keep.all():
            return self
        rows, time, run = self.rows[keep], self.time[keep], self.run[keep]
        return replace(self, rows=rows, time=time, run=run)


def set_right(clock: Clock) -> Stamps:
    """Return the usable messages of a topic."""
    return _Draft(clock).stamps()


class _Draft:
    """A clock without its absent stamps."""

    def __init__(self, clock: Clock) -> None:
        self.topic, self.irregularities = clock.topic, list[Irregularity]()
        self.rows: IntArray = np.arange(len(clock.time))
        self.time, self.joins = clock.time, label_changes(clock.labels, len(clock.time))
        if clock.run is not None:
            self.joins |= np.diff(clock.run, prepend=clock.run[:1]) != 0
        self._keep(np.isfinite(clock.time), Oddity.ABSENT)
        steps = np.abs(np.diff(self.time))[~self.joins[1:]]
        self.far = max_step(steps[steps > 0.0])  # that no step is, forward or back
        self._spread(clock.fresh)

    def _spread(self, fresh: BoolArray | None) -> None:
        """Spread rows that share a coarse stamp evenly up to the next stamp."""
        if fresh is not None:
            self._keep(fresh[self.rows] | ~_repeats(self.time), Oddity.REPEATED)
        starts = np.flatnonzero(~_repeats(self.time))
        counts = np.diff(np.append(starts, len(self.time)))
        if len(counts) and counts[-1] > _STOPPED * np.median(counts):
            counts[-1] = 1  # no coarse stamp, but the last of all
        if len(counts) < 2 or np.sum(counts - 1) < COARSE * len(self.time):
            return
        steps = np.maximum(np.diff(self.time[starts]), 0.0)
        steps = np.append(steps, np.median(steps))
        block = np.repeat(np.arange(len(starts)), counts)
        self._note(Oddity.COARSE, len(block) - len(starts), int(np.argmax(_repeats(self.time))))
        moved = steps[block] * (np.arange(len(block)) - starts[block]) / counts[block]
        self.time = self.time + np.pad(moved, (0, len(self.time) - len(block)))

    def _keep(self, keep: BoolArray, oddity: Oddity) -> None:
        """Drop what is not kept, and say so."""
        if keep.all():
            return
        dropped = np.flatnonzero(~keep)
        self._note(oddity, len(dropped), dropped[0])
        # A join among the dropped ones passes to the next that stays.
        begun = np.cumsum(self.joins)[keep]
        self.rows, self.time = self.rows[keep], self.time[keep]
        self.joins = np.append(False, np.diff(begun) > 0)[: len(begun)]

    def _note(self, oddity: Oddity, count: int, place: int) -> None:
        self.irregularities.append(Irregularity(self.topic, oddity, count, float(self.time[place])))

    def stamps(self) -> Stamps:
        """Return the messages in order, in runs, and say where they pause."""
        run: IntArray = np.cumsum(self._restarts(), dtype=np.int64)
        ordered = self._in_order(self.time, run)
        keep = slice(None) if ordered.all() else ordered
        rows, time, run = self.rows[keep], self.time[keep], run[keep]
        steps = np.diff(time)
        inside = run[1:] == run[:-1]
        step = float(np.median(steps[inside])) if inside.any() else 0.0
        limit = max_step(steps[inside])
        if len(late := np.flatnonzero((steps > limit) & inside)):
            pause = Irregularity(self.topic, Oddity.DROPOUT, len(late), float(time[late[0]]), limit)
            self.irregularities.append(pause)
        return Stamps(rows, time, run, step, limit, tuple(self.irregularities))

    def _restarts(self) -> BoolArray:
        """Find where the clock runs anew: at a join, set back far, or leapt to another epoch."""
        steps = np.append(0.0, np.diff(self.time))[: len(self.time)]
        anew = ((steps < -self.far) | (steps > EPOCH_GAP_S)) & ~self.joins
        count = int(np.count_nonzero(anew))
        if count > _MOST_RUNS:
            of = f" of `{self.topic}`" if self.topic else ""
            raise LogError(
                f"the clock{of} leaps {count} times; it is no clock. Name another in `time`"
            )
        if count:
            self._note(Oddity.LEAP, count, int(np.argmax(anew)))
        return np.asarray(anew | (self.joins & (steps <= 0)))

    def _in_order(self, time: FloatArray, run: IntArray) -> BoolArray:
        """Keep the messages later than all before them in their run."""
        edges = np.flatnonzero(np.diff(run)) + 1
        latest = np.concatenate([np.maximum.accumulate(part) for part in np.split(time, edges)])
        before = np.append(-np.inf, latest[:-1])
        before[edges] = -np.inf
        repeated = time == before
        tail = len(time) - int(np.flatnonzero(~repeated)[-1]) - 1 if len(time) else 0
        stopped = np.arange(len(time)) >= len(time) - (tail if tail > _STOPPED else 0)
        for oddity, odd in (
            (Oddity.REPEATED, repeated & ~stopped),
            (Oddity.STOPPED, stopped),
            (Oddity.LATE, time < before),
        ):
            if odd.any():
                self._note(oddity, int(np.count_nonzero(odd)), int(np.argmax(odd)))
        return np.asarray(time > before)


def _repeats(time: FloatArray) -> BoolArray:
    return np.append(False, np.diff(time) == 0)[: len(time)]


class Ticks(NamedTuple):
    """The times that all topics are brought to."""

    time: FloatArray
    run: IntArray


class Brackets(NamedTuple):
    """Between which messages each tick lies, runs side by side."""

    messages: FloatArray
    ticks: FloatArray
    before: IntArray
    unknown: BoolArray
    spent: BoolArray
    early: BoolArray


def brackets(stamps: Stamps, ticks: Ticks) -> Brackets:
    """Return between which messages, at least one, each tick lies."""
    messages, wanted = _side_by_side(stamps, ticks)
    # Faster than a binary search for each, as both are in order; rounding may reach the next.
    index = np.interp(wanted, messages, np.arange(float(len(messages)))).astype(np.int64)
    index -= (messages[index] > wanted) & (index > 0)
    since = wanted - messages[index]
    early = (since < 0) | (stamps.run[index] != ticks.run)
    ends = np.append(np.diff(stamps.run) != 0, True)
    gaps = np.append(np.diff(messages) > stamps.limit, True) | ends
    unknown = early | ((since > 0) & gaps[index])
    spent = unknown & (early | ~ends[index] | (since > stamps.step))
    return Brackets(messages, wanted, index, unknown, spent, early)


def _side_by_side(stamps: Stamps, ticks: Ticks) -> tuple[FloatArray, FloatArray]:
    """Return both times with each run behind the one before, also where a clock was set back."""
    if stamps.run[-1] == ticks.run[-1] == 0:
        return stamps.time, ticks.time  # a single run, as nearly always
    edges = [edge for time in (stamps.time, ticks.time) for edge in (time.min(), time.max())]
    span = max(edges) - min(edges) + 1.0
    return stamps.time + span * stamps.run, ticks.time + span * ticks.run


def interpolated(values: FloatArray, found: Brackets) -> FloatArray:
    """Return values between messages on a straight line."""
    taken: FloatArray = np.interp(found.ticks, found.messages, values)
    taken[found.unknown] = np.nan
    return taken


def held(values: FloatArray, found: Brackets, *, until_next: bool = False) -> FloatArray:
    """Return the value of the last message before each tick."""
    taken = values[found.before]
    taken[found.early if until_next else found.spent] = np.nan
    return taken


def turned(quaternions: FloatArray, found: Brackets) -> FloatArray:
    """Return attitudes between messages, turned at a constant rate."""
    after = np.minimum(found.before + 1, len(quaternions) - 1)
    begun, ended = found.messages[found.before], found.messages[after]
    share = (found.ticks - begun) / np.where(ended > begun, ended - begun, 1.0)
    share[found.unknown] = np.nan
    return slerp(quaternions[found.before], quaternions[after], share)


def at_rate(stamps: Stamps, rate: float) -> Ticks:
    """Return evenly spaced ticks over the runs of a topic."""
    times, runs = [], []
    for number, place in parts_of(stamps.run):
        first, last = stamps.time[place][[0, -1]].tolist()
        # A little more, so that rounding does not cost the last tick.
        count = int((last - first) * rate * (1 + 1e-12) + 1e-9) + 1
        times.append(np.minimum(first + np.arange(count) / rate, last))
        runs.append(np.full(count, number))
    return Ticks(np.concatenate(times), np.concatenate(runs))


def matched(stamps: Stamps, base: Stamps) -> Stamps:
    """Return the runs of a topic that the base has too, numbered as there."""
    own, its = parts_of(stamps.run), parts_of(base.run)
    if len(own) == len(its):
        places = [*range(len(own))]
    else:
        places = _by_overlap(
            *(
                [t.time[[a.start, a.stop - 1]].tolist() for _, a in parts]
                for t, parts in ((stamps, own), (base, its))
            )
        )
    numbers = [*(number for number, _ in its), -1]
    lengths = [place.stop - place.start for _, place in own]
    run = np.repeat(np.array([numbers[place] for place in places], np.int64), lengths)
    return replace(stamps, run=run).kept(run >= 0)


def _by_overlap(own: Sequence[Sequence[float]], its: Sequence[Sequence[float]]) -> list[int]:
    """Return for every span that of the others, in order, with most in common; -1 for none."""
    places: list[int] = []
    for first, last in own:
        least = places[-1] + 1 if places else 0
        shared = [min(last, b) - max(first, a) for a, b in its[least:]]
        places.append(least + int(np.argmax(shared)) if shared else len(its))
    return places


def parts_of(run: IntArray) -> list[tuple[int, slice]]:
    """Return every run of consecutive equal numbers and where it lies."""
    if len(run) == 0:
        return []
    edges = [0, *(np.flatnonzero(np.diff(run)) + 1).tolist(), len(run)]
    return [(int(run[a]), slice(a, b)) for a, b in itertools.pairwise(edges)]

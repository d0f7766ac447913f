"""One clock for all topics, and their values on it: interpolated, held, turned, never over gaps."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import between
from hydrodamp.ingest.clock.stamps import Stamps


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
    if stamps.run[0] == ticks.run[0] and stamps.run[-1] == ticks.run[-1] == ticks.run[0]:
        return stamps.time, ticks.time  # a single run, as nearly always
    numbers = np.union1d(stamps.run, ticks.run).tolist()
    shifts, reached = np.zeros(numbers[-1] + 1), -np.inf
    for number in numbers:
        both = np.append(stamps.time[stamps.run == number], ticks.time[ticks.run == number])
        shifts[number] = max(0.0, reached + 1.0 - float(both.min()))
        reached = float(both.max()) + shifts[number]
    return stamps.time + shifts[stamps.run], ticks.time + shifts[ticks.run]


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
    share = interpolated(np.arange(float(len(quaternions))), found) - found.before
    return between(quaternions[found.before], quaternions[after], share)


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
    return dataclasses.replace(stamps, run=run).kept(run >= 0)


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

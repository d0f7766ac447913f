"""One clock for all topics, and their values on it: interpolated, held, turned, never over gaps."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import between
from hydrodamp.ingest.clock.stamps import Stamps


@dataclass(frozen=True, eq=False)
class Ticks:
    """The times that all topics are brought to."""

    time: FloatArray
    run: IntArray


@dataclass(frozen=True, eq=False)
class Brackets:
    """Between which messages each tick lies."""

    messages: tuple[slice, ...]
    ticks: tuple[slice, ...]
    times: tuple[tuple[FloatArray, FloatArray], ...]
    before: IntArray
    unknown: BoolArray
    spent: BoolArray
    early: BoolArray


def brackets(stamps: Stamps, ticks: Ticks) -> Brackets:
    """Return between which messages each tick lies."""
    n = len(ticks.time)
    own = {number: place for number, place in parts_of(stamps.run) if number >= 0}
    pairs = [(own[number], place) for number, place in parts_of(ticks.run) if number in own]
    before = np.zeros(n, np.int64)
    unknown, spent, early = (np.ones(n, np.bool_) for _ in range(3))
    times = tuple((stamps.time[mine], ticks.time[its]) for mine, its in pairs)
    for (mine, its), (messages, wanted) in zip(pairs, times, strict=True):
        index, unknown[its], spent[its], early[its] = _within(stamps, messages, wanted)
        before[its] = index + mine.start
    places = tuple(one for one, _ in pairs), tuple(one for _, one in pairs)
    return Brackets(*places, times, before, unknown, spent, early)


def _within(
    stamps: Stamps, messages: FloatArray, wanted: FloatArray
) -> tuple[IntArray, BoolArray, BoolArray, BoolArray]:
    """Return the message before each tick of one stretch, and where it is of no use."""
    last = len(messages) - 1
    # Faster than a binary search for each, as both are in order; rounding may reach the next.
    index = np.interp(wanted, messages, np.arange(float(len(messages)))).astype(np.int64)
    index -= (messages[index] > wanted) & (index > 0)
    since = wanted - messages[index]
    early = since < 0
    beyond = since > 0
    gaps = np.append(np.diff(messages) > stamps.limit, True)
    unknown = early | (beyond & gaps[index])
    spent = unknown & ~((index == last) & beyond & (since <= stamps.step))
    return index, unknown, spent, early


def interpolated(values: FloatArray, found: Brackets) -> FloatArray:
    """Return values between messages on a straight line."""
    taken = np.empty(len(found.before))
    for mine, its, (messages, wanted) in zip(found.messages, found.ticks, found.times, strict=True):
        taken[its] = np.interp(wanted, messages, values[mine])
    taken[found.unknown] = np.nan
    return taken


def held(values: FloatArray, found: Brackets, *, until_next: bool = False) -> FloatArray:
    """Return the value of the last message before each tick."""
    if len(values) == 0:
        return np.full(len(found.before), np.nan)
    taken = values[found.before]
    taken[found.early if until_next else found.spent] = np.nan
    return taken


def turned(quaternions: FloatArray, found: Brackets) -> FloatArray:
    """Return attitudes between messages, turned at a constant rate."""
    if len(quaternions) == 0:
        return np.full((len(found.before), 4), np.nan)
    after = np.minimum(found.before + 1, len(quaternions) - 1)
    share = interpolated(np.arange(float(len(quaternions))), found) - found.before
    return between(quaternions[found.before], quaternions[after], share)


def fastest(clocks: Mapping[int, Stamps]) -> int:
    """Return the topic with the shortest median step."""
    return min(clocks, key=lambda topic: clocks[topic].step or np.inf)


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
    """Return a topic with its runs numbered as those of the base."""
    own, its = parts_of(stamps.run), parts_of(base.run)
    if len(own) == len(its):
        numbers = [number for number, _ in its]
    else:
        spans = [_span(base, place) for _, place in its]
        found = _by_overlap([_span(stamps, place) for _, place in own], spans)
        numbers = [its[index][0] if index < len(its) else -1 for index in found]
    lengths = [place.stop - place.start for _, place in own]
    run = np.repeat(np.array(numbers, np.int64), lengths)
    return dataclasses.replace(stamps, run=run)


def _span(stamps: Stamps, place: slice) -> tuple[float, float]:
    return float(stamps.time[place.start]), float(stamps.time[place.stop - 1])


def _by_overlap(
    own: Sequence[tuple[float, float]], its: Sequence[tuple[float, float]]
) -> list[int]:
    numbers: list[int] = []
    for first, last in own:
        least = numbers[-1] + 1 if numbers else 0
        shared = [min(last, b) - max(first, a) for a, b in its[least:]]
        numbers.append(least + int(np.argmax(shared)) if shared else len(its))
    return numbers


def parts_of(run: IntArray) -> list[tuple[int, slice]]:
    """Return every run of consecutive equal numbers and where it lies."""
    if len(run) == 0:
        return []
    edges = [0, *(np.flatnonzero(np.diff(run)) + 1).tolist(), len(run)]
    return [(int(run[a]), slice(a, b)) for a, b in itertools.pairwise(edges)]

"""Whose clock all topics follow, and which runs of the others belong to its runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from hydrodamp.ingest.clock.sampling import Ticks, parts_of
from hydrodamp.ingest.clock.stamps import Stamps


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

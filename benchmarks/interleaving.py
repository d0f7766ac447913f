"""Two sides in turn, so that a busy machine slows both alike."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from statistics import median as middle

Call = Callable[[], object]


@dataclass
class Watch:
    """A call that keeps its times."""

    call: Call
    clock: Callable[[], float]
    times: list[float] = field(default_factory=list)

    def __call__(self) -> object:
        start = self.clock()
        result = self.call()
        self.times.append(self.clock() - start)
        return result

    @property
    def median(self) -> float:
        return middle(self.times)

    @property
    def best(self) -> float:
        return min(self.times)


def interleaved(
    benchmark,
    ours: Call,
    other: Call,
    *,
    rounds: int = 5,
    other_rounds: int | None = None,
) -> tuple[float, float]:
    """Return the median CPU times [s] of both sides; other work hardly touches them.

    The other side runs before each of our rounds, or before ``other_rounds`` of
    them only where it takes long. Both run once beforehand, unless the other
    side runs only once. pytest-benchmark keeps the wall times of ours.
    """
    mine, theirs = _in_turn(benchmark, ours, other, rounds, other_rounds, time.process_time)
    return mine.median, theirs.median


def on_all_cores(benchmark, ours: Call, other: Call, *, rounds: int = 9) -> tuple[Watch, Watch]:
    """Return the wall times of both sides: the shortest count, for others only lengthen them."""
    return _in_turn(benchmark, ours, other, rounds, None, time.perf_counter)


def _in_turn(
    benchmark,
    ours: Call,
    other: Call,
    rounds: int,
    other_rounds: int | None,
    clock: Callable[[], float],
) -> tuple[Watch, Watch]:
    limit = rounds if other_rounds is None else other_rounds
    mine, theirs = Watch(ours, clock), Watch(other, clock)
    ours()
    if limit > 1:
        other()

    def before() -> None:
        if len(theirs.times) < limit:
            theirs()

    benchmark.pedantic(mine, setup=before, rounds=rounds, iterations=1)
    return mine, theirs

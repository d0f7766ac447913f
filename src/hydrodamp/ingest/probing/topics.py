"""Topics in numbers: how many messages, how often, with what gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.ingest.probing.clocks import Ticking, ticking


@dataclass(frozen=True)
class TopicFacts:
    """One topic of a recording."""

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


def topics_of(recording: Recording) -> tuple[TopicFacts, ...]:
    """Return the facts about every topic."""
    return tuple(_facts(topic, ticking(topic)) for topic in recording.topics)


def _facts(topic: Topic, clock: Ticking | None) -> TopicFacts:
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

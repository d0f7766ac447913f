"""Irregularities of the timestamps of a topic, described in one sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum

from hydrodamp.text import format_time


class IrregularityKind(Enum):
    """Kind of irregularity; the value is the template of its sentence."""

    MISSING = "{count} without a timestamp, dropped"
    REPEATED = "{count} with a duplicate timestamp, dropped (first at {first_time})"
    COARSE = (
        "{count} with new values but the timestamp of the previous one: the resolution of the clock"
        " is coarse; they were spaced evenly up to the next timestamp (first at {first_time})"
    )
    STOPPED = (
        "the clock stops at {first_time}; {count} after it were dropped. If they are evenly"
        " sampled, set `time: {{rate: HERTZ}}` in the mapping"
    )
    OUT_OF_ORDER = "{count} out of order, dropped (first at {first_time})"
    RESET = (
        "the clock was reset or changed its epoch {times}; a segment begins there (first at"
        " {first_time})"
    )
    DROPOUT = "{times} no message for longer than {limit:.3g} s (first after {first_time})"
    INVALID = "{count} without a value of {channel}, dropped (first at {first_time})"


@dataclass(frozen=True)
class Irregularity:
    """Irregularities of one kind in one topic: count, time of the first [s], longest step [s]."""

    topic: str
    kind: IrregularityKind
    count: int
    first_time: float
    limit: float = 0.0
    channel: str = ""

    def describe(self, first: float = 0.0) -> str:
        """Return the sentence; times count from the first sample of the log."""
        noun = "message" if self.topic else "row"
        return self.kind.value.format(
            count=f"{self.count} {noun}{'s' if self.count != 1 else ''}",
            times="once" if self.count == 1 else f"{self.count} times",
            first_time=format_time(self.first_time, first),
            limit=self.limit,
            channel=self.channel,
        )


def describe_irregularities(
    irregularities: Iterable[Irregularity], first: float
) -> Iterator[tuple[IrregularityKind, str]]:
    """Yield each distinct sentence once, with the topics it applies to."""
    topics: dict[tuple[IrregularityKind, str], list[str]] = {}
    for irregularity in irregularities:
        topics.setdefault((irregularity.kind, irregularity.describe(first)), []).append(
            irregularity.topic
        )
    for (kind, sentence), names in topics.items():
        listed = " ".join(f"`{name}`" for name in names if name)
        yield kind, f"{listed}: {sentence}" if listed else sentence

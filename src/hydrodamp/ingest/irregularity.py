"""What can be odd about the time stamps of a topic, a sentence each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum

from hydrodamp.text import format_time


class Oddity(Enum):
    """What can be odd about time stamps; the value is the sentence on it."""

    ABSENT = "{count} without a time stamp, dropped"
    REPEATED = "{count} with a repeated time stamp, dropped (first at {at})"
    COARSE = (
        "{count} with the stamp of the one before, though they say something new: the clock is"
        " coarse, and they were spread evenly up to the next stamp (first at {at})"
    )
    STOPPED = (
        "the clock stands still at {at}, and {count} after it were dropped. If they came"
        " evenly, `time: {{rate: HERTZ}}` in the mapping counts them"
    )
    LATE = "{count} out of order, dropped (first at {at})"
    LEAP = (
        "the clock was set back or to another epoch {times}, where a segment begins (first at {at})"
    )
    DROPOUT = "{times} no message for longer than {limit:.3g} s (first after {at})"
    EMPTY = "{count} without a number of {what}, dropped (first at {at})"


@dataclass(frozen=True)
class Irregularity:
    """One kind of oddity in one topic."""

    topic: str
    oddity: Oddity
    count: int
    at: float
    limit: float = 0.0
    what: str = ""

    def describe(self, first: float = 0.0) -> str:
        """Return what is odd; times count from the first sample of the log."""
        thing = "message" if self.topic else "row"
        return self.oddity.value.format(
            count=f"{self.count} {thing}{'s' if self.count != 1 else ''}",
            times="once" if self.count == 1 else f"{self.count} times",
            at=format_time(self.at, first),
            limit=self.limit,
            what=self.what,
        )


def sentences(found: Iterable[Irregularity], first: float) -> Iterator[tuple[Oddity, str]]:
    """Yield one sentence on every oddity, with all topics of which it is true."""
    topics: dict[tuple[Oddity, str], list[str]] = {}
    for one in found:
        topics.setdefault((one.oddity, one.describe(first)), []).append(one.topic)
    for (oddity, told), names in topics.items():
        whose = " ".join(f"`{name}`" for name in names if name)
        yield oddity, f"{whose}: {told}" if whose else told

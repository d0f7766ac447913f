"""What was met in the clocks of a recording, counted, and told in sentences."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Oddity(Enum):
    """What can be odd about time stamps; the value is the sentence told of it."""

    ABSENT = "{count} without a time stamp, dropped"
    STRAY = "{count} with a stray time stamp, dropped (first at {at:.10g} s)"
    REPEATED = "{count} with a repeated time stamp, dropped (first at {at:.10g} s)"
    LATE = "{count} out of order, dropped (first at {at:.10g} s)"
    SET_BACK = "the clock was set back {times}, where a segment begins (first at {at:.10g} s)"
    LEAP = (
        "the clock leaps to another epoch {times}, where a segment begins (first at {at:.10g} s);"
        " what came before was moved up to it"
    )
    DROPOUT = "{times} no message for longer than {limit:.3g} s (first after {at:.10g} s)"
    EMPTY = "{count} without a number of {what}, dropped (first at {at:.10g} s)"


@dataclass(frozen=True)
class Met:
    """One kind of oddity in one topic."""

    topic: str
    oddity: Oddity
    count: int
    at: float
    limit: float = 0.0
    what: str = ""

    def __str__(self) -> str:
        """Return one sentence."""
        thing = "message" if self.topic else "row"
        told = self.oddity.value.format(
            count=f"{self.count} {thing}{'s' if self.count != 1 else ''}",
            times="once" if self.count == 1 else f"{self.count} times",
            at=self.at,
            limit=self.limit,
            what=self.what,
        )
        return f"`{self.topic}`: {told}" if self.topic else told

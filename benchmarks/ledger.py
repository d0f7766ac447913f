"""What was measured: two sides, their ratio, and what was asked for."""

from __future__ import annotations

import os
from dataclasses import dataclass, field

HEADINGS = ("what", "unit", "ours", "other", "ratio", "target", "met")


@dataclass(frozen=True)
class Entry:
    """One line of the final table."""

    what: str
    unit: str
    ours: float
    other: float
    ratio: float
    target: str
    met: bool | None

    def cells(self) -> tuple[str, ...]:
        verdict = {None: "", True: "yes", False: "NO"}[self.met]
        numbers = (f"{number:.3g}" for number in (self.ours, self.other))
        ratio = f"{self.ratio:.0f}" if self.ratio >= 100 else f"{self.ratio:.2f}"
        return (self.what, self.unit, *numbers, ratio, self.target, verdict)


@dataclass
class Ledger:
    """The lines in the order they were measured."""

    entries: list[Entry] = field(default_factory=list)

    def faster(
        self, what: str, ours: float, other: float, *, target: float | None = None, unit: str = "s"
    ) -> None:
        """Enter how many times ours goes into the other: more is better."""
        ratio = other / ours
        wanted = "" if target is None else f">= {target:g}"
        met = None if target is None else ratio >= target
        self.entries.append(Entry(what, unit, ours, other, ratio, wanted, met))

    def within(
        self, what: str, ours: float, other: float, *, target: float | None = None, unit: str = "s"
    ) -> None:
        """Enter how many times the other goes into ours: less is better."""
        ratio = ours / other
        wanted = "" if target is None else f"<= {target:g}"
        met = None if target is None else ratio <= target
        self.entries.append(Entry(what, unit, ours, other, ratio, wanted, met))

    def reaches(
        self, what: str, ours: float, other: float, *, target: float | None = None, unit: str
    ) -> None:
        """Enter what share of the other ours reaches: more is better."""
        ratio = ours / other
        wanted = "" if target is None else f">= {target:g}"
        met = None if target is None else ratio >= target
        self.entries.append(Entry(what, unit, ours, other, ratio, wanted, met))

    def markdown(self) -> str:
        """Return the table for a page."""
        rows = [HEADINGS, ("---",) * len(HEADINGS), *(entry.cells() for entry in self.entries)]
        return "".join(f"| {' | '.join(row)} |\n" for row in rows)

    def lines(self) -> list[str]:
        """Return the table, and how busy the machine was."""
        if not self.entries:
            return []
        table = [HEADINGS, *(entry.cells() for entry in self.entries)]
        widths = [max(len(row[k]) for row in table) for k in range(len(HEADINGS))]
        lines = [
            "  ".join(
                cell.ljust(width) if k < 2 else cell.rjust(width)
                for k, (cell, width) in enumerate(zip(row, widths, strict=True))
            )
            for row in table
        ]
        if hasattr(os, "getloadavg"):
            load = " ".join(f"{value:.1f}" for value in os.getloadavg())
            lines.append(f"load over 1, 5 and 15 minutes: {load}, on {os.cpu_count()} cores")
        return lines

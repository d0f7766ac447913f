"""Lists, names and times in messages."""

from __future__ import annotations

from collections.abc import Iterable

_CENTISECOND = 0.005  # s, what two digits round to


def first_few(sentences: list[str], most: int, what: str) -> list[str]:
    """Return the first sentences of many, and how many more there are."""
    more = len(sentences) - most
    return sentences if more <= 0 else [*sentences[:most], f"... and {more} more {what}"]


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names; a repeated name gets a number: ``dive``, ``dive-2``."""
    unique: dict[str, None] = {}
    for name in names:
        candidate, count = name, 1
        while candidate in unique:
            count += 1
            candidate = f"{name}-{count}"
        unique[candidate] = None
    return tuple(unique)


def format_time(time: float, first: float) -> str:
    """Return a time counted from the first sample, and on the clock of the log if it differs."""
    clock = f" (by the clock {time:.3f} s)" if abs(first) >= _CENTISECOND else ""
    return f"{time - first:.2f} s{clock}"

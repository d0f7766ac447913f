"""MOOS logs (``.alog``): a line a posting, with time, variable, source and value."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import column_of, number
from hydrodamp.ingest.formats.content import content

_LISTED = 3


@dataclass
class _Postings:
    """The postings of one variable."""

    times: list[float] = field(default_factory=list)
    sources: list[str] = field(default_factory=list)
    values: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)


def read(path: str | Path) -> Recording:
    """Read an ``.alog`` file."""
    postings: dict[str, _Postings] = defaultdict(_Postings)
    odd: list[int] = []
    notes: list[str] = []
    text = content(path).decode("utf-8", errors="replace")
    for line, entry in enumerate(text.split("\n"), start=1):
        words = entry.split(None, 3)
        if entry.startswith("%"):
            if words[1:2] == ["LOGSTART"] and len(words) > 2:
                notes.append(f"times count from {words[2]} s since 1970")
            continue
        time = number(words[0]) if len(words) >= 3 else None
        if time is None or not np.isfinite(time):
            odd += [line] if entry.strip("\0\r \t") else []
            continue
        found = postings[words[1]]
        found.times.append(time)
        found.sources.append(words[2])
        found.values.append(words[3].rstrip("\r\0 ") if len(words) > 3 else "")
        found.lines.append(line)
    n = sum(len(found.times) for found in postings.values())
    told = ", ".join(map(str, odd[:_LISTED])) + (" …" if len(odd) > _LISTED else "")
    if not n or len(odd) > n:
        raise LogError(
            f"{len(odd)} lines ({told or 'none at all'}) and only {n} postings: this is no MOOS log"
            " of `time variable source value`. Give it the name of the format it has",
            source=str(path),
        )
    if odd:
        notes.append(f"{len(odd)} lines are no postings (line {told}); passed over")
    topics = tuple(_topic(name, found, notes) for name, found in postings.items())
    return Recording(topics, str(path), "MOOS log", tuple(notes))


def _topic(name: str, found: _Postings, notes: list[str]) -> Topic:
    pairs = [_pairs(value) for value in found.values]
    if all(pairs):
        keys = dict.fromkeys(key for row in pairs for key in row)
        columns = {key: column_of([row.get(key, "") for row in pairs]) for key in keys}
    else:
        columns = {"value": column_of(found.values)}
    faults = {
        key: column.fault(f"`{name}.{key}`", found.lines)
        for key, column in columns.items()
        if column.bad
    }
    notes += faults.values()
    return Topic(
        name,
        np.array(found.times),
        {
            key: column.numbers
            for key, column in columns.items()
            if column.numbers is not None and key not in faults
        },
        {"source": tuple(found.sources)}
        | {key: column.words for key, column in columns.items() if column.words},
        faults=faults,
        lines=found.lines,
    )


def _pairs(value: str) -> dict[str, str]:
    """Return the keys and values of ``X=1,Y=2``; none where the text is no such list."""
    pairs: dict[str, str] = {}
    for part in value.strip("\"' ").split(","):
        key, equals, word = part.partition("=")
        if not equals or not key.strip() or key.strip() in pairs:
            return {}
        pairs[key.strip()] = word.strip()
    return pairs

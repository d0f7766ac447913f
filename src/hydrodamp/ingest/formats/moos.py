"""MOOS logs (``.alog``): a line a posting, with time, variable, source and value."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hydrodamp.advance import counted, within
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, column_of, number
from hydrodamp.ingest.formats.content import content

FORMAT = "MOOS log"
"""How messages call the format."""

_LISTED = 3
_TAKEN = 0.6  # what share of the time it takes to sort lines by variable
_TOLD = 10_000  # after how many lines it is told


def read(path: str | Path) -> Recording:
    """Read an ``.alog`` file."""
    postings: dict[str, _Postings] = defaultdict(_Postings)
    odd: list[int] = []
    notes: list[str] = []
    lines = content(path).decode("utf-8", errors="replace").split("\n")
    with within(0.0, _TAKEN):
        for line, entry in enumerate(counted(lines, len(lines), _TOLD), start=1):
            if entry.startswith("%"):
                _note_start(entry, notes)
            elif entry.strip("\0\r \t") and not _take(entry, line, postings):
                odd.append(line)
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
    with within(_TAKEN, 1.0):
        variables = counted(postings.items(), len(postings))
        topics = tuple(found.topic(name, notes) for name, found in variables)
    return Recording(topics, str(path), FORMAT, tuple(notes))


def _note_start(entry: str, notes: list[str]) -> None:
    words = entry.split()
    if words[1:2] == ["LOGSTART"] and len(words) > 2:
        notes.append(f"times count from {words[2]} s since 1970")


def _take(entry: str, line: int, postings: dict[str, _Postings]) -> bool:
    """Put a posting to its variable; return False where the line is none."""
    words = entry.split(None, 3)
    time = number(words[0]) if len(words) >= 3 else None
    if time is None or not np.isfinite(time):
        return False
    found = postings[words[1]]
    found.times.append(time)
    found.sources.append(words[2])
    found.values.append(words[3].rstrip("\r\0 ") if len(words) > 3 else "")
    found.lines.append(line)
    return True


@dataclass
class _Postings:
    """What was posted to one variable."""

    times: list[float] = field(default_factory=list)
    sources: list[str] = field(default_factory=list)
    values: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)

    def topic(self, name: str, notes: list[str]) -> Topic:
        pairs = [_pairs(value) for value in self.values]
        if all(pairs):
            columns = {key: _part(pairs, key) for row in pairs for key in row}
        else:
            columns = {"value": column_of(self.values)}
        faults = {
            key: self._fault(name, key, column) for key, column in columns.items() if column.bad
        }
        notes += faults.values()
        return Topic(
            name,
            np.array(self.times),
            {
                key: column.numbers
                for key, column in columns.items()
                if column.numbers is not None and key not in faults
            },
            {"source": tuple(self.sources)}
            | {key: column.words for key, column in columns.items() if column.words},
            faults=faults,
            lines=self.lines,
        )

    def _fault(self, name: str, key: str, column: Column) -> str:
        places = [f"{cell!r} in line {self.lines[row]}" for row, cell in column.bad[:_LISTED]]
        more = len(column.bad) - _LISTED
        tail = f" and {more} more" if more > 0 else ""
        return f"`{name}.{key}` must hold numbers; got {', '.join(places)}{tail}"


def _pairs(value: str) -> dict[str, str]:
    """Return the keys and values of ``X=1,Y=2``; none where the text is no such list."""
    pairs: dict[str, str] = {}
    for part in value.strip("\"' ").split(","):
        key, equals, word = part.partition("=")
        if not equals or not key.strip() or key.strip() in pairs:
            return {}
        pairs[key.strip()] = word.strip()
    return pairs


def _part(pairs: Sequence[dict[str, str]], key: str) -> Column:
    return column_of([row.get(key, "") for row in pairs])

"""MOOS logs (``.alog``): a line a posting, with time, variable, source and value."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, column_of, number, topic_of
from hydrodamp.ingest.formats.content import content

_LISTED = 3

_Posting = tuple[float, str, str, int]  # time, source, value and line


def read(path: str | Path) -> Recording:
    """Read an ``.alog`` file."""
    postings: dict[str, list[_Posting]] = defaultdict(list)
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
        value = words[3].rstrip("\r\0 ") if len(words) > 3 else ""
        postings[words[1]].append((time, words[2], value, line))
    n = sum(map(len, postings.values()))
    told = ", ".join(map(str, odd[:_LISTED])) + (" …" if len(odd) > _LISTED else "")
    if not n or len(odd) > n:
        raise LogError(
            f"{len(odd)} lines ({told or 'none at all'}) and only {n} postings: this is no MOOS log"
            " of `time variable source value`. Give it the name of the format it has",
            source=str(path),
        )
    if odd:
        notes.append(f"{len(odd)} lines are no postings (line {told}); passed over")
    topics = tuple(_topic(name, found) for name, found in postings.items())
    notes += [fault for topic in topics for fault in topic.faults.values()]
    return Recording(topics, str(path), "MOOS log", tuple(notes))


def _topic(name: str, found: list[_Posting]) -> Topic:
    times, sources, values, lines = zip(*found, strict=True)
    columns = {"source": Column(None, sources), "value": column_of(values)}
    return topic_of(name, columns, lines, time=np.array(times))

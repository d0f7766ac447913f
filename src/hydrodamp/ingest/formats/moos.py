"""MOOS logs (``.alog``): one posting per line, `time variable source value`."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

import numpy as np

from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import LogError
from hydrodamp.ingest.formats.cells import Column, make_topic, parse_column, parse_number
from hydrodamp.ingest.formats.content import read_bytes

_MAX_LISTED = 3

_Posting = tuple[float, str, str, int]  # time [s], source, value, line number


def read_file(path: str | Path) -> Recording:
    """Read an ``.alog`` file."""
    postings: dict[str, list[_Posting]] = defaultdict(list)
    invalid: list[int] = []
    notes: list[str] = []
    text = read_bytes(path).decode("utf-8", errors="replace")
    for line, entry in enumerate(text.split("\n"), start=1):
        fields = entry.split(None, 3)
        if entry.startswith("%"):
            if fields[1:2] == ["LOGSTART"] and len(fields) > 2:
                notes.append(f"times count from {fields[2]} s since 1970")
            continue
        time = parse_number(fields[0]) if len(fields) >= 3 else None
        if time is None or not np.isfinite(time):
            invalid += [line] if entry.strip("\0\r \t") else []
            continue
        value = fields[3].rstrip("\r\0 ") if len(fields) > 3 else ""
        postings[fields[1]].append((time, fields[2], value, line))
    n = sum(map(len, postings.values()))
    examples = ", ".join([*map(str, invalid[:_MAX_LISTED]), *["…"][: len(invalid) - _MAX_LISTED]])
    if not n or len(invalid) > n:
        raise LogError(
            f"expected lines `time variable source value` of a MOOS log; found {n} such lines and"
            f" {len(invalid)} others ({examples or 'none'}). If the file has another format, give"
            " it that format's suffix",
            source=str(path),
        )
    if invalid:
        notes.append(f"{len(invalid)} lines are no postings (line {examples}); skipped")
    topics = tuple(_make_topic(name, posted) for name, posted in postings.items())
    notes += [fault for topic in topics for fault in topic.faults.values()]
    return Recording(topics, str(path), "MOOS log", tuple(notes))


def _make_topic(name: str, postings: list[_Posting]) -> Topic:
    times, sources, values, lines = zip(*postings, strict=True)
    columns = {"source": Column(None, sources), "value": parse_column(values, name=name)}
    return make_topic(name, columns, lines, time=np.array(times))

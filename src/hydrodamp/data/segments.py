"""Where a recording is cut: at a change of label, at a gap, at missing samples."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.data.record import Record

GAP_STEPS = 5.0
"""A step longer than this many median steps, and than GAP_SECONDS, is a gap."""

GAP_SECONDS = 1.0
"""No step up to this long is a gap [s]."""

_LISTED = 5


@dataclass(frozen=True)
class Segment:
    """A stretch of a log without a join or a gap: samples start to stop - 1."""

    name: str
    start: int
    stop: int

    def __len__(self) -> int:
        """Return the number of samples."""
        return self.stop - self.start


@dataclass(frozen=True, eq=False)
class Split:
    """How a recording falls into segments."""

    keep: BoolArray
    segments: tuple[Segment, ...]
    notes: tuple[str, ...]

    @property
    def told(self) -> str:
        """How many segments there are and why, in one sentence."""
        count = len(self.segments)
        return f"split into {count} segment{'s' if count > 1 else ''}: {'; '.join(self.notes)}"


def longest_step(time: FloatArray, joins: BoolArray) -> float:
    """Return the longest step that is not a gap."""
    steps = np.diff(time)[~joins[1:]]
    return max(GAP_STEPS * float(np.median(steps)), GAP_SECONDS) if len(steps) else GAP_SECONDS


def split(record: Record, name: str = "1") -> Split:
    """Return the segments of a recording whose time is in order."""
    joins, missing = record.joins, record.missing
    late = np.diff(record.time, prepend=record.time[:1]) > longest_step(record.time, joins)
    gaps = late & ~joins
    starts = joins | gaps | (missing != np.roll(missing, 1))
    edges = np.append(np.flatnonzero(starts), record.n)
    pieces = [(a, b) for a, b in itertools.pairwise(edges) if not missing[a]]
    kept = [(int(a), int(b)) for a, b in pieces if b - a >= 2]
    dropped = [(int(a), int(b)) for a, b in pieces if b - a < 2]
    keep = np.zeros(record.n, dtype=np.bool_)
    for a, b in kept:
        keep[a:b] = True
    notes = (*_gap_notes(record, gaps), *_missing_notes(record, missing, edges))
    return Split(keep, _named(record, kept, name), (*notes, *_dropped_notes(record, dropped)))


def name_after(source: str) -> str:
    """Return what the segments of a file are called."""
    name = Path(source).name
    return Path(name[:-3] if name.lower().endswith(".gz") else name).stem or "1"


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names with a number added to those met before."""
    taken: dict[str, None] = {}
    for name in names:
        candidate, count = name, 1
        while candidate in taken:
            count += 1
            candidate = f"{name}-{count}"
        taken[candidate] = None
    return tuple(taken)


def _named(record: Record, pieces: list[tuple[int, int]], name: str) -> tuple[Segment, ...]:
    """Name each piece after its label, numbered where a label fell apart."""
    run = np.cumsum(record.joins)
    count = np.bincount([run[a] for a, _ in pieces], minlength=1)
    seen: dict[int, int] = {}
    names = []
    for a, _ in pieces:
        label = name if record.labels is None else record.labels[a]
        seen[run[a]] = seen.get(run[a], 0) + 1
        names.append(f"{label}.{seen[run[a]]}" if count[run[a]] > 1 else label)
    stops = np.cumsum([b - a for a, b in pieces]).tolist()
    starts = [0, *stops[:-1]]
    return tuple(map(Segment, unique_names(names), starts, stops))


def _gap_notes(record: Record, gaps: BoolArray) -> list[str]:
    rows = np.flatnonzero(gaps)
    time = record.time
    return _capped([f"no samples from {time[k - 1]:g} s to {time[k]:g} s" for k in rows], "gaps")


def _missing_notes(record: Record, missing: BoolArray, edges: FloatArray) -> list[str]:
    stretches = [(a, b) for a, b in itertools.pairwise(edges) if missing[a]]
    return _capped(
        [
            f"{b - a} {'sample' if b - a == 1 else 'samples'} with missing values"
            f" at {record.time[a]:g} s to {record.time[b - 1]:g} s"
            for a, b in stretches
        ],
        "stretches with missing values",
    )


def _dropped_notes(record: Record, dropped: list[tuple[int, int]]) -> list[str]:
    return _capped(
        [
            f"dropped a segment of one sample at {record.time[a]:g} s"
            + ("" if record.labels is None else f" (segment '{record.labels[a]}')")
            for a, _ in dropped
        ],
        "segments of one sample dropped",
    )


def _capped(notes: list[str], what: str) -> list[str]:
    more = len(notes) - _LISTED
    return notes if more <= 0 else [*notes[:_LISTED], f"{more} more {what}"]

"""Stretches of logs: cut out, put together, counted on one clock."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.blocks import BLOCKS
from hydrodamp.data.segments import Segment, unique_names
from hydrodamp.errors import LogError, did_you_mean

if TYPE_CHECKING:
    from hydrodamp.data.log import Log


def elapsed(time: FloatArray, segments: Sequence[Segment]) -> FloatArray:
    """Return the time since the first sample, running on where a clock restarts."""
    count: FloatArray = time - time[0]
    for before, part in itertools.pairwise(segments):
        if time[part.start] <= time[part.start - 1]:
            step = np.median(np.diff(time[before.start : before.stop]))
            count[part.start :] += count[part.start - 1] + step - count[part.start]
    return count


def goes_by(segment: str, name: str) -> bool:
    """Tell whether a segment answers to a name: its own, or that of its label."""
    label, _, piece = segment.rpartition(".")
    return segment == name or (piece.isdigit() and goes_by(label, name))


def spanned(log: Log, start: float, end: float) -> list[Segment]:
    """Return the stretches of a log within a time span."""
    first, last = np.searchsorted(log.elapsed, (start, end)).tolist()
    cut = ((part, max(part.start, first), min(part.stop, last)) for part in log.segments)
    if pieces := [Segment(part.name, a, b) for part, a, b in cut if b - a >= 2]:
        return pieces
    fault = (
        f"no two samples lie between {start:g} s and {end:g} s; the log spans 0 s to"
        f" {log.elapsed[-1]:g} s, counted from its first sample"
    )
    raise LogError(fault, source=log.source)


def command_index(log: Log, name: str) -> int:
    """Return which column of the commands has a name."""
    if name not in log.command_names:
        known = " ".join(log.command_names) or "none"
        near = did_you_mean(name, log.command_names)
        fault = f"there is no command '{name}'.{near} The commands are: {known}"
        raise LogError(fault, source=log.source)
    return log.command_names.index(name)


def named(log: Log, names: Sequence[str]) -> list[Segment]:
    """Return the segments of a log that go by some names, in the order of the names."""
    pieces: dict[str, Segment] = {}
    known = [part.name for part in log.segments]
    faults = [] if names else [f"name at least one segment of: {' '.join(known)}"]
    for name in names:
        found = {part.name: part for part in log.segments if goes_by(part.name, name)}
        if not found:
            near = did_you_mean(name, known)
            faults.append(
                f"there is no segment '{name}'.{near} The segments are: {' '.join(known)}"
            )
        pieces |= found
    if faults:
        raise LogError(faults, source=log.source)
    return list(pieces.values())


def take(log: Log, pieces: Sequence[Segment]) -> Log:
    """Return the log of some stretches, each a segment of its own."""
    rows = np.concatenate([np.arange(part.start, part.stop) for part in pieces])
    stops = list(itertools.accumulate(len(part) for part in pieces))
    names = [part.name for part in pieces]
    segments = tuple(map(Segment, names, [0, *stops[:-1]], stops))
    blocks = {name: getattr(log, name) for name in BLOCKS}
    taken: dict[str, Any] = {
        name: None if block is None else block[rows] for name, block in blocks.items()
    }
    return dataclasses.replace(log, **taken, segments=segments)


def concatenate(logs: Iterable[Log]) -> Log:
    """Return one log of several, each keeping its own clock and segments."""
    parts = list(logs)
    if not parts:
        raise LogError("there is no log to concatenate")
    first = parts[0]
    if faults := [fault for other in parts[1:] for fault in _differences(first, other)]:
        raise LogError(faults)
    blocks: dict[str, Any] = {
        name: np.concatenate([_block(part, name, first.command_names) for part in parts])
        for name in BLOCKS
        if getattr(first, name) is not None
    }
    sources = ", ".join(dict.fromkeys(part.source for part in parts if part.source))
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    return dataclasses.replace(first, **blocks, segments=_moved(parts), source=sources, notes=notes)


def _block(log: Log, name: str, command_names: tuple[str, ...]) -> FloatArray:
    """Return one array of a log, its commands in the order of the names."""
    block: FloatArray = getattr(log, name)
    if name != "commands":
        return block
    return block[:, [log.command_names.index(command) for command in command_names]]


def _moved(logs: Sequence[Log]) -> tuple[Segment, ...]:
    """Return the segments of logs that follow one another."""
    starts = itertools.accumulate((log.n for log in logs), initial=0)
    moved = [
        (part.name, part.start + start, part.stop + start)
        for log, start in zip(logs, starts, strict=False)
        for part in log.segments
    ]
    names = unique_names(name for name, _, _ in moved)
    return tuple(Segment(name, a, b) for name, (_, a, b) in zip(names, moved, strict=True))


def _differences(first: Log, other: Log) -> Iterator[str]:
    """Say which columns one of two logs has and the other lacks."""
    sets = [
        {*log.velocity_names, *log.command_names}
        | {name for name in BLOCKS if getattr(log, name) is not None}
        for log in (first, other)
    ]
    for mine, its, log in ((sets[0], sets[1], other), (sets[1], sets[0], first)):
        if mine - its:
            lacking = " ".join(sorted(mine - its))
            yield f"{log.source or 'a log'} lacks {lacking}, which the others have"

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
    """Return the time since the first sample, running on where a clock restarts.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Sample times [s], increasing within each segment.
    segments : sequence of Segment
        They cover all samples in order.

    Returns
    -------
    elapsed : ndarray, shape (n,)
        Increasing [s]. A segment that begins no later than the one before ended
        begins one median step after it.

    Examples
    --------
    >>> parts = Segment("a", 0, 3), Segment("b", 3, 5)
    >>> elapsed(np.array([7.0, 8.0, 9.0, 0.0, 1.0]), parts).tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0]
    """
    count: FloatArray = time - time[0]
    for before, part in itertools.pairwise(segments):
        if time[part.start] <= time[part.start - 1]:
            step = np.median(np.diff(time[before.start : before.stop]))
            count[part.start :] += count[part.start - 1] + step - count[part.start]
    return count


def goes_by(segment: str, name: str) -> bool:
    """Tell whether a segment answers to a name: its own, or that of its label.

    Parameters
    ----------
    segment : str
        The segment's name.
    name : str
        What was asked for.

    Returns
    -------
    answers : bool
        True for the name itself and for the pieces of a label cut at gaps.

    Examples
    --------
    >>> goes_by("dive.2", "dive"), goes_by("dive.2.1", "dive"), goes_by("dive.deep", "dive")
    (True, True, False)
    """
    label, _, piece = segment.rpartition(".")
    return segment == name or (piece.isdigit() and goes_by(label, name))


def spanned(log: Log, start: float, end: float) -> list[Segment]:
    """Return the stretches of a log within a time span.

    Parameters
    ----------
    log : Log
        The log to cut.
    start, end : float
        Seconds counted from its first sample; ``end`` is not included.

    Returns
    -------
    pieces : list of Segment
        Of two samples or more, named after their segments.

    Raises
    ------
    LogError
        If there is none.
    """
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
    """Return which column of the commands has a name.

    Parameters
    ----------
    log : Log
        The log to look in.
    name : str
        The channel's name.

    Returns
    -------
    index : int
        From 0.

    Raises
    ------
    LogError
        If there is none of this name.
    """
    if name not in log.command_names:
        known = " ".join(log.command_names) or "none"
        near = did_you_mean(name, log.command_names)
        fault = f"there is no command '{name}'.{near} The commands are: {known}"
        raise LogError(fault, source=log.source)
    return log.command_names.index(name)


def named(log: Log, names: Sequence[str]) -> list[Segment]:
    """Return the segments of a log that go by some names, in the order of the names.

    Parameters
    ----------
    log : Log
        The log to look in.
    names : sequence of str
        Names of segments, or of labels that fell apart.

    Returns
    -------
    pieces : list of Segment
        Each once.

    Raises
    ------
    LogError
        If a name is unknown, or none is given.
    """
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
    """Return the log of some stretches, each a segment of its own.

    Parameters
    ----------
    log : Log
        The log to cut.
    pieces : sequence of Segment
        Stretches of it.

    Returns
    -------
    log : Log
        The samples of the stretches in the order given.
    """
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
    """Return one log of several, each keeping its own clock and segments.

    Parameters
    ----------
    logs : iterable of Log
        Logs with the same columns; commands may stand in another order.

    Returns
    -------
    log : Log
        A segment name met before gets a number: ``dive``, ``dive-2``.

    Raises
    ------
    LogError
        If there is no log, or a log has other columns than the first.

    Examples
    --------
    >>> from hydrodamp.data.log import Log
    >>> log = Log(time=[0.0, 1.0], velocity=np.ones((2, 6)))
    >>> [segment.name for segment in concatenate([log, log]).segments]
    ['1', '1-2']
    """
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

"""Several logs as one, each with its own clock and segments."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from hydrodamp.data.log import Log, arrays
from hydrodamp.data.record import Segment, unique_names
from hydrodamp.errors import LogError


def concatenate(logs: Iterable[Log]) -> Log:
    """Return one log of several, each keeping its own clock and segments.

    Parameters
    ----------
    logs : iterable of Log
        Logs with the same columns; commands may stand in another order.

    Returns
    -------
    log : Log
        A segment name that occurs again gets a number: ``dive``, ``dive-2``.

    Raises
    ------
    LogError
        If there is no log, or a log has other columns than the first.

    Examples
    --------
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
    order = [[part.command_names.index(name) for name in first.command_names] for part in parts]
    blocks: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in arrays(first)
        if name != "commands"
    }
    commands = [part.commands[:, columns] for part, columns in zip(parts, order, strict=True)]
    starts = itertools.accumulate((part.n for part in parts), initial=0)
    moved = [
        (piece.name, piece.start + start, piece.stop + start)
        for part, start in zip(parts, starts, strict=False)
        for piece in part.segments
    ]
    names = unique_names(name for name, _, _ in moved)
    return dataclasses.replace(
        first,
        **blocks,
        commands=np.concatenate(commands),
        segments=tuple(Segment(name, a, b) for name, (_, a, b) in zip(names, moved, strict=True)),
        source=", ".join(dict.fromkeys(part.source for part in parts if part.source)),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
    )


def _differences(first: Log, other: Log) -> Iterator[str]:
    """Say which columns one of two logs has and the other lacks."""
    held = [{*log.velocity_names, *log.command_names, *arrays(log)} for log in (first, other)]
    for mine, its, log in ((held[0], held[1], other), (held[1], held[0], first)):
        if mine - its:
            lacking = " ".join(sorted(mine - its))
            yield f"{log.source or 'a log'} lacks {lacking}, which the others have"

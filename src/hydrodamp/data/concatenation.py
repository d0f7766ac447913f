"""Concatenation of logs, each with its own clock and segments."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hydrodamp.data.log import Log, recorded_arrays
from hydrodamp.data.measurement import concatenate_measurements
from hydrodamp.data.record import consecutive_segments, name_of_source
from hydrodamp.errors import LogError


def concatenate(logs: Iterable[Log]) -> Log:
    """Return one log of several, each keeping its own clock and segments.

    Parameters
    ----------
    logs : iterable of Log
        Logs with the same columns; commands may be in another order.

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
    log_list = list(logs)
    if not log_list:
        raise LogError("there is no log to concatenate")
    first = log_list[0]
    if faults := [fault for log in log_list[1:] for fault in _column_differences(first, log)]:
        raise LogError(faults)
    order = [[log.command_names.index(name) for name in first.command_names] for log in log_list]
    blocks: dict[str, Any] = {
        name: np.concatenate([getattr(log, name) for log in log_list])
        for name in recorded_arrays(first)
        if name != "commands"
    }
    commands = [log.commands[:, columns] for log, columns in zip(log_list, order, strict=True)]
    names = [name for log in log_list for name in _segment_names(log, log_list)]
    lengths = [len(piece) for log in log_list for piece in log.segments]
    return dataclasses.replace(
        first,
        **blocks,
        commands=np.concatenate(commands),
        measurements=concatenate_measurements(
            [(log.measurements, len(log.segments)) for log in log_list]
        ),
        segments=consecutive_segments(names, lengths),
        source=", ".join(dict.fromkeys(log.source for log in log_list if log.source)),
        notes=tuple(dict.fromkeys(note for log in log_list for note in log.notes)),
    )


def _segment_names(log: Log, logs: Sequence[Log]) -> list[str]:
    """Return the names of segments, by folder if several folders have a file of this name."""
    label, folder = name_of_source(log.source), Path(log.source).parent.name
    folders = {Path(item.source).parent for item in logs if name_of_source(item.source) == label}
    names = [piece.name for piece in log.segments]
    if not log.source or not folder or len(folders) < 2:
        return names
    return [folder + name.removeprefix(label) for name in names]


def _column_differences(first: Log, other: Log) -> Iterator[str]:
    """Yield the columns that only one of two logs has."""
    for log, complete in ((other, first), (first, other)):
        expected, present = (
            {*item.velocity_names, *item.command_names, *recorded_arrays(item)}
            for item in (complete, log)
        )
        if expected - present:
            lacking = " ".join(sorted(expected - present))
            yield f"{log.source or 'a log'} lacks {lacking}, which the others have"

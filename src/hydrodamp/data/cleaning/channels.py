"""The measured columns of a log by name, out and back in."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.log import Log

_COLUMNS: dict[str, tuple[str, ...]] = {
    "velocity": VELOCITIES,
    "acceleration": tuple(f"d{name}" for name in VELOCITIES),
    "position": ("north", "east", "down"),
    "specific_force": ("force_x", "force_y", "force_z"),
}


def measured(log: Log) -> dict[str, FloatArray]:
    """Return what sensors wrote, column by column; attitude and commands stand apart.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    columns : dict of str to ndarray, shape (n,)
        Recorded velocities u ... r, and where there are any their derivatives du ... dr,
        the position north, east, down and the specific force force_x, force_y, force_z.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1], {"u": [1, 2]}, position=[[0, 0, 0], [1, 0, 0]])
    >>> list(measured(log))
    ['u', 'north', 'east', 'down']
    """
    columns: dict[str, FloatArray] = {}
    for block, names in _COLUMNS.items():
        values = getattr(log, block)
        if values is not None:
            columns |= {name: values[:, k] for k, name in enumerate(names)}
    absent = [name for name in VELOCITIES if name not in log.velocity_names]
    for name in absent:
        columns.pop(name)
        columns.pop(f"d{name}", None)
    return columns


def with_columns(log: Log, columns: Mapping[str, FloatArray]) -> Log:
    """Return a log with other values in some of its measured columns.

    Parameters
    ----------
    log : Log
        Any log.
    columns : mapping of str to ndarray, shape (n,)
        Names as :func:`measured` gives them.

    Returns
    -------
    log : Log
        All else is kept.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1], {"u": [1, 2]})
    >>> with_columns(log, {"u": np.array([3.0, 4.0])}).velocity[:, 0].tolist()
    [3.0, 4.0]
    """
    blocks = {}
    for block, names in _COLUMNS.items():
        changed = [name for name in names if name in columns]
        if changed:
            values = getattr(log, block).copy()
            for name in changed:
                values[:, names.index(name)] = columns[name]
            blocks[block] = values
    return dataclasses.replace(log, **blocks) if blocks else log


def segment_of(log: Log) -> IntArray:
    """Return the number of the segment of each sample, shape (n,), from 0.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    number : ndarray of int, shape (n,)
        It grows by one at each join.

    Examples
    --------
    >>> segment_of(Log.from_arrays([0, 1, 0, 1], {"u": [1, 2, 3, 4]}, segment="aabb")).tolist()
    [0, 0, 1, 1]
    """
    lengths = [len(part) for part in log.segments]
    return np.repeat(np.arange(len(lengths)), lengths)

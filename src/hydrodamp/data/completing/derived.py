"""How a derived velocity enters a log, and which may be asked for."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, did_you_mean


def with_velocities(log: Log, columns: Mapping[str, FloatArray]) -> Log:
    """Return a log with some velocities added or replaced.

    Parameters
    ----------
    log : Log
        Any log.
    columns : mapping of str to ndarray, shape (n,)
        Velocities [m/s, rad/s] by name.

    Returns
    -------
    log : Log
        Without recorded accelerations: they do not belong to what is new.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1], {"u": [1, 2]})
    >>> with_velocities(log, {"r": log.time}).velocity_names
    ('u', 'r')
    """
    velocity = log.velocity.copy()
    for name, values in columns.items():
        velocity[:, VELOCITIES.index(name)] = values
    names = tuple(name for name in VELOCITIES if name in (*log.velocity_names, *columns))
    made = dataclasses.replace(log, velocity=velocity, velocity_names=names, acceleration=None)
    if log.acceleration is None:
        return made
    return made.noted(f"left out: recorded accelerations, which `{' '.join(columns)}` lack")


def checked_names(log: Log, names: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return names in their usual order, or say which is none.

    Parameters
    ----------
    log : Log
        For the message.
    names : sequence of str
        What was asked for.
    known : sequence of str
        What can be derived.

    Returns
    -------
    names : tuple of str
        In the order of ``known``.

    Raises
    ------
    LogError
        With every name that is unknown.

    Examples
    --------
    >>> checked_names(Log.from_arrays([0, 1], {"u": [1, 2]}), ["r", "p"], ("p", "q", "r"))
    ('p', 'r')
    """
    faults = [
        f"'{name}' cannot be derived here; it takes {' '.join(known)}.{did_you_mean(name, known)}"
        for name in names
        if name not in known
    ]
    if faults:
        raise LogError(faults, source=log.source)
    return tuple(name for name in known if name in names)

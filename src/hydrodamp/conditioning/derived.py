"""How a derived velocity enters a log, and which may be asked for."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, did_you_mean


def with_velocities(log: Log, columns: Mapping[str, FloatArray]) -> Log:
    """Return a log with some velocities added or replaced."""
    velocity = log.velocity.copy()
    for name, values in columns.items():
        velocity[:, VELOCITIES.index(name)] = values
    names = tuple(name for name in VELOCITIES if name in (*log.velocity_names, *columns))
    made = dataclasses.replace(log, velocity=velocity, velocity_names=names, acceleration=None)
    if log.acceleration is None:
        return made
    return made.noted(f"left out: recorded accelerations, which `{' '.join(columns)}` lack")


def checked_names(log: Log, names: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    """Return names in their usual order, or say which is none."""
    faults = [
        f"'{name}' cannot be derived here; it takes {' '.join(known)}.{did_you_mean(name, known)}"
        for name in names
        if name not in known
    ]
    if faults:
        raise LogError(faults, source=log.source)
    return tuple(name for name in known if name in names)

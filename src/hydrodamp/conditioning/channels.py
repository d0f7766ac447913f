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
    """Return what sensors wrote, column by column; attitude and commands stand apart."""
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
    """Return a log with other values in some of its measured columns."""
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
    """Return the number of the segment of each sample, shape (n,), from 0."""
    lengths = [len(part) for part in log.segments]
    return np.repeat(np.arange(len(lengths)), lengths)

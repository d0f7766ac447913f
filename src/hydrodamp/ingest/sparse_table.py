"""Canonical tables with empty cells, one row a time stamp: sparse columns become sensors.

A position or a linear velocity that fewer than half of the rows have keeps its own times.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.channels import ATTITUDE, BLOCKS, EULER, POSITION, RESERVED
from hydrodamp.data.recording import Topic

#: Sensors of canonical columns: name, kind and columns.
_SENSORS = (
    ("position", "position", POSITION.columns[:2]),
    ("depth", "position", POSITION.columns[2:]),
    ("velocity", "velocity", VELOCITIES[:3]),
)

#: Share of the rows below which a column is sparse.
MAX_SHARE = 0.5


def sparse_mapping(table: Topic) -> dict[str, Any]:
    """Return the mapping of a canonical table with sparse columns; empty without any."""
    present = {
        name: tuple(column for column in columns if column in table.fields)
        for name, _, columns in _SENSORS
    }
    sparse = [name for name, columns in present.items() if columns and _is_sparse(table, columns)]
    if not sparse:
        return {}
    if {"position", "depth"} & {*sparse}:  # one sensor must not hide the other
        sparse += [name for name in ("position", "depth") if present[name] and name not in sparse]
    moved = {column for name in sparse for column in present[name]}
    content: dict[str, Any] = {"time": {"column": "time", "unit": "s"}}
    for block in BLOCKS:
        columns = [name for name in block.columns if name in table.fields and name not in moved]
        if columns and block.shape and block.name not in ("time", "commands"):
            content[block.name] = dict(zip(columns, columns, strict=True))
    angles = [name for name in EULER if name in table.fields]
    if angles and not set(ATTITUDE.columns) & set(table.fields):
        content["attitude"] = {name: {"column": name, "unit": "rad"} for name in angles}
    content["commands"] = [name for name in table.fields if name not in RESERVED and name.strip()]
    if "segment" in (*table.fields, *table.texts):
        content["segment"] = "segment"
    content["sensors"] = {
        name: {"kind": kind, "columns": {column: column for column in present[name]}}
        for name, kind, _ in _SENSORS
        if name in sparse
    }
    return content


def _is_sparse(table: Topic, columns: tuple[str, ...]) -> bool:
    """Return whether some rows, but fewer than half of them, have a column."""
    counts = [int(np.count_nonzero(np.isfinite(table.fields[name]))) for name in columns]
    return 0 < sum(counts) < MAX_SHARE * table.n * len(columns)

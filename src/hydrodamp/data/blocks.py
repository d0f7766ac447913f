"""The arrays of a log: their names, their shapes, and what must hold for each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.bounds import speed_faults, unbounded

if TYPE_CHECKING:
    from hydrodamp.data.segments import Segment

BLOCKS: dict[str, tuple[int | None, ...]] = {
    "time": (),
    "velocity": (6,),
    "attitude": (4,),
    "commands": (None,),
    "wrench": (6,),
    "acceleration": (6,),
    "propulsion_ratio": (),
    "position": (3,),
    "specific_force": (3,),
}
"""Attributes of a log that hold one entry a sample, and the shape of the entry."""

_UNIT = 1e-12  # a quaternion this near to norm 1 is kept to the bit
_NEARLY_UNIT = 1e-3  # one farther off is a fault


def freeze(values: Mapping[str, Any]) -> tuple[dict[str, FloatArray | None], list[str]]:
    """Copy the arrays of a log at the door."""
    blocks: dict[str, FloatArray | None] = {}
    faults = []
    n: int | None = None
    for name, entry in BLOCKS.items():
        given = values[name]
        if name == "commands" and np.size(given) == 0:
            given = np.empty((n or 0, 0))
        try:
            block = None if given is None else frozen(given, (n, *entry), name)
        except ValueError as error:
            faults.append(str(error))
            continue
        n = len(block) if n is None and block is not None else n
        blocks[name] = block
        faults += _value_faults(name, block)
    attitude = blocks.get("attitude")
    if attitude is not None and not faults:
        blocks["attitude"] = _normalised(attitude)
    return blocks, faults


def segment_faults(time: FloatArray, segments: tuple[Segment, ...]) -> Iterator[str]:
    """Return what is wrong with the segments of a log."""
    edges = [0, *(part.stop for part in segments)]
    if [part.start for part in segments] != edges[:-1] or edges[-1] != len(time):
        yield f"`segments` must follow one another from 0 to {len(time)}; got {segments}"
        return
    if len({part.name for part in segments}) < len(segments):
        names = " ".join(part.name for part in segments)
        yield f"`segments` must have different names; got {names}"
    for part in segments:
        if len(part) < 2:
            yield f"segment '{part.name}' has {len(part)} samples; at least two are needed"
            continue
        steps = np.diff(time[part.start : part.stop])
        if steps.min() <= 0:
            row = part.start + int(steps.argmin())
            yield (
                f"`time` must increase within segment '{part.name}'; it goes from"
                f" {time[row]:.10g} s to {time[row + 1]:.10g} s in row {row + 2}"
            )


def name_faults(velocities: tuple[str, ...], commands: tuple[str, ...], n: int) -> Iterator[str]:
    """Return what is wrong with the names of a log's columns."""
    if [name for name in VELOCITIES if name in velocities] != list(velocities):
        yield f"`velocity_names` must be some of u v w p q r in this order; got {velocities}"
    if len(commands) != n or len(set(commands)) < n:
        yield f"`command_names` must be {n} different names, one a column; got {commands}"


def _value_faults(name: str, block: FloatArray | None) -> Iterator[str]:
    if block is None:
        return
    if len(block) and (found := unbounded(name, block)):
        column, row, value = found
        told = "it" if column == name else f"`{column}`"
        yield f"`{name}` must be finite; {told} is {value} in row {row + 1}"
    elif name == "velocity":
        yield from speed_faults(block, lambda row: f"row {row + 1}")
    elif name == "attitude":
        norm = np.linalg.norm(block, axis=1)
        if (off := np.abs(norm - 1) > _NEARLY_UNIT).any():
            row = int(off.argmax())
            yield f"`attitude` must hold unit quaternions; row {row + 1} has norm {norm[row]:.4g}"


def _normalised(attitude: FloatArray) -> FloatArray:
    norm = np.linalg.norm(attitude, axis=1, keepdims=True)
    return frozen(np.where(np.abs(norm - 1) > _UNIT, attitude / norm, attitude))

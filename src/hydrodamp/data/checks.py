"""What can be wrong with a recording or a log: clock, attitude, units, names, infinite numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.agreement import rate_slopes
from hydrodamp.data.channels import BLOCKS, VELOCITY, unit_of
from hydrodamp.data.record import Record, Segment

#: Largest component of a recorded velocity [m/s, rad/s]; beyond it a replay has diverged.
_FASTEST = 50.0

_DEGREES_SLOPE = (50.0, 65.0)  # of recorded on differentiated rates in deg/s (180/pi = 57.3)
_UNIT = 1e-12  # a quaternion this near to norm 1 is kept to the bit
_NEARLY_UNIT = 1e-3  # one farther off is a fault
_LISTED = 3


def record_faults(record: Record) -> list[str]:
    """Return all that is wrong with a recording."""
    if record.n == 0:
        return ["there are no samples; at least two are needed"]
    faults = [*_clock_faults(record), *_infinite_faults(record), *_norm_faults(record)]
    degrees = {} if faults else _rates_in_degrees(record)
    if degrees:
        faults.append(
            f"the rates `{' '.join(degrees)}` must be in rad/s; they are"
            f" {next(iter(degrees.values())):.3g} times the rate of the attitude, so they are in"
            " deg/s. Convert them, or give a mapping with unit: deg/s"
        )
    rest = [name for name in record.velocity_names if name not in degrees]
    return [*faults, *_speed_faults(record.velocity, record.place, rest)]


def frozen_blocks(given: Mapping[str, Any]) -> tuple[dict[str, FloatArray | None], list[str]]:
    """Copy the arrays of a log by their names; return them and what is wrong with them."""
    blocks: dict[str, FloatArray | None] = {}
    faults: list[str] = []
    n: int | None = None
    shapes = {**{block.name: block.shape for block in BLOCKS}, "commands": (None,)}
    for name, shape in shapes.items():
        values = given[name]
        if name == "commands" and np.size(values) == 0:
            values = np.empty((n or 0, 0))
        try:
            block = None if values is None else frozen(values, (n, *shape), name)
        except ValueError as error:
            faults.append(str(error))
            continue
        n = len(block) if n is None and block is not None else n
        blocks[name] = block
        faults += () if block is None else _block_faults(name, block)
    attitude = blocks.get("attitude")
    if attitude is not None and not faults:
        norm = np.linalg.norm(attitude, axis=1, keepdims=True)
        blocks["attitude"] = frozen(np.where(np.abs(norm - 1) > _UNIT, attitude / norm, attitude))
    return blocks, faults


def segment_faults(time: FloatArray, segments: Sequence[Segment]) -> Iterator[str]:
    """Yield what is wrong with the segments of a log."""
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


def name_faults(velocities: Sequence[str], commands: Sequence[str], n: int) -> Iterator[str]:
    """Yield what is wrong with the names of a log's columns."""
    if [name for name in VELOCITIES if name in velocities] != list(velocities):
        yield f"`velocity_names` must be some of u v w p q r in this order; got {velocities}"
    if len(commands) != n or len(set(commands)) < n:
        yield f"`command_names` must be {n} different names, one a column; got {commands}"


def capped(faults: list[str], listed: int = _LISTED) -> list[str]:
    """Return the first few faults of one kind and how many more there are."""
    more = len(faults) - listed
    if more <= 0:
        return faults
    return [*faults[: listed - 1], f"{faults[listed - 1]} (and {more} more like it)"]


def _block_faults(name: str, block: FloatArray) -> Iterator[str]:
    if found := _first(name, block, ~np.isfinite(block)):
        column, row, value = found
        called = "it" if column == name else f"`{column}`"
        yield f"`{name}` must be finite; {called} is {value} in row {row + 1}"
    elif name == "velocity":
        yield from _speed_faults(block, lambda row: f"row {row + 1}", VELOCITIES)
    elif name == "attitude":
        norm = np.linalg.norm(block, axis=1)
        if (off := np.abs(norm - 1) > _NEARLY_UNIT).any():
            row = int(off.argmax())
            yield f"`attitude` must hold unit quaternions; row {row + 1} has norm {norm[row]:.4g}"


def _first(name: str, block: FloatArray, bad: BoolArray) -> tuple[str, int, float] | None:
    """Return column, row and value of the first bad number of an array."""
    if not bad.any():
        return None
    row, place = np.argwhere(bad.reshape(len(block), -1))[0].tolist()
    columns = next((one.columns for one in BLOCKS if one.name == name), ())
    value = float(block.reshape(len(block), -1)[row, place])
    return (columns[place] if columns else name), row, value


def _clock_faults(record: Record) -> Iterator[str]:
    time = record.time
    absent = np.flatnonzero(~np.isfinite(time))
    yield from capped([f"`time` has no value in {record.place(row)}" for row in absent.tolist()])
    with np.errstate(invalid="ignore"):
        stuck = np.flatnonzero((np.diff(time) <= 0) & ~record.joins[1:]) + 1
    yield from capped([_disorder(record, row) for row in stuck.tolist()])


def _disorder(record: Record, row: int) -> str:
    before, now = record.time[row - 1], record.time[row]
    if now == before:
        return f"`time` must increase; it repeats {now:.10g} s in {record.place(row)}"
    return (
        f"`time` must increase; it runs backwards from {before:.10g} s to {now:.10g} s in"
        f" {record.place(row)}. If another run begins there, say so in a `segment` column"
    )


def _infinite_faults(record: Record) -> Iterator[str]:
    measured = {name: block for name, block in record.blocks.items() if name != "time"}
    for name, block in {**measured, **record.commands}.items():
        if found := _first(name, block, np.isinf(block)):
            yield f"`{found[0]}` must be finite; it is infinite in {record.place(found[1])}"


def _norm_faults(record: Record) -> Iterator[str]:
    attitude = record.blocks.get("attitude")
    if attitude is None:
        return
    norm = np.linalg.norm(attitude, axis=1)
    yield from capped(
        [
            f"the quaternion qw qx qy qz must have norm 1; it is {norm[row]:.4g} in"
            f" {record.place(row)}"
            for row in np.flatnonzero(np.abs(norm - 1) > _NEARLY_UNIT).tolist()
        ]
    )


def _speed_faults(
    velocity: FloatArray, place: Callable[[int], str], names: Sequence[str]
) -> Iterator[str]:
    """Yield a sentence for each velocity that is larger than :data:`_FASTEST`."""
    for name, values in zip(VELOCITY.columns, velocity.T, strict=True):
        with np.errstate(invalid="ignore"):
            over = np.flatnonzero((np.abs(values) > _FASTEST) & np.isfinite(values))
        if name not in names or len(over) == 0:
            continue
        first, more, unit = int(over[0]), len(over) - 1, unit_of(name)
        tail = f" and so in {more} more row{'s' if more > 1 else ''}" if more else ""
        degrees = "If rates are in deg/s, convert them. " if unit == "rad/s" else ""
        yield (
            f"`{name}` must be at most {_FASTEST:g} {unit} in size; it is {values[first]:.4g} in"
            f" {place(first)}{tail}. {degrees}If it is a spike, put NaN or nothing there: that"
            " marks a missing sample"
        )


def _rates_in_degrees(record: Record) -> dict[str, float]:
    """Return the rates in deg/s and their slopes; for a recording without other faults."""
    attitude = record.blocks.get("attitude")
    if attitude is None:
        return {}
    missing = record.missing
    edges = np.flatnonzero(record.joins | (missing != np.roll(missing, 1)))
    bounds = np.column_stack((edges, [*edges[1:], record.n]))
    rates = np.where(missing[:, np.newaxis], 0.0, record.velocity[:, 3:])
    level = np.where(missing[:, np.newaxis], (1.0, 0.0, 0.0, 0.0), attitude)
    slopes = rate_slopes(record.time, level, rates, bounds)
    low, high = _DEGREES_SLOPE
    found = zip(VELOCITIES[3:], slopes.tolist(), strict=True)
    return {name: slope for name, slope in found if low <= slope <= high}

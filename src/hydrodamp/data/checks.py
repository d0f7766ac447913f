"""Validation of records and logs: clock, attitude norm, units, names, finite numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.channel_regression import integrate_rotation, regress_channel
from hydrodamp.data.channels import BLOCKS, unit_of
from hydrodamp.data.plausibility import MAX_NORM_ERROR, MAX_VELOCITY
from hydrodamp.data.record import Record, Segment, copy_arrays, split_segments, unrecorded_columns
from hydrodamp.errors import first_few

_DEGREES_SLOPE = (50.0, 65.0)  # of recorded on differentiated rates in deg/s (180/pi = 57.3)
_SCREENING_FACTOR = 0.1  # of that slope; smaller ratios of medians are not regressed
#: Longest median step [s], a day, and latest clock [s], 30 000 years after 1970: what is beyond is
#: no clock in seconds, for no vessel is recorded so slowly or so late.
_LONGEST_STEP_S, _LATEST_CLOCK_S = 86_400.0, 1e12
NORM_ROUNDING = 1e-12  # how far it is off one by rounding alone
_MAX_LISTED = 3


def record_faults(record: Record) -> list[str]:
    """Return the faults of a record."""
    if record.n == 0:
        return ["there are no samples; at least two are needed"]
    measured = {name: block for name, block in record.blocks.items() if name != "time"}
    faults = [
        *clock_faults(record.time, record.joins, record.row_name),
        *_nonfinite_faults(measured, record.command_names, np.isinf, record.row_name),
        *_norm_faults(record.blocks.get("attitude"), record.row_name),
    ]
    degrees = {} if faults else _rates_in_degrees(record)
    if degrees:
        ratio = f"{next(iter(degrees.values())):.3g} times the rate of the attitude"
        faults.append(
            f"the rates `{' '.join(degrees)}` must be in rad/s; they are {ratio}, so they are in"
            " deg/s. Convert them, or give a mapping with unit: deg/s"
        )
    checked = [name for name in record.velocity_names if name not in degrees]
    return [*faults, *_speed_faults(record.blocks["velocity"], record.row_name, checked)]


def check_blocks(given: Mapping[str, Any]) -> tuple[dict[str, FloatArray], list[str]]:
    """Copy the arrays of a log by name; return them and their faults."""
    n = np.size(given["time"])
    commands = np.empty((n, 0)) if np.size(given["commands"]) == 0 else given["commands"]
    shapes = {block.name: (given[block.name], block.shape) for block in BLOCKS}
    blocks, faults = copy_arrays({**shapes, "commands": (commands, (None,))}, n)
    if not faults:
        faults = [
            *_nonfinite_faults(blocks, (), lambda block: ~np.isfinite(block), _row_name),
            *_norm_faults(blocks.get("attitude"), _row_name),
            *_speed_faults(blocks["velocity"], _row_name, VELOCITIES),
        ]
    if "attitude" in blocks and not faults:
        norm = np.linalg.norm(blocks["attitude"], axis=1, keepdims=True)
        # Quaternions of norm 1 are kept to the bit.
        off = np.abs(norm - 1) > NORM_ROUNDING
        blocks["attitude"] = frozen(np.where(off, blocks["attitude"] / norm, blocks["attitude"]))
    return blocks, faults


def segment_faults(time: FloatArray, segments: Sequence[Segment]) -> Iterator[str]:
    """Yield the faults of segments, and of the clock inside them."""
    edges = [0, *(segment.stop for segment in segments)]
    is_covered = [segment.start for segment in segments] == edges[:-1] and edges[-1] == len(time)
    has_unique_names = len({segment.name for segment in segments}) == len(segments)
    if not is_covered or not has_unique_names or min(map(len, segments)) < 2:
        yield (
            f"`segments` must follow one another from 0 to {len(time)}, each of two samples or"
            f" more and with a name of its own; got {segments}"
        )
        return
    joins = np.zeros(len(time), dtype=np.bool_)
    joins[edges[:-1]] = True
    yield from clock_faults(time, joins, _row_name)


def name_faults(velocities: Sequence[str], commands: Sequence[str], n: int) -> Iterator[str]:
    """Yield the faults of column names."""
    if [name for name in VELOCITIES if name in velocities] != list(velocities):
        yield f"`velocity_names` must be some of u v w p q r in this order; got {velocities}"
    if len(commands) != n or len(set(commands)) < n:
        yield f"`command_names` must be {n} different names, one a column; got {commands}"


def clock_faults(time: FloatArray, joins: BoolArray, place: Callable[[int], str]) -> Iterator[str]:
    """Yield where a clock has no value, repeats or runs backwards, except at joins."""
    absent = np.flatnonzero(~np.isfinite(time)).tolist()
    empty = [f"`time` has no value in {place(row)}" for row in absent]
    yield from first_few(empty, _MAX_LISTED, "samples without a time")
    with np.errstate(invalid="ignore"):
        stuck = np.flatnonzero((np.diff(time) <= 0) & ~joins[1:]) + 1
    turns = [
        f"`time` must increase; it goes from {time[row - 1]:.10g} s to {time[row]:.10g} s in"
        f" {place(row)}. If another run begins there, mark it in a `segment` column; a mapping"
        " accepts clocks that repeat or are set back"
        for row in stuck.tolist()
    ]
    yield from first_few(turns, _MAX_LISTED, "steps of the clock like these")
    if empty or turns or len(time) < 2:
        return
    step, latest = float(np.median(np.diff(time))), float(np.max(np.abs(time)))
    if step > _LONGEST_STEP_S or latest > _LATEST_CLOCK_S:
        yield (
            f"`time` must be in seconds; its median step is {step:.4g} and its largest value"
            f" {latest:.4g}. Divide nanoseconds by 1e9, or give a mapping with the unit"
        )


def _row_name(row: int) -> str:
    return f"row {row + 1}"


def _nonfinite_faults(
    blocks: Mapping[str, FloatArray],
    commands: Sequence[str],
    is_bad: Callable[[FloatArray], BoolArray],
    place: Callable[[int], str],
) -> Iterator[str]:
    """Yield the first bad number of each array."""
    columns = {block.name: block.columns for block in BLOCKS} | {"commands": commands}
    for name, block in blocks.items():
        flat = block.reshape(len(block), -1)
        bad = is_bad(flat) & ~np.atleast_1d(unrecorded_columns(name, block))
        for row, column in np.argwhere(bad)[:1].tolist():
            called = dict(enumerate(columns[name])).get(column, name)
            kind = "infinite" if np.isinf(flat[row, column]) else "not a number"
            yield f"`{called}` must be finite; it is {kind} in {place(row)}"


def _norm_faults(attitude: FloatArray | None, place: Callable[[int], str]) -> list[str]:
    if attitude is None:
        return []
    norm = np.linalg.norm(attitude, axis=1)
    odd = [
        f"the quaternion qw qx qy qz must have norm 1; it is {norm[row]:.4g} in {place(row)}"
        for row in np.flatnonzero(np.abs(norm - 1) > MAX_NORM_ERROR).tolist()
    ]
    return first_few(odd, _MAX_LISTED, "such quaternions")


def _speed_faults(
    velocity: FloatArray, place: Callable[[int], str], names: Sequence[str]
) -> Iterator[str]:
    """Yield a fault for each velocity larger than :data:`MAX_VELOCITY`."""
    for name, values in zip(VELOCITIES, velocity.T, strict=True):
        over = np.flatnonzero((np.abs(values) > MAX_VELOCITY) & np.isfinite(values)).tolist()
        if name not in names or not over:
            continue
        first, unit = over[0], unit_of(name)
        tail = f", the first of {len(over)}" if len(over) > 1 else ""
        degrees = "If rates are in deg/s, convert them. " if unit == "rad/s" else ""
        yield (
            f"`{name}` must be at most {MAX_VELOCITY:g} {unit} in size; it is {values[first]:.4g}"
            f" in {place(first)}{tail}. {degrees}If it is an outlier, replace it by NaN or an"
            " empty cell, which marks a missing sample"
        )


def _rates_in_degrees(record: Record) -> dict[str, float]:
    """Return the rates in deg/s and their scales; for a record without other faults."""
    attitude = record.blocks.get("attitude")
    if attitude is None:
        return {}
    keep, segments, _ = split_segments(record)
    edges = [(segment.start, segment.stop) for segment in segments]
    bounds = np.array(edges, np.int64).reshape(-1, 2)
    time, rates = record.time[keep], record.blocks["velocity"][keep][:, 3:]
    rotation = integrate_rotation(attitude[keep], bounds)
    low, high = _DEGREES_SLOPE
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    lag = max(round(1.0 / step), 1)
    summed = np.cumsum(rates, axis=0) * step
    integrals, increments = (np.abs(values[lag:] - values[:-lag]) for values in (summed, rotation))
    if not len(increments):
        return {}
    # Regress only rates whose median is large enough.
    limits = _SCREENING_FACTOR * low * np.median(increments, axis=0)
    regressions = {
        VELOCITIES[3 + k]: regress_channel(time, bounds, rates[:, [k]], rotation[:, [k]])
        for k in np.flatnonzero(np.median(integrals, axis=0) > limits).tolist()
    }
    agreed = {name: result.scale for name, result in regressions.items() if result.is_consistent()}
    return {name: slope for name, slope in agreed.items() if low <= slope <= high}

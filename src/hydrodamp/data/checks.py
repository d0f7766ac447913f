"""What can be wrong with a recording: its clock, its attitude, the unit of its rates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.attitude import turn
from hydrodamp.data.bounds import speed_faults, unbounded
from hydrodamp.data.record import Record

DEGREES_SLOPE = (50.0, 65.0)
"""Recorded over differentiated rate where the record is in deg/s (180/pi = 57.3)."""

_WINDOW = 0.5  # s, over which attitude is differenced: longer than its noise
_LEAST_PAIRS = 8
_LEAST_RATE = 1e-3  # rad/s; below it an axis says nothing
_LEAST_AGREEMENT = 0.7  # of the motion; 0.5 is what unrelated signs reach
_LISTED = 3


def faults_of(record: Record) -> list[str]:
    """Return all that is wrong with a recording."""
    if record.n == 0:
        return ["there are no samples; at least two are needed"]
    time_faults = [*_clock_faults(record)]
    faults = [*time_faults, *_infinite_faults(record), *_attitude_faults(record)]
    degrees = () if faults else _rates_in_degrees(record)
    rest = [name for name in record.velocity_names if name not in dict(degrees)]
    return [*faults, *_rate_faults(degrees), *speed_faults(record.velocity, record.place, rest)]


def capped(faults: list[str], listed: int = _LISTED) -> list[str]:
    """Return the first few faults of one kind and how many more there are."""
    more = len(faults) - listed
    return (
        faults
        if more <= 0
        else [*faults[: listed - 1], f"{faults[listed - 1]} (and {more} more like it)"]
    )


def rate_slopes(
    time: FloatArray, attitude: FloatArray, rates: FloatArray, breaks: BoolArray | None = None
) -> FloatArray:
    """Return the slope of the recorded body rates on the differentiated attitude."""
    first, last = _window(time, breaks)
    if len(first) < _LEAST_PAIRS:
        return np.full(3, np.nan)
    span = (time[last] - time[first])[:, np.newaxis]
    differenced = turn(attitude[first], attitude[last]) / span
    area = _integral(time, rates)
    return _slope(differenced, (area[last] - area[first]) / span)


def rates_in_degrees(
    time: FloatArray, attitude: FloatArray, rates: FloatArray, breaks: BoolArray | None = None
) -> bool:
    """Return whether any recorded body rate is in deg/s."""
    return bool(_in_degrees(rate_slopes(time, attitude, rates, breaks)).any())


def _in_degrees(slopes: FloatArray) -> BoolArray:
    low, high = DEGREES_SLOPE
    inside: BoolArray = (slopes >= low) & (slopes <= high)
    return inside


def _window(time: FloatArray, breaks: BoolArray | None) -> tuple[FloatArray, FloatArray]:
    """Return pairs of sample indices half a second apart with no break between."""
    begun = np.zeros(len(time), np.int64) if breaks is None else np.cumsum(breaks)
    steps = np.diff(time)[begun[1:] == begun[:-1]]
    if len(steps) == 0:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    stride = max(1, round(_WINDOW / float(np.median(steps))))
    first = np.arange(max(0, len(time) - stride))
    first = first[begun[first] == begun[first + stride]]
    return first, first + stride


def _integral(time: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the running trapezoidal integral of the rates, shape (n, 3)."""
    strips = np.diff(time)[:, np.newaxis] * (rates[1:] + rates[:-1]) / 2
    return np.concatenate((np.zeros((1, 3)), np.cumsum(strips, axis=0)))


def _slope(differenced: FloatArray, recorded: FloatArray) -> FloatArray:
    """Return the slope of each axis that least absolute deviations give."""
    return np.array([_axis_slope(x, y) for x, y in zip(differenced.T, recorded.T, strict=True)])


def _axis_slope(differenced: FloatArray, recorded: FloatArray) -> float:
    weight = np.abs(differenced)
    if weight.mean() < _LEAST_RATE:
        return float("nan")
    agreeing = float(weight[differenced * recorded > 0].sum() / weight.sum())
    opposing = float(weight[differenced * recorded < 0].sum() / weight.sum())
    if max(agreeing, opposing) < _LEAST_AGREEMENT:
        return float("nan")
    turning = weight > 0
    with np.errstate(over="ignore"):  # beside hardly any rate
        ratio, weight = recorded[turning] / differenced[turning], weight[turning]
    order = np.argsort(ratio)
    middle = np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)
    return float(ratio[order[middle]])


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
    blocks = {"velocity": record.velocity, "attitude": record.attitude, "wrench": record.wrench}
    blocks |= {"acceleration": record.acceleration, "eta": record.propulsion_ratio}
    for name, block in (blocks | record.commands).items():
        if block is None or not np.isinf(block).any():
            continue
        found = unbounded(name, np.where(np.isnan(block), 0.0, block))
        if found is not None:
            column, row, _ = found
            yield f"`{column}` must be finite; it is infinite in {record.place(row)}"


def _attitude_faults(record: Record) -> Iterator[str]:
    if record.attitude is None:
        return
    norm = np.linalg.norm(record.attitude, axis=1)
    off = np.flatnonzero(np.abs(norm - 1) > 1e-3)
    yield from capped(
        [
            f"the quaternion qw qx qy qz must have norm 1; it is {norm[row]:.4g} in"
            f" {record.place(row)}"
            for row in off.tolist()
        ]
    )


def _rates_in_degrees(record: Record) -> tuple[tuple[str, float], ...]:
    """Return the rates in deg/s and their slopes; for a recording without other faults."""
    if record.attitude is None:
        return ()
    missing = record.missing
    breaks = record.joins | missing | np.roll(missing, 1)
    whole = np.where(missing[:, np.newaxis], 0.0, record.velocity[:, 3:])
    level = np.where(missing[:, np.newaxis], (1.0, 0.0, 0.0, 0.0), record.attitude)
    slopes = rate_slopes(record.time, level, whole, breaks)
    where = np.flatnonzero(_in_degrees(slopes)).tolist()
    return tuple((VELOCITIES[3 + k], float(slopes[k])) for k in where)


def _rate_faults(degrees: Sequence[tuple[str, float]]) -> Iterator[str]:
    if degrees:
        many = " ".join(name for name, _ in degrees)
        yield (
            f"the rates `{many}` must be in rad/s; they are {degrees[0][1]:.3g} times the rate of"
            " the attitude, so they are in deg/s. Convert them, or give a mapping with unit: deg/s"
        )

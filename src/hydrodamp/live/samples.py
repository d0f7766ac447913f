"""Samples of a stream: read the numbers of a row and fill equation 1 with them.

Plausible ranges of commands and recorded wrenches are derived from the vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import ATTITUDE, EULER, PROPULSION_RATIO, RESERVED, SEGMENT
from hydrodamp.data.checks import NORM_ROUNDING
from hydrodamp.data.log import Log
from hydrodamp.data.plausibility import MAX_NORM_ERROR
from hydrodamp.errors import ProblemError
from hydrodamp.identification.online import observe
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, prepare
from hydrodamp.vehicle.vehicle import Vehicle

#: One sample as a source provides it: numbers by canonical column, and the segment.
Row = Mapping[str, object]

_QUATERNION, _ANGLES = frozenset(ATTITUDE.columns), frozenset(EULER)
#: Columns that a stream may have or lack; it keeps those of its first accepted row.
_OPTIONAL = frozenset((*_QUATERNION, *_ANGLES, *AXES, *PROPULSION_RATIO.columns))


def rows_of(log: Log) -> Iterator[Row]:
    """Yield the samples of a log."""
    columns = columns_of(log)
    for segment in log.segments:
        for k in range(segment.start, segment.stop):
            row = {name: float(values[k]) for name, values in columns.items()}
            yield {**row, SEGMENT: segment.name}


def read_number(row: Row, name: str, default: float = math.nan) -> float:
    """Return a value of a row as a float; NaN where it is no number."""
    value = row.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.nan


def optional_channels(row: Row, known: Sequence[str] = ()) -> frozenset[str]:
    """Return the optional columns of a row, the attitude in the known form or the whole one."""
    names = _OPTIONAL.intersection(row)
    quaternion, angles = names & _QUATERNION, names & _ANGLES
    has_angles = angles and len(quaternion) < len(_QUATERNION)
    if not _ANGLES.isdisjoint(known) or (has_angles and _QUATERNION.isdisjoint(known)):
        return names - _QUATERNION
    is_new = quaternion and _QUATERNION.isdisjoint(known)
    return names - _ANGLES | (_QUATERNION if is_new else set())


def read_velocity(row: Row, free: Sequence[bool]) -> tuple[float, ...]:
    """Return the six velocities; zero along locked axes."""
    return tuple(
        read_number(row, name) if is_free else 0.0
        for name, is_free in zip(VELOCITIES, free, strict=True)
    )


def read_inputs(row: Row, names: Sequence[str], channels: Sequence[str]) -> tuple[float, ...]:
    """Return commands and the recorded wrench; an axis that is no channel is zero."""
    return tuple(
        0.0 if name in AXES and name not in channels else read_number(row, name) for name in names
    )


def sample_equations(
    vehicle: Vehicle, model: DampingModel, row: Row, channels: Sequence[str]
) -> EquationTable:
    """Return equation 1 for samples with the columns of this row.

    Raises ``ProblemError`` where the row lacks a required column.
    """
    time = read_number(row, "time")
    if not math.isfinite(time):
        raise ProblemError("a sample must have a finite `time` [s].")
    attitude, commands, wrench, ratio = _read_channels(row, channels)
    log = Log.from_arrays(
        [time, time + 1.0],
        {name: [read_number(row, name)] * 2 for name in VELOCITIES if name in row},
        attitude=None if attitude is None else [attitude] * 2,
        commands={name: [value] * 2 for name, value in commands.items() if math.isfinite(value)},
        wrench=None if wrench is None else [wrench] * 2,
        propulsion_ratio=None if ratio is None else [ratio] * 2,
        source="sample",
    )
    return prepare(vehicle, log, model).equations


def make_sample(
    equations: EquationTable,
    row: Row,
    velocity: Sequence[float],
    channels: Sequence[str],
    previous: Sample | None,
) -> Sample:
    """Return the input of an estimator step; ``previous`` is the last one of the segment."""
    attitude, commands, wrench, ratio = _read_channels(row, channels)
    return observe(
        equations,
        time=read_number(row, "time"),
        velocity=velocity,
        attitude=(0.0, 0.0, 0.0) if attitude is None else attitude,
        commands=commands,
        wrench=wrench,
        propulsion_ratio=ratio,
        previous=previous,
    )


def _read_channels(
    row: Row, channels: Sequence[str]
) -> tuple[list[float] | None, dict[str, float], list[float] | None, float | None]:
    """Return attitude, commands, wrench and propulsion ratio; None where no channel has them."""

    def read_group(names: Sequence[str]) -> list[float] | None:
        present = [name in channels for name in names]
        pairs = zip(names, present, strict=True)
        return [read_number(row, x) if has else 0.0 for x, has in pairs] if any(present) else None

    quaternion, wrench = read_group(ATTITUDE.columns), read_group(AXES)
    attitude = read_group(EULER) if quaternion is None else _normalise(quaternion)
    ratio = read_number(row, "eta") if "eta" in channels else None
    commands = {name: read_number(row, name) for name in row if name not in RESERVED}
    return attitude, commands, wrench, ratio


def _normalise(quaternion: list[float]) -> list[float]:
    """Return a unit quaternion as a log has it; NaN where the norm is not near one."""
    norm = math.sqrt(sum(element * element for element in quaternion))
    if abs(norm - 1.0) <= NORM_ROUNDING:
        return quaternion
    divisor = norm if abs(norm - 1.0) <= MAX_NORM_ERROR else math.nan
    return [element / divisor for element in quaternion]

"""Samples by the names of canonical columns: from a log, and as what a step takes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import ATTITUDE, EULER, RESERVED, SEGMENT
from hydrodamp.data.checks import MAX_NORM_ERROR, NORM_ROUNDING
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.identification.online import observe
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, prepare
from hydrodamp.vehicle.vehicle import Vehicle

#: One sample as a source gives it: numbers by the names of columns, and the segment.
Row = Mapping[str, object]

_RESERVED = frozenset(RESERVED)


def rows_of(log: Log) -> Iterator[Row]:
    """Yield the samples of a log."""
    columns = columns_of(log)
    for part in log.segments:
        for k in range(part.start, part.stop):
            yield {name: float(values[k]) for name, values in columns.items()} | {
                SEGMENT: part.name
            }


def read_number(row: Row, name: str, default: float = math.nan) -> float:
    """Return a number of a row; NaN where what stands there is none."""
    given = row.get(name, default)
    if isinstance(given, bool) or not isinstance(given, int | float):
        return math.nan
    try:
        return float(given)
    except OverflowError:  # an integer of more than 308 digits
        return math.nan


def read_velocity(row: Row, needed: Sequence[bool]) -> tuple[float, ...]:
    """Return the velocities; zero along locked axes."""
    return tuple(
        read_number(row, name) if is_free else 0.0
        for name, is_free in zip(VELOCITIES, needed, strict=True)
    )


def read_inputs(row: Row, names: Sequence[str]) -> tuple[float, ...]:
    """Return commands and the recorded wrench; an axis of the wrench is zero where absent."""
    return tuple(read_number(row, name, 0.0 if name in AXES else math.nan) for name in names)


def sample_equations(vehicle: Vehicle, model: DampingModel, row: Row) -> EquationTable:
    """Return equation 1 for samples like this one, or say what it lacks, as of a log."""
    time = read_number(row, "time")
    if not math.isfinite(time):
        raise ProblemError("a sample must have a finite `time` [s].")
    attitude, commands, wrench, ratio = _known(row)
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
    columns: EquationTable, row: Row, velocity: Sequence[float], previous: Sample | None
) -> Sample:
    """Return what a step takes; ``previous`` is that of the same run."""
    attitude, commands, wrench, ratio = _known(row)
    return observe(
        columns,
        time=read_number(row, "time"),
        velocity=velocity,
        attitude=(0.0, 0.0, 0.0) if attitude is None else attitude,
        commands=commands,
        wrench=wrench,
        propulsion_ratio=ratio,
        previous=previous,
    )


def _known(
    row: Row,
) -> tuple[list[float] | None, dict[str, float], list[float] | None, float | None]:
    """Return attitude, commands, wrench and propulsion ratio, as far as they are told."""
    attitude: list[float] | None = None
    if "qw" in row:
        attitude = _unit([read_number(row, name) for name in ATTITUDE.columns])
    elif "yaw" in row or "roll" in row:
        attitude = [read_number(row, name, 0.0) for name in EULER]
    wrench = [read_number(row, name, 0.0) for name in AXES] if any(a in row for a in AXES) else None
    ratio = read_number(row, "eta") if "eta" in row else None
    commands = {name: read_number(row, name) for name in row if name not in _RESERVED}
    return attitude, commands, wrench, ratio


def _unit(quaternion: list[float]) -> list[float]:
    """Return a quaternion of norm one, as a log has it."""
    norm = math.sqrt(sum(part * part for part in quaternion))
    if not abs(norm - 1.0) <= MAX_NORM_ERROR:
        return [math.nan] * 4
    return [part / norm for part in quaternion] if abs(norm - 1.0) > NORM_ROUNDING else quaternion

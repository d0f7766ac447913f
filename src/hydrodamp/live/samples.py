"""Samples of a stream: read the numbers of a row and fill equation 1 with them.

Plausible ranges of commands and recorded wrenches are derived from the vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.channels import ATTITUDE, EULER, PROPULSION_RATIO, RESERVED, SEGMENT
from hydrodamp.data.checks import NORM_ROUNDING, clock_faults
from hydrodamp.data.log import Log, columns_of
from hydrodamp.data.plausibility import MAX_ANGLES, MAX_NORM_ERROR, MAX_VELOCITY, SENTINELS
from hydrodamp.errors import HydrodampError, ProblemError
from hydrodamp.identification.online import observe
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, prepare
from hydrodamp.simulation.ranges import Ranges, ranges_of
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


def read_inputs(row: Row, names: Sequence[str], channels: Sequence[str]) -> tuple[float, ...]:
    """Return commands and the recorded wrench; an axis that is no channel is zero."""
    return tuple(
        0.0 if name in AXES and name not in channels else read_number(row, name) for name in names
    )


def sample_equations(
    vehicle: Vehicle, model: DampingModel, row: Row, channels: tuple[str, ...]
) -> tuple[EquationTable, Ranges]:
    """Return equation 1 and the plausible inputs for samples with the columns of this row.

    Raises ``ProblemError`` where the row lacks a required column or its time is not in seconds.
    """
    names = frozenset(name for name in row if math.isfinite(read_number(row, name)))
    if "time" not in names:
        raise ProblemError("a sample must have a finite `time` [s].")
    equations = _equations_or_fault(vehicle, model, channels, names.difference(channels))
    if isinstance(equations, str):
        raise ProblemError(equations)
    clock = np.full(2, read_number(row, "time"))
    for fault in clock_faults(clock, np.ones(2, np.bool_), str):
        raise ProblemError(f"sample: {fault}.")
    return equations


# A stream begins with any number of incomplete rows, and they have few different sets of columns.
@lru_cache(maxsize=1024)
def _equations_or_fault(
    vehicle: Vehicle, model: DampingModel, channels: tuple[str, ...], names: frozenset[str]
) -> tuple[EquationTable, Ranges] | str:
    zeros, has_attitude = np.zeros(2), not (_QUATERNION | _ANGLES).isdisjoint(channels)
    try:
        log = Log.from_arrays(
            [0.0, 1.0],
            {name: zeros for name in VELOCITIES if name in names},
            attitude=np.zeros((2, 3)) if has_attitude else None,
            commands=dict.fromkeys(sorted(names.difference(RESERVED)), zeros),
            wrench=None if frozenset(AXES).isdisjoint(channels) else np.zeros((2, 6)),
            propulsion_ratio=np.ones(2) if "eta" in channels else None,
            source="sample",
        )
        equations = prepare(vehicle, log, model).equations
    except HydrodampError as error:
        return str(error)
    commands = equations.required_commands
    return equations, ranges_of(vehicle, commands, actuators=equations.actuators)


def read_sample(
    equations: EquationTable,
    ranges: Ranges,
    channels: Sequence[str],
    row: Row,
    previous: Sample | None,
) -> Sample | str:
    """Return the input of an estimator step, or the class of a row with a fault.

    ``previous`` is the last sample of the segment.
    """
    free, time = equations.plant.free.tolist(), read_number(row, "time")
    pairs = zip(VELOCITIES, free, strict=True)
    velocity = [read_number(row, name) if is_free else 0.0 for name, is_free in pairs]
    inputs = read_inputs(row, ranges.names, channels)
    if not all(map(math.isfinite, (time, *velocity, *inputs))):
        return "incomplete"
    excess = [x for x, limit in zip(inputs, ranges.largest, strict=True) if abs(x) > limit]
    if excess and SENTINELS.issuperset(excess):
        return "incomplete"
    angles = {name: read_number(row, name) for name in EULER if name in channels}
    excess += [angle for name, angle in angles.items() if abs(angle) > MAX_ANGLES[name]]
    if excess or max(map(abs, velocity)) > MAX_VELOCITY:
        return "absurd"
    attitude, commands, wrench, ratio = _read_channels(row, channels)
    try:
        sample = observe(
            equations,
            time=time,
            velocity=velocity,
            attitude=(0.0, 0.0, 0.0) if attitude is None else attitude,
            commands=commands,
            wrench=wrench,
            propulsion_ratio=ratio,
            previous=previous,
        )
    except ProblemError:
        return "incomplete"
    return "absurd" if np.abs(sample.propulsion).max() > MAX_VELOCITY else sample


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

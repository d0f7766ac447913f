"""Samples of a stream: read the numbers of a row and fill equation 1 with them.

Plausible ranges of commands and recorded wrenches are derived from the vehicle.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import ATTITUDE, EULER, PROPULSION_RATIO, RESERVED, SEGMENT
from hydrodamp.data.checks import MAX_NORM_ERROR, MAX_VELOCITY, NORM_ROUNDING
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.identification.adaptive import observe
from hydrodamp.identification.recursive import TYPICAL_VELOCITY
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, prepare
from hydrodamp.vehicle.actuators import Actuator
from hydrodamp.vehicle.vehicle import Vehicle

#: One sample as a source provides it: numbers by canonical column, and the segment.
Row = Mapping[str, object]

_QUATERNION, _ANGLES = frozenset(ATTITUDE.columns), frozenset(EULER)
#: Columns that a stream may have or lack; it keeps those of its first accepted row.
_OPTIONAL = frozenset((*_QUATERNION, *_ANGLES, *AXES, *PROPULSION_RATIO.columns))

#: Largest integers of MAVLink, which mean "unknown": INT16_MAX, UINT16_MAX, INT32_MAX, UINT32_MAX.
SENTINELS = frozenset((32767.0, 65535.0, 2147483647.0, 4294967295.0))

MAX_FIELD = 2.0**32  # largest integer field of an autopilot's message
MAX_COMMAND_RATIO = 10.0  # command over the actuator's limit; by choice: autopilots exceed it
ORDINARY_SHARE = 0.01  # of the largest plausible acceleration: 0.5 m/s^2 or rad/s^2
MAGNITUDES = np.geomspace(1e-6, MAX_FIELD, 2000)  # candidate inputs, 2 % apart


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


class Ranges(NamedTuple):
    """Inputs of equation 1, their largest plausible and their ordinary magnitudes.

    An input within its ordinary magnitude is never an outlier.
    """

    names: tuple[str, ...] = ()
    largest: tuple[float, ...] = ()
    ordinary: tuple[float, ...] = ()


def ranges_of(equations: EquationTable) -> Ranges:
    """Return the ranges of the needed commands and, without actuators, of a recorded wrench.

    The largest plausible input accelerates the vehicle from rest to the largest plausible
    velocity within a second, and no propeller sustains more than that velocity.
    """
    vehicle = equations.vehicle
    actuators = vehicle.actuators if equations.actuators else ()
    pairs = [_command_range(vehicle, actuators, name) for name in equations.required_commands]
    names = equations.required_commands
    if not equations.actuators:
        bounds = _wrench_bounds(vehicle).tolist()
        names = (*names, *AXES)
        pairs += [(bound, ORDINARY_SHARE * bound) for bound in bounds]
    largest, ordinary = zip(*pairs, strict=True) if pairs else ((), ())
    return Ranges(names, largest, ordinary)


def _command_range(
    vehicle: Vehicle, actuators: tuple[Actuator, ...], name: str
) -> tuple[float, float]:
    """Return the ranges of a command; its limit is stated, or the end of the thrust curve."""
    used = [actuator for actuator in actuators if name in actuator.commands]
    if not used:
        return MAX_FIELD, 0.0
    magnitudes, at_rest = np.append(0.0, MAGNITUDES), np.zeros(len(MAGNITUDES) + 1)
    commands = {**dict.fromkeys(vehicle.commands, at_rest), name: magnitudes}
    velocity, down = np.tile(TYPICAL_VELOCITY, (len(at_rest), 1)), np.zeros((len(at_rest), 3))
    wrench = vehicle.known_wrench(velocity, down, commands)
    effect = (np.abs(wrench - wrench[0]) / _wrench_bounds(vehicle)).max(axis=1)
    speed = vehicle.propulsion_speed(commands)
    is_too_fast = np.abs(at_rest if speed is None else speed) > MAX_VELOCITY
    largest = magnitudes[(effect > 1.0) | is_too_fast].min(initial=MAX_FIELD)
    limits = [limit for limit in map(_limit, used) if limit is not None]
    if limits:
        return min(float(largest), MAX_COMMAND_RATIO * max(limits)), max(limits)
    exceeds = effect > ORDINARY_SHARE
    return float(largest), float(magnitudes[exceeds.argmax()])


def _limit(actuator: Actuator) -> float | None:
    curve = getattr(actuator, "curve", None) or ()
    limit: float | None = getattr(actuator, "limit", None)
    return max((abs(row[0]) for row in curve), default=None) if limit is None else limit


def _wrench_bounds(vehicle: Vehicle) -> np.ndarray:
    """Return the largest plausible force [N] and moment [N m] by axis; infinite where locked.

    A moment is that of the force at the radius of gyration.
    """
    inertia = np.where(vehicle.free, vehicle.mass_matrix.diagonal(), np.nan)
    mass = float(np.nanmax([*inertia[:3], 0.0])) or float(np.nanmax(inertia))
    scale = np.concatenate([inertia[:3], np.sqrt(mass * inertia[3:])])
    return np.where(vehicle.free, MAX_VELOCITY * scale, np.inf)

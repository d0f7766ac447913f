"""Plausible ranges of commands and recorded wrenches, derived from the vehicle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from hydrodamp.basis.term import AXES
from hydrodamp.data.checks import MAX_VELOCITY
from hydrodamp.identification.recursive import TYPICAL_VELOCITY
from hydrodamp.kernels.plant import Plant
from hydrodamp.simulation.problem import EquationTable
from hydrodamp.vehicle.actuators import Actuator
from hydrodamp.vehicle.vehicle import Vehicle

#: Largest integers of MAVLink, which mean "unknown": INT16_MAX, UINT16_MAX, INT32_MAX, UINT32_MAX.
SENTINELS = frozenset((32767.0, 65535.0, 2147483647.0, 4294967295.0))

MAX_FIELD = 2.0**32  # largest integer field of an autopilot's message
MAX_COMMAND_RATIO = 10.0  # command over the actuator's limit; by choice: autopilots exceed it
ORDINARY_SHARE = 0.01  # of the largest plausible acceleration: 0.5 m/s^2 or rad/s^2
MAGNITUDES = np.geomspace(1e-6, MAX_FIELD, 2000)  # candidate inputs, 2 % apart


class Ranges(NamedTuple):
    """Names of the inputs of equation 1, their largest plausible and their ordinary magnitudes.

    An input within its ordinary magnitude is never an outlier.
    """

    names: tuple[str, ...]
    largest: tuple[float, ...]
    ordinary: tuple[float, ...]


_CACHE: WeakKeyDictionary[Plant, Ranges] = WeakKeyDictionary()


def ranges_of(equations: EquationTable) -> Ranges:
    """Return the ranges of a table of equation 1, computed once."""
    if (ranges := _CACHE.get(equations.plant)) is None:
        ranges = _CACHE[equations.plant] = _compute_ranges(equations)
    return ranges


def _compute_ranges(equations: EquationTable) -> Ranges:
    """Return the ranges of the needed commands and, without actuators, of a recorded wrench.

    The largest plausible input accelerates the vehicle from rest to the largest plausible
    velocity within a second, and no propeller sustains more than that velocity.
    """
    vehicle = equations.vehicle
    actuators = vehicle.actuators if equations.actuators else ()
    pairs = [_command_range(vehicle, actuators, name) for name in equations.required_commands]
    names = equations.required_commands
    if not equations.actuators:
        names, pairs = (*names, *AXES), [*pairs, *_wrench_ranges(vehicle)]
    largest, ordinary = zip(*pairs, strict=True) if pairs else ((), ())
    return Ranges(names, largest, ordinary)


def _command_range(
    vehicle: Vehicle, actuators: tuple[Actuator, ...], name: str
) -> tuple[float, float]:
    if not any(name in actuator.commands for actuator in actuators):
        return MAX_FIELD, 0.0
    magnitudes = np.append(0.0, MAGNITUDES)
    commands = {command: np.zeros(len(magnitudes)) for command in vehicle.commands}
    commands[name] = magnitudes
    wrench = vehicle.known_wrench(
        np.tile(TYPICAL_VELOCITY, (len(magnitudes), 1)), np.zeros((len(magnitudes), 3)), commands
    )
    effect = (np.abs(wrench - wrench[0]) / _wrench_bounds(vehicle)).max(axis=1)
    speed = vehicle.propulsion_speed(commands)
    is_too_fast = np.zeros(len(magnitudes)) if speed is None else np.abs(speed) > MAX_VELOCITY
    largest = _first(magnitudes, (effect > 1.0) | (is_too_fast > 0), MAX_FIELD)
    ordinary = _first(magnitudes, effect > ORDINARY_SHARE, 0.0)
    if limits := [*_limits(actuators, name)]:
        return min(largest, MAX_COMMAND_RATIO * max(limits)), max(limits)
    return largest, ordinary


def _limits(actuators: tuple[Actuator, ...], name: str) -> Iterator[float]:
    """Yield the limits of a command: those stated, and the ends of thrust curves."""
    for actuator in actuators:
        if name in actuator.commands:
            if (limit := getattr(actuator, "limit", None)) is not None:
                yield limit
            elif curve := getattr(actuator, "curve", None):
                yield max(abs(row[0]) for row in curve)


def _first(magnitudes: np.ndarray, exceeds: np.ndarray, otherwise: float) -> float:
    return float(magnitudes[np.argmax(exceeds)]) if exceeds.any() else otherwise


def _wrench_bounds(vehicle: Vehicle) -> np.ndarray:
    """Return the largest plausible force [N] and moment [N m] by axis; infinite where locked.

    A moment is that of the force at the radius of gyration.
    """
    inertia = np.where(vehicle.free, vehicle.mass_matrix.diagonal(), np.nan)
    mass = float(np.nanmax([*inertia[:3], 0.0])) or float(np.nanmax(inertia))
    scale = np.concatenate([inertia[:3], np.sqrt(mass * inertia[3:])])
    return np.where(vehicle.free, MAX_VELOCITY * scale, np.inf)


def _wrench_ranges(vehicle: Vehicle) -> Iterator[tuple[float, float]]:
    for bound in _wrench_bounds(vehicle).tolist():
        yield bound, ORDINARY_SHARE * bound

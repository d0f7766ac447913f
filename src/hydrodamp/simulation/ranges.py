"""Plausible ranges of commands and wrenches of a vehicle, and the samples of a log beyond them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.conditioning.dropouts import Masks, remove_samples
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import PROPULSION_RATIO
from hydrodamp.data.log import Log
from hydrodamp.data.plausibility import (
    MAX_VELOCITY,
    MIN_SAMPLES,
    describe_outliers,
    find_isolated,
    find_sentinels,
    warn_outliers,
)
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.actuators import Actuator
from hydrodamp.vehicle.vehicle import Vehicle

#: u v w [m/s] p q r [rad/s]; scales of the terms on board, where there is no log.
TYPICAL_VELOCITY = (1.0, 0.1, 0.1, 0.1, 0.1, 0.1)

MAX_FIELD = 2.0**32  # largest integer field of an autopilot's message
MAX_COMMAND_RATIO = 10.0  # command over the actuator's limit; by choice: autopilots exceed it
ORDINARY_SHARE = 0.01  # of the largest plausible acceleration: 0.5 m/s^2 or rad/s^2
MAGNITUDES = np.geomspace(1e-6, MAX_FIELD, 2000)  # candidate inputs, 2 % apart
MIN_OUTLIER_STEP = 0.5  # m/s, rad/s or of a unit vector, least change of an outlier; by choice
#: Largest plausible and ordinary size of velocities [m/s, rad/s] and accelerations (per second).
SENSED_RANGE = (MAX_VELOCITY, MIN_OUTLIER_STEP)


class Ranges(NamedTuple):
    """Inputs of equation 1, their largest plausible and their ordinary magnitudes.

    An input within its ordinary magnitude is never an outlier.
    """

    names: tuple[str, ...] = ()
    largest: tuple[float, ...] = ()
    ordinary: tuple[float, ...] = ()


@lru_cache(maxsize=64)
def ranges_of(vehicle: Vehicle, commands: tuple[str, ...], *, actuators: bool) -> Ranges:
    """Return the ranges of the needed commands and, without actuators, of a recorded wrench.

    The largest plausible input accelerates the vehicle from rest to the largest plausible
    velocity within a second, and no propeller sustains more than that velocity.
    """
    used, names = vehicle.actuators if actuators else (), commands
    pairs = [_command_range(vehicle, used, name) for name in commands]
    if not actuators:
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


def remove_implausible(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Log:
    """Return a log without implausible samples of what equation 1 uses, with a warning of each.

    A short gap of a velocity is interpolated; the log is cut where a command has no value.
    """
    if log.n < MIN_SAMPLES:
        return log
    sensed = {
        name: SENSED_RANGE
        for axis in vehicle.axes
        for name in (VELOCITY_OF[axis], f"d{VELOCITY_OF[axis]}")
    }
    for ranges, longest in ((sensed, None), (_command_ranges(vehicle, log, models), 0.0)):
        masks = Masks()
        for name, values in columns_of(log).items():
            if name in ranges:
                masks[name], reason = _find_implausible(values, *ranges[name])
                if reason:
                    sentence = describe_outliers(name, values, masks[name], log.time, reason)
                    warn_outliers(log.source, sentence)
        log = remove_samples(log, masks, "implausible", longest)
    return log


def _command_ranges(
    vehicle: Vehicle, log: Log, models: Sequence[DampingModel]
) -> dict[str, tuple[float, float]]:
    """Return the ranges of the commands that equation 1 uses, of a wrench and of the ratio."""
    actuators = bool(vehicle.actuators) and log.wrench is None
    names = {name for model in models for name in model.commands}
    names |= set(vehicle.commands if actuators else ())
    ranges = ranges_of(vehicle, tuple(sorted(names)), actuators=actuators)
    limits = zip(ranges.largest, ranges.ordinary, strict=True)
    free = dict.fromkeys(PROPULSION_RATIO.columns, (np.inf, np.inf))  # large at low speed
    return dict(zip(ranges.names, limits, strict=True)) | free


def _find_implausible(values: FloatArray, largest: float, ordinary: float) -> tuple[BoolArray, str]:
    """Return which samples of a channel are implausible, and why."""
    kinds = {
        f"beyond {largest:.3g}": np.abs(values) > largest,
        "unknown to MAVLink": find_sentinels(values),
    }
    mask = np.logical_or.reduce([*kinds.values()])
    kinds["far from all others"] = isolated = np.zeros_like(mask)
    isolated[~mask] = find_isolated(values[~mask], ordinary)
    return mask | isolated, ", ".join(reason for reason, rows in kinds.items() if rows.any())

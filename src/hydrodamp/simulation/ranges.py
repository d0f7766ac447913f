"""Plausible ranges of commands and wrenches of a vehicle, and the samples of a log beyond them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from itertools import compress
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.conditioning.dropouts import (
    Masks,
    is_invalid_velocity,
    remove_samples,
    true_runs,
)
from hydrodamp.data.channels import PROPULSION_RATIO
from hydrodamp.data.log import Log, columns_of
from hydrodamp.data.plausibility import (
    MAX_RATIO,
    MAX_VELOCITY,
    MIN_SAMPLES,
    UNKNOWN,
    describe_outliers,
    find_isolated,
    find_sentinels,
    find_unknown,
    warn_outliers,
)
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.actuators import Actuator
from hydrodamp.vehicle.vehicle import Vehicle

#: u v w [m/s] p q r [rad/s]; scales of the terms on board, where there is no log.
TYPICAL_VELOCITY = (1.0, 0.1, 0.1, 0.1, 0.1, 0.1)

MAX_FIELD = 2.0**32  # largest integer field of an autopilot's message
MAX_FIELD_RATIO = 2.0**16  # of a command with an unknown effect to all others, least: of 16 bits
MAX_COMMAND_RATIO = 10.0  # command over the actuator's limit; by choice: autopilots exceed it
ORDINARY_SHARE = 0.01  # of the largest plausible acceleration: 0.5 m/s^2 or rad/s^2
STRONG_SHARE = 0.1  # of the largest plausible acceleration: 5 m/s^2, above which few vehicles are
MAGNITUDES = np.geomspace(1e-6, MAX_FIELD, 2000)  # candidate inputs, 2 % apart
MIN_OUTLIER_STEP = 0.5  # m/s, rad/s or of a unit vector, least change of an outlier; by choice


class Ranges(NamedTuple):
    """Inputs of equation 1, their largest plausible, their ordinary and their strong magnitudes.

    An input within its ordinary magnitude is never an outlier of a stream, within its strong
    magnitude never one of a log; zero where its effect is unknown.
    """

    names: tuple[str, ...] = ()
    largest: tuple[float, ...] = ()
    ordinary: tuple[float, ...] = ()
    strong: tuple[float, ...] = ()


@lru_cache(maxsize=64)
def ranges_of(vehicle: Vehicle, commands: tuple[str, ...], *, actuators: bool) -> Ranges:
    """Return the ranges of the needed commands and, without actuators, of a wrench on free axes.

    The largest plausible input accelerates the vehicle from rest to the largest plausible
    velocity within a second, and no propeller sustains more than that velocity.
    """
    used, names = vehicle.actuators if actuators else (), commands
    pairs = [_command_range(vehicle, used, name) for name in commands]
    if not actuators:
        bounds = _wrench_bounds(vehicle)[vehicle.free].tolist()
        names = (*names, *compress(AXES, vehicle.free))
        pairs += [(bound, ORDINARY_SHARE * bound, STRONG_SHARE * bound) for bound in bounds]
    return Ranges(names, *zip(*pairs, strict=True))


def _command_range(
    vehicle: Vehicle, actuators: tuple[Actuator, ...], name: str
) -> tuple[float, float, float]:
    """Return the ranges of a command; its limit is stated, or the end of the thrust curve.

    Beyond its limit, a command has no further effect.
    """
    used = [each for each in actuators if name in each.commands]
    used = [each for each in used if name != getattr(each, "voltage", None)]
    if not used:
        return MAX_FIELD, 0.0, 0.0
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
        largest = min(float(largest), MAX_COMMAND_RATIO * max(limits))
        return largest, max(limits), largest
    shares = ORDINARY_SHARE, STRONG_SHARE
    ordinary, strong = (float(magnitudes[(effect > share).argmax()]) for share in shares)
    return float(largest), ordinary, strong


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
    sensed: dict[str, _Test] = {VELOCITY_OF[axis]: _find_wild_velocities for axis in vehicle.axes}
    sensed |= {f"d{name}": partial(_find_excess, MAX_VELOCITY) for name in sensed}
    for find, longest in ((sensed, None), (_command_tests(vehicle, log, models), 0.0)):
        masks = Masks()
        for name, values in columns_of(log).items():
            if name in find:
                kinds = find[name](values, log)
                reason, excess = next(iter(kinds.items()))
                if 2 * excess.sum() > log.n:
                    sentence = f"`{name}`: {excess.sum()} of {log.n} samples are {reason}"
                    warn_outliers(
                        log.source, f"{sentence}: check its column and unit; all are kept"
                    )
                    continue
                masks[name] = mask = np.logical_or.reduce([*kinds.values()])
                if reason := ", ".join(reason for reason, rows in kinds.items() if rows.any()):
                    sentence = describe_outliers(name, values, mask, log.time, reason)
                    warn_outliers(log.source, sentence)
        log = remove_samples(log, masks, "implausible", longest)
    return log


#: Channel and its log -> for each reason, which samples are implausible.
_Test = Callable[[FloatArray, Log], dict[str, BoolArray]]


def _command_tests(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> dict[str, _Test]:
    """Return the tests of the commands that equation 1 uses, of a wrench and of the ratio."""
    actuators = bool(vehicle.actuators) and log.wrench is None
    names = {name for model in models for name in model.commands}
    names |= set(vehicle.commands if actuators else ())
    ranges = ranges_of(vehicle, tuple(sorted(names)), actuators=actuators)
    used = vehicle.actuators if actuators else ()
    positive = {name for each in used if _has_unknown(each) for name in each.commands}
    tests: dict[str, _Test] = {
        name: partial(_find_wild_inputs, bounds, name in positive)
        for name, *bounds in zip(*ranges, strict=True)
    }
    # The ratio is large at low speed.
    ratio: _Test = partial(_find_wild_inputs, (np.inf, 0.0, np.inf), False)
    return tests | dict.fromkeys(PROPULSION_RATIO.columns, ratio)


def _has_unknown(actuator: Actuator) -> bool:
    """Whether -1 means "unknown": of a propeller speed, and without a negative range."""
    lowest = min((row[0] for row in getattr(actuator, "curve", None) or ()), default=UNKNOWN)
    return getattr(actuator, "speed_slope", None) is not None or bool(lowest >= 0.0)


def _find_wild_inputs(
    bounds: Sequence[float], has_unknown: bool, values: FloatArray, log: Log
) -> dict[str, BoolArray]:
    """Return implausible commands: a single pulse of an idle actuator is plausible."""
    largest, ordinary, strong = bounds
    kinds = _find_excess(largest, values, log, ordinary)
    if has_unknown:
        kinds[_SENTINEL] |= find_unknown(values)
    usual = ~np.logical_or.reduce([*kinds.values()])
    kinds["far from all others"] = isolated = np.zeros_like(usual)
    ratio = MAX_RATIO if strong else MAX_FIELD_RATIO
    isolated[usual] = find_isolated(values[usual], strong, ratio)
    size = np.abs(values[usual & ~isolated])
    if strong and isolated.any() and size.max() > MAX_RATIO * np.median(size):
        isolated[:] = False
    return kinds


def _find_wild_velocities(values: FloatArray, log: Log) -> dict[str, BoolArray]:
    """Return implausible velocities: no vehicle reaches the largest one within a second."""
    isolated = find_isolated(values, MIN_OUTLIER_STEP)
    jumps = np.abs(np.diff(values)) > MAX_VELOCITY * np.diff(log.time)
    for start, stop in true_runs(isolated):
        isolated[start:stop] = jumps[max(start - 1, 0)] & jumps[min(stop, log.n - 1) - 1]
    sentinel = is_invalid_velocity(values, np.inf)
    sentinel &= np.abs(values) > MAX_RATIO * np.abs(values[~sentinel]).max(initial=0.0)
    kinds = {"far from all others": isolated & ~sentinel, "unknown to a DVL": sentinel}
    return _find_excess(MAX_VELOCITY, values, log) | kinds


_SENTINEL = "unknown to MAVLink"


def _find_excess(
    largest: float, values: FloatArray, log: Log, ordinary: float = 0.0
) -> dict[str, BoolArray]:
    """Return the values beyond a limit and the sentinels."""
    excess, unknown = np.abs(values) > largest, find_sentinels(values, ordinary, largest)
    return {f"beyond {largest:.3g}": excess & ~unknown, _SENTINEL: unknown}

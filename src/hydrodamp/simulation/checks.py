"""What a log provides for equation 1: its actuator wrench, and checks of the data required.

The actuator wrench is also given as channels of terms, so that actuator gains can be estimated.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from difflib import get_close_matches

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.basis.term import AXES, RESERVED, VELOCITY_OF
from hydrodamp.conditioning.derivatives import constant_angles, derivable_rates
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError, demand, did_you_mean, list_faults
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.actuators import Thruster
from hydrodamp.vehicle.vehicle import Vehicle

#: By axis, the wrench at each sample, held, and its increment until the next sample: with both, a
#: gain is independent of sample-and-hold, interpolation, and delays of a fraction of a step.
CHANNELS = {axis: (f"actuation_{axis}", f"actuation_rise_{axis}") for axis in AXES}

#: Axis of each actuation channel.
CHANNEL_AXES = {name: axis for axis, names in CHANNELS.items() for name in names}


def channel_names(vehicle: Vehicle, log: Log) -> tuple[str, ...]:
    """Return the names of the actuation channels that log and vehicle provide."""
    axes = vehicle.axes if log.wrench is not None or vehicle.actuators else ()
    return tuple(name for axis in axes for name in CHANNELS[axis])


def recorded_wrench(vehicle: Vehicle, log: Log) -> FloatArray:
    """Return the recorded wrench on free axes, times its gains; zero without one, shape (n, 6)."""
    wrench = np.zeros((log.n, 6)) if log.wrench is None else log.wrench
    return np.asarray(wrench * vehicle.free * vehicle.wrench_gain)


def actuation(vehicle: Vehicle, log: Log) -> FloatArray:
    """Return the recorded wrench, else that of the vehicle's actuators, shape (n, 6)."""
    if log.wrench is not None:
        return recorded_wrench(vehicle, log)
    commands = {name: log.command(name) for name in log.command_names}
    weightless = replace(vehicle, weight=0.0, buoyancy=0.0)
    return weightless.known_wrench(log.velocity * vehicle.free, log.down, commands)


def actuation_channels(vehicle: Vehicle, log: Log) -> dict[str, FloatArray]:
    """Return the actuation channels of every axis."""
    wrench = actuation(vehicle, log)
    channels = np.stack([wrench, wrench_rise(wrench, log)], axis=2)
    names = [name for pair in CHANNELS.values() for name in pair]
    return dict(zip(names, channels.reshape(log.n, -1).T, strict=True))


def wrench_rise(wrench: FloatArray, log: Log) -> FloatArray:
    """Return the increment of a wrench until the next sample of its segment, shape (n, 6)."""
    rise = np.diff(wrench, axis=0, append=wrench[-1:])
    rise[log.bounds[:, 1] - 1] = 0.0
    return rise


def held_propulsion(log: Log, velocity: FloatArray, speed: FloatArray | None) -> FloatArray:
    """Return u_c of the step that begins at each sample, and at the end of one that ends there."""
    if log.propulsion_ratio is not None or speed is None:
        ratio = 1.0 if log.propulsion_ratio is None else log.propulsion_ratio
        recorded = ratio * guarded_speed(velocity)
        return np.column_stack([recorded, recorded])
    closing = np.concatenate([speed[:1], speed[:-1]])
    starts = log.bounds[:, 0]
    closing[starts] = speed[starts]
    return np.column_stack([speed, closing])


#: End of the key of a model with the gains of the actuators.
GAINS = "+gains"


def with_gains(vehicle: Vehicle, log: Log, model: DampingModel) -> DampingModel:
    """Add an actuator gain to a model on each axis with a varying wrench.

    The coefficient of ``actuation_X`` on X is the deviation of the gain from 1.
    """
    has_wrench = bool(channel_names(vehicle, log))
    driven = (
        np.ptp(actuation(vehicle, log), axis=0) > 0.0 if has_wrench else np.zeros(6, dtype=bool)
    )
    terms = {axis: CHANNELS[axis] for axis in np.array(AXES)[driven & vehicle.free].tolist()}
    if not terms:
        raise ProblemError(
            f"{log.source or 'log'}: no actuator gain can be estimated without a varying "
            f"wrench: record the columns X Y Z K M N, or add actuators to '{vehicle.name}'."
        )
    extended = model.with_terms(terms, key=f"{model.key}{GAINS}")
    return replace(extended, title=f"{model.title} with estimated actuator gains")


#: Smallest share of a force along x, and lever over the radius of gyration, that has a sure sign.
_MIN_SHARE_OF_FORCE, _MIN_RELATIVE_LEVER = 0.3, 0.2


def thruster_signs(vehicle: Vehicle) -> dict[tuple[str, str], int]:
    """Return the signs of u and r, by command, that positions and directions of thrusters give."""
    inertia, signs = vehicle.mass_matrix.diagonal(), dict[tuple[str, str], int]()
    gyration = float(np.sqrt(inertia[5] / inertia[0])) if inertia[0] > 0.0 else 0.0
    for each in vehicle.actuators:
        if isinstance(each, Thruster):
            rise = each.gain if each.curve is None else each.curve[-1][1] - each.curve[0][1]
            force = np.sign(rise or 0.0) * np.array(each.direction)
            moment = float(np.cross(each.position, force)[2])
            if abs(force[0]) > _MIN_SHARE_OF_FORCE:
                signs[each.command, "u"] = int(np.sign(force[0]))
            if abs(moment) > _MIN_RELATIVE_LEVER * gyration:
                signs[each.command, "r"] = int(np.sign(moment))
    return signs


_LENGTH_IN_GYRATION_RADII = 4.0  # of a hull


def check_log(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> None:
    """Raise if a log lacks data that the vehicle or a term requires."""
    demand(isinstance(log, Log), "log", "one log; `concatenate` joins several", type(log).__name__)
    if faults := list(missing_data(vehicle, log, models)):
        raise ProblemError(list_faults(log.source or "log", faults))


def missing_data(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[str]:
    """Yield a message for each kind of required data that a log lacks."""
    yield from _velocities(vehicle, log)
    yield from _sensors(log)
    yield from _commands(vehicle, log, models)
    yield from _attitude(vehicle, log, models)


def unused_commands(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> Iterator[str]:
    """Yield a message on the commands that no actuator and no term uses."""
    used = {*vehicle.commands, *(name for model in models for name in model.commands)}
    idle = [name for name in log.command_names if name not in used]
    if idle and (log.wrench is not None or len(idle) < len(log.command_names)):
        # A high cutoff: most command names are not misspelt reserved names.
        similar = [(name, get_close_matches(name, RESERVED, n=1, cutoff=0.8)) for name in idle]
        hint = "".join(did_you_mean(name, reserved) for name, reserved in similar)
        yield (
            f"commands not used by any actuator of '{vehicle.name}' or any term of the models: "
            f"{_quoted(idle)}.{hint}"
        )


def estimate_length(vehicle: Vehicle) -> float | None:
    """Estimate the length [m]: four radii of gyration, without added mass where it is known."""
    added = 0.0 if vehicle.added_mass is None else vehicle.added_mass
    inertia = (vehicle.mass_matrix - added).diagonal()
    for rotation, translation in (("N", "Y"), ("M", "Z")):
        if {rotation, translation} <= set(vehicle.axes):
            moment, mass = inertia[AXES.index(rotation)], inertia[AXES.index(translation)]
            return _LENGTH_IN_GYRATION_RADII * float(np.sqrt(moment / mass))
    return None


def missing_actuation(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] = ()) -> str:
    """Return a message if a log has neither wrench nor a used command, else an empty string."""
    of_terms = {name for model in models for name in model.commands}
    recorded = log.command_names
    if log.wrench is not None or not (of_terms | set(vehicle.commands)).isdisjoint(recorded):
        return ""
    commands = f"vehicle '{vehicle.name}' has no actuators"
    remedy = "give it `actuators` in its file (`hydrodamp vehicle new` writes examples)"
    if vehicle.commands:
        commands = f"the actuators of '{vehicle.name}' take {' '.join(vehicle.commands)}"
        similar = (get_close_matches(name, recorded, n=1, cutoff=0.7) for name in vehicle.commands)
        pairs = zip(vehicle.commands, similar, strict=True)
        # COLUMN where no name is similar: a wrong guess is worse than none.
        renamed = ", ".join(f"{name}: {(*matches, 'COLUMN')[0]}" for name, matches in pairs)
        remedy = f"map their names by `commands: {{{renamed}}}` in a mapping"
    if of_terms:
        commands += f", the terms of the models take {' '.join(sorted(of_terms))}"
    if not recorded:
        return (
            "the log has no actuation: it needs the wrench columns X Y Z K M N or a command that "
            f"an actuator or a term uses; {commands}. Record either."
        )
    gains = f"{{{' '.join(vehicle.axes)}: {' '.join(recorded)}}}"
    return (
        f"{commands}, and the log has only the commands {' '.join(recorded)} and no wrench: their "
        "force is unknown. Estimate their gains as coefficients: use the model `general`, which "
        "has all, or `sparse`, which selects them, or a model file with the line `{name: mine, "
        f"extends: linear, terms: {gains}}}` without impossible terms; or {remedy}; or record the "
        "wrench X Y Z K M N."
    )


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def _velocities(vehicle: Vehicle, log: Log) -> Iterator[str]:
    needed = [VELOCITY_OF[axis] for axis in vehicle.axes]
    missing = [name for name in needed if name not in observed_velocities(log)]
    if missing:
        yield (
            f"vehicle '{vehicle.name}' has the free axes {' '.join(vehicle.axes)} and needs the "
            f"columns {' '.join(needed)}; {' '.join(missing)} not found. Record them, or a sensor "
            "that observes them (position, attitude, specific force), or name fewer `axes` in the "
            "vehicle file."
        )
    yield from constant_angles(log, missing)


#: Kinds of measurements whose output equation has the rotation matrix.
_ROTATED = ("position", "specific_force")


def _sensors(log: Log) -> Iterator[str]:
    has_attitude = log.attitude is not None or any(
        each.kind == "attitude" for each in log.measurements
    )
    for each in log.measurements:
        if each.kind in _ROTATED and not has_attitude and each.components != ("down",):
            yield (
                f"the sensor `{each.name}` measures {each.kind.replace('_', ' ')}, which needs the "
                "attitude: record roll pitch yaw, or the heading of a vehicle that stays level."
            )


#: Velocities that the components of a sensor observe.
_OBSERVED = {
    "position": {"north": "uvw", "east": "uvw", "down": "uvw"},
    "attitude": {"roll": "pqr", "pitch": "pqr", "yaw": "qr"},
    "specific_force": {"x": "uvw", "y": "uvw", "z": "uvw"},
}


def observed_velocities(log: Log) -> set[str]:
    """Return the velocities that a log or one of its sensors observes."""
    observed = {*log.velocity_names}
    for each in log.measurements:
        table = _OBSERVED.get(each.kind, {})
        observed |= {name for axis in each.components for name in table.get(axis, axis)}
    if log.position is not None:
        observed |= {*"uvw"}
    if log.attitude is not None:
        observed |= {*derivable_rates(log.attitude)}
    return observed


def _commands(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[str]:
    recorded = set(log.command_names)
    of_terms = {name for model in models for name in model.commands}
    of_actuators = set(vehicle.commands)
    if log.wrench is not None and recorded & of_actuators:
        yield (
            "both the wrench columns X Y Z K M N and commands of the vehicle's actuators "
            f"({' '.join(sorted(recorded & of_actuators))}) are present, which would count the "
            "actuators twice: drop the wrench columns to use the vehicle's actuators, or drop "
            "those commands to use the recorded wrench."
        )
    if message := missing_actuation(vehicle, log, models):
        yield message
        return
    recorded |= set(channel_names(vehicle, log))
    users = {"a term": of_terms - recorded}
    if log.wrench is None:
        users[f"an actuator of '{vehicle.name}'"] = of_actuators - of_terms - recorded
    lacking = [
        f"{_quoted(sorted(names))}, which {user} uses" for user, names in users.items() if names
    ]
    if lacking:
        names = sorted(set().union(*users.values()))
        similar = ((name, get_close_matches(name, recorded, n=1, cutoff=0.7)) for name in names)
        hint = "".join(did_you_mean(name, matches) for name, matches in similar)
        yield (
            f"there is no command {', nor '.join(lacking)}.{hint} The log has "
            f"{_quoted(log.command_names) or 'no command'}. A mapping imports a "
            "command only if it names the column under `commands`."
        )


def _attitude(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[str]:
    if log.attitude is not None or set(vehicle.axes) <= {"X", "Y", "N"}:
        return
    has_restoring = np.any(vehicle.restoring_matrix[vehicle.free])
    terms = sorted({str(t) for model in models for t in model.basis if t.needs_attitude})
    if has_restoring or terms:
        users = f"terms {' '.join(terms)}" if terms else "weight, buoyancy and their centres"
        yield (
            f"the attitude is missing, and {users} depend on it: record roll pitch yaw [rad] or "
            "qw qx qy qz."
        )


def command_ranges(log: Log) -> dict[str, tuple[float, float]]:
    """Return the minimum and maximum of each command."""
    ends = log.commands.min(axis=0).tolist(), log.commands.max(axis=0).tolist()
    return dict(zip(log.command_names, zip(*ends, strict=True), strict=True))

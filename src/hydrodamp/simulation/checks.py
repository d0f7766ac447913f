"""Whether a log holds what a vehicle and its models need."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.atoms import AXES, RESERVED, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError, did_you_mean, list_faults
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.actuation import channel_names
from hydrodamp.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from hydrodamp.ingest.inspection.quality_report import Requirements


_RADII = 4.0  # in the length of a hull


def check_log(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> None:
    """Refuse a log that lacks what the vehicle or a term needs."""
    if faults := list(missing_data(vehicle, log, models)):
        raise ProblemError(list_faults(log.source or "log", faults))


def missing_data(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[str]:
    """Say what the vehicle or a term needs and a log lacks."""
    yield from _velocities(vehicle, log)
    yield from _commands(vehicle, log, models)
    yield from _attitude(vehicle, log, models)


def unused_commands(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> Iterator[str]:
    """Say which columns no actuator and no term uses."""
    used = {*vehicle.commands, *(name for model in models for name in model.commands)}
    idle = [name for name in log.command_names if name not in used]
    if idle and (log.wrench is not None or len(idle) < len(log.command_names)):
        # A column is taken for a misspelt reserved name only where it is very much alike.
        alike = [(name, get_close_matches(name, RESERVED, n=1, cutoff=0.8)) for name in idle]
        near = "".join(did_you_mean(name, reserved) for name, reserved in alike)
        yield (
            f"nothing uses {_quoted(idle)}: no actuator of '{vehicle.name}' and no term of the "
            f"models has such a command.{near}"
        )


def log_requirements(vehicle: Vehicle, log: Log) -> Requirements:
    """Return what a vehicle needs of a log; models may yet have terms for its commands."""
    from hydrodamp.ingest.inspection.quality_report import Requirements

    told = missing_actuation(vehicle, log)
    reserved = told if log.command_names and not vehicle.commands else ""
    return Requirements(
        velocities=tuple(VELOCITY_OF[axis] for axis in vehicle.axes),
        missing=tuple(lack for lack in missing_data(vehicle, log, ()) if lack != reserved),
        reservations=(*unused_commands(vehicle, log, ()), *filter(None, [reserved])),
        length=estimate_length(vehicle),
    )


def estimate_length(vehicle: Vehicle) -> float | None:
    """Return about how long a vehicle is [m]: four radii of gyration about the axis it turns on."""
    inertia = vehicle.mass_matrix.diagonal()
    for turns, shifts in (("N", "Y"), ("M", "Z")):
        if {turns, shifts} <= set(vehicle.axes):
            moment, mass = inertia[AXES.index(turns)], inertia[AXES.index(shifts)]
            return _RADII * float(np.sqrt(moment / mass))
    return None


def missing_actuation(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] = ()) -> str:
    """Return why a log does not say what drove a vehicle."""
    of_terms = {name for model in models for name in model.commands}
    recorded = log.command_names
    if log.wrench is not None or not (of_terms | set(vehicle.commands)).isdisjoint(recorded):
        return ""
    acting = f"vehicle '{vehicle.name}' has no actuators"
    way = "give it `actuators` in its file (`hydrodamp vehicle new` writes examples)"
    if vehicle.commands:
        acting = f"the actuators of '{vehicle.name}' take {' '.join(vehicle.commands)}"
        near = {one: get_close_matches(one, recorded, n=1, cutoff=0.7) for one in vehicle.commands}
        # A wrong guess is worse than none: what has no like is left to the reader.
        alike = ", ".join(f"{one}: {(*its, 'COLUMN')[0]}" for one, its in near.items())
        way = f"call them alike, by `commands: {{{alike}}}` in a mapping"
    if of_terms:
        acting += f", the terms of the models take {' '.join(sorted(of_terms))}"
    if not recorded:
        return (
            "nothing in this log says what drove the vehicle: it needs the wrench columns "
            f"X Y Z K M N or a command that an actuator or a term uses; {acting}. Record either."
        )
    gains = f"{{{' '.join(vehicle.axes)}: {' '.join(recorded)}}}"
    return (
        f"{acting}, and the log has only the commands {' '.join(recorded)} and no wrench: nothing "
        "says what force they make. Let their gains be coefficients too: take the model `sparse`, "
        "which selects them, or as model a YAML file with the line `{name: mine, extends: linear, "
        f"terms: {gains}}}`, less what cannot act; or {way}; or record the wrench X Y Z K M N."
    )


def _quoted(names: Iterable[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def _velocities(vehicle: Vehicle, log: Log) -> Iterator[str]:
    needed = [VELOCITY_OF[axis] for axis in vehicle.axes]
    missing = [name for name in needed if name not in log.velocity_names]
    if missing:
        yield (
            f"vehicle '{vehicle.name}' moves on the axes {' '.join(vehicle.axes)} and needs the "
            f"columns {' '.join(needed)}; {' '.join(missing)} not found. Record them, or name "
            "fewer `axes` in the vehicle file."
        )


def _commands(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[str]:
    recorded = set(log.command_names)
    of_terms = {name for model in models for name in model.commands}
    of_actuators = set(vehicle.commands)
    if log.wrench is not None and recorded & of_actuators:
        yield (
            "both the wrench columns X Y Z K M N and commands of the vehicle's actuators "
            f"({' '.join(sorted(recorded & of_actuators))}) are there, which would count the "
            "actuators twice: drop the wrench columns to use the vehicle's actuators, or drop "
            "those commands to use the recorded wrench."
        )
    if told := missing_actuation(vehicle, log, models):
        yield told
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
        alike = ((name, get_close_matches(name, recorded, n=1, cutoff=0.7)) for name in names)
        near = "".join(did_you_mean(name, its) for name, its in alike)
        yield (
            f"there is no command {', nor '.join(lacking)}.{near} The log has "
            f"{_quoted(log.command_names) or 'no command'}. What a mapping leaves out of a "
            "recording is none: name its column under `commands`."
        )


def _attitude(vehicle: Vehicle, log: Log, models: Sequence[DampingModel]) -> Iterator[str]:
    if log.attitude is not None or set(vehicle.axes) <= {"X", "Y", "N"}:
        return
    tilts = np.any(vehicle.restoring_matrix[vehicle.free])
    terms = sorted({str(t) for model in models for t in model.basis if t.needs_attitude})
    if tilts or terms:
        why = f"terms {' '.join(terms)}" if terms else "weight, buoyancy and their centres"
        yield (
            f"the attitude is missing, and {why} act along it: record roll pitch yaw [rad] or "
            "qw qx qy qz."
        )

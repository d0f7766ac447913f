"""Whether a log holds what a vehicle and its models need."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.atoms import RESERVED, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, ProblemError, did_you_mean, list_faults
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

if TYPE_CHECKING:
    from hydrodamp.ingest.probing.verdict import Needs

_AHEAD = ("forward", "ahead", "surge", "throttle", "thrust", "rpm", "prop")
"""What names of commands that drive forward hold."""

_MISSPELT = 0.8
"""How alike a column and a reserved name must be for the one to be taken for the other."""


def check_log(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> None:
    """Refuse a log that lacks what the vehicle or a term needs."""
    asked = tuple(models)
    faults = [*_velocities(vehicle, log), *_commands(vehicle, log, asked)]
    faults += _attitude(vehicle, log, asked)
    if faults:
        raise ProblemError(list_faults(log.source or "log", faults))


def check_columns_used(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> None:
    """Refuse a column that no actuator and no term uses."""
    used = set(vehicle.commands) | {name for model in models for name in model.commands}
    unused = [name for name in log.command_names if name not in used]
    if unused and (log.wrench is not None or len(unused) < len(log.command_names)):
        raise LogError(_unused(vehicle, unused, used), source=log.source)


def needs_of(vehicle: Vehicle, log: Log) -> Needs:
    """Return what a vehicle needs of a log, with a term for every command no actuator takes."""
    from hydrodamp.ingest.probing.verdict import Needs
    from hydrodamp.vehicle.fleet import without_righting

    strange = [name for name in log.command_names if name not in vehicle.commands]
    undriven = nothing_drives(vehicle, log)
    models = () if vehicle.commands and undriven else (_model_of(vehicle, strange),)
    asked = (*_velocities(vehicle, log), *_commands(vehicle, log, models))
    minded = [told for told in (without_righting(vehicle),) if told]
    if undriven and strange and not vehicle.commands:
        minded.insert(0, undriven)
    elif strange and not undriven:
        minded.insert(
            0,
            f"commands that no actuator of '{vehicle.name}' takes: {' '.join(strange)}; use models "
            f"with terms for them, such as `terms: {{X: {strange[0]}}}` in a model file, or leave "
            "them out.",
        )
    return Needs(
        velocities=tuple(VELOCITY_OF[axis] for axis in vehicle.axes),
        missing=(*asked, *_attitude(vehicle, log, models)),
        reservations=tuple(minded),
    )


def _model_of(vehicle: Vehicle, commands: Sequence[str]) -> DampingModel:
    return DampingModel.from_table({vehicle.axes[0]: " ".join(commands)}, key="probe")


def nothing_drives(vehicle: Vehicle, log: Log, models: Iterable[DampingModel] = ()) -> str:
    """Return why a log does not say what drove a vehicle."""
    of_terms = {name for model in models for name in model.commands}
    recorded = log.command_names
    if log.wrench is not None or not (of_terms | set(vehicle.commands)).isdisjoint(recorded):
        return ""
    acting = f"the actuators of '{vehicle.name}' take {' '.join(vehicle.commands)}"
    if not vehicle.commands:
        acting = f"vehicle '{vehicle.name}' has no actuators"
    if of_terms:
        acting += f", the terms of the models take {' '.join(sorted(of_terms))}"
    if not recorded:
        return (
            "nothing in this log says what drove the vehicle: it needs the wrench columns "
            f"X Y Z K M N or a command that an actuator or a term uses; {acting}. Record either."
        )
    return (
        f"{acting}, and the log has only the commands {' '.join(recorded)} and no wrench: nothing "
        "says what force they make. Let their gains be coefficients too, with terms such as "
        f"`terms: {{X: {_ahead(recorded)}}}` in a model file; or "
        f"{_way_out(vehicle, recorded[0])}; or record the wrench X Y Z K M N."
    )


def _ahead(recorded: Sequence[str]) -> str:
    """Return the command that most likely drives a vehicle forward, for an example."""
    likely = (name for word in _AHEAD for name in recorded if word in name.lower())
    return next(likely, recorded[0])


def _way_out(vehicle: Vehicle, recorded: str) -> str:
    """Return how actuators and recorded commands may meet."""
    from hydrodamp.vehicle.fleet import fleet

    if vehicle.commands:
        alike = f"`commands: {{{vehicle.commands[0]}: {recorded}}}` in a mapping"
        return f"call them alike, such as {alike}"
    if vehicle.name in fleet:
        copy = f"hydrodamp vehicle new mine.yaml --like {vehicle.name}"
        return f"give it `actuators` in a copy (`{copy}` writes one)"
    return "give it `actuators` in its file (`hydrodamp vehicle new` writes examples)"


def _unused(vehicle: Vehicle, names: Sequence[str], used: Iterable[str]) -> str:
    taken = sorted(used)
    known = {
        name: [*taken, *get_close_matches(name, RESERVED, n=1, cutoff=_MISSPELT)] for name in names
    }
    hints = [(name, did_you_mean(name, known[name])) for name in names]
    near = "".join(
        hint if len(names) == 1 else f"{hint.removesuffix('?')} for '{name}'?"
        for name, hint in hints
        if hint
    )
    what, which, them = "columns", "are used by nothing: none is a reserved name", "them"
    if len(names) == 1:
        what, which, them = "column", "is used by nothing: it is no reserved name", "it"
    return (
        f"{what} {_quoted(names)} {which}, no actuator of '{vehicle.name}' takes {them} and no "
        f"term of the models has {them}.{near} Drop or rename {them}, or add terms with {them} to "
        "a model of yours."
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


def _commands(vehicle: Vehicle, log: Log, models: tuple[DampingModel, ...]) -> Iterator[str]:
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
    if told := nothing_drives(vehicle, log, models):
        yield told
        return
    needed = of_terms | (of_actuators if log.wrench is None else set())
    for user, names in (("a term", of_terms), (f"an actuator of '{vehicle.name}'", of_actuators)):
        absent = sorted(needed & names - recorded)
        needed -= names
        if absent:
            yield _absent(absent, user, sorted(recorded))


def _absent(names: Sequence[str], user: str, recorded: Sequence[str]) -> str:
    if len(names) == 1:
        near = did_you_mean(names[0], recorded)
        return f"command column '{names[0]}' is missing: {user} uses it.{near}"
    return (
        f"command columns {_quoted(names)} are missing: {user} uses each. The log has "
        f"{_quoted(recorded) or 'no command'}."
    )


def _attitude(vehicle: Vehicle, log: Log, models: tuple[DampingModel, ...]) -> Iterator[str]:
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

"""Whether a log holds what a vehicle and its models need."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from hydrodamp.basis.axes import VELOCITY_OF
from hydrodamp.basis.command_names import RESERVED
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, ProblemError, did_you_mean, list_faults
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle


def check_log(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> None:
    """Refuse a log that lacks what the vehicle or a term needs.

    Parameters
    ----------
    vehicle : Vehicle
        Its free axes say which velocities, its actuators which commands.
    log : Log
        What was recorded.
    models : iterable of DampingModel
        Their terms may need commands and attitude.

    Raises
    ------
    ProblemError
        One sentence for every lack.
    """
    asked = tuple(models)
    faults = [*_velocities(vehicle, log), *_commands(vehicle, log, asked)]
    faults += _attitude(vehicle, log, asked)
    if faults:
        raise ProblemError(list_faults(log.source or "log", faults))


def check_columns_used(vehicle: Vehicle, log: Log, models: Iterable[DampingModel]) -> None:
    """Refuse a column that no actuator and no term uses.

    Such a column is a misspelt one, or one the user believes to count.

    Parameters
    ----------
    vehicle : Vehicle
        Whose actuators use commands.
    log : Log
        Whose command columns are asked about.
    models : iterable of DampingModel
        Whose terms use commands.

    Raises
    ------
    LogError
        Names every such column once, with the nearest reserved name.
    """
    used = set(vehicle.commands) | {name for model in models for name in model.commands}
    unused = [name for name in log.command_names if name not in used]
    if unused:
        raise LogError(
            [
                f"column '{name}' is used by nothing: it is no reserved name, no actuator of "
                f"'{vehicle.name}' takes it and no term of the models has it."
                f"{did_you_mean(name, (*RESERVED, *sorted(used)))} Drop or rename it, or add a "
                "term with it to a model of yours."
                for name in unused
            ],
            source=log.source,
        )


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
    if log.wrench is None and not of_actuators & recorded and not of_terms & recorded:
        yield _nothing_acts(vehicle, of_actuators | of_terms, recorded)
        return
    needed = of_terms | (of_actuators if log.wrench is None else set())
    for name in sorted(needed - recorded):
        user = "a term" if name in of_terms else f"an actuator of '{vehicle.name}'"
        yield (
            f"command column '{name}' is missing: {user} uses it."
            f"{did_you_mean(name, sorted(recorded))}"
        )


def _nothing_acts(vehicle: Vehicle, wanted: set[str], recorded: set[str]) -> str:
    has = f"it has the columns {' '.join(sorted(recorded))}" if recorded else "it has no other"
    takes = f"the commands {' '.join(sorted(wanted))}" if wanted else "no command at all"
    return (
        "nothing in this log says what drove the vehicle: it needs the wrench columns "
        f"X Y Z K M N or a command that an actuator or a term uses; {has}, while vehicle "
        f"'{vehicle.name}' and the models take {takes}. Record the wrench, give the vehicle "
        "actuators, or add terms for the commands to a model: a model file with "
        "`terms: {X: ch_forward}`."
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

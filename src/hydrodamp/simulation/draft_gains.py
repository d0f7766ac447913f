"""Draft of the gains of commands: by what a command is called, else by the motion it causes.

A rudder acts on Y and N and an elevator on Z and M by the dynamic pressure, ``u|u|*rudder``; a
propeller acts on X by ``n|n|``; two thrusters at the sides of a boat act on X and N. Wind is no
command. A command that others determine has no gain of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from hydrodamp.basis.term import AXES
from hydrodamp.data.log import Log
from hydrodamp.ingest.inspection.command_signs import signs_by_side
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.draft_files import axis_of, group_commands
from hydrodamp.ingest.inspection.names import WORDS, words
from hydrodamp.vehicle.actuators import Actuator
from hydrodamp.vehicle.vehicle import Vehicle

_SURFACE_AXES = {"rudder": "YN", "elevator": "ZM"}
_OPPOSITE_FINS = {"rudder": ("bottom", "top"), "elevator": ("port", "starboard")}
_PLANAR_VELOCITIES = {"u", "v", "r"}
_MAX_RESIDUAL_SHARE = 1e-3  # of the variance of a command that others determine


def is_wind(command: str) -> bool:
    """Return whether a command is the wind by its name."""
    return any(word.startswith("wind") for word in words(command))


def _kind_of(command: str) -> str:
    """Return the kind of an actuator by its name, empty for another."""
    named = {word.rstrip("0123456789") for word in words(command)}
    return next((kind for kind in (*_SURFACE_AXES, "propeller") if named & WORDS[kind]), "")


def gain_term(command: str) -> str:
    """Return the term of the gain of a command."""
    kind = _kind_of(command)
    if kind == "propeller":
        return f"{command}*|{command}|"
    return f"u|u|*{command}" if kind else command


def draft_gains(
    log: Log, delays: Iterable[Delay], axes: Sequence[str] = AXES
) -> dict[str, tuple[str, ...]]:
    """Return the commands with a gain on each axis."""
    varying = [
        name
        for name, size in zip(log.command_names, np.ptp(log.commands, axis=0), strict=True)
        if size > 0.0 and name not in AXES and not is_wind(name)
    ]
    is_planar = {*log.velocity_names} <= _PLANAR_VELOCITIES
    at_sides = {name for name, _ in signs_by_side(varying)} if is_planar else set[str]()
    by_name = {
        name: "XN" if name in at_sides else _SURFACE_AXES.get(kind, "X")
        for name in varying
        if name in at_sides or (kind := _kind_of(name))
    }
    moved = {
        axis: {each.command for each in group} for axis, group in group_commands(delays).items()
    }
    gains = {
        axis: [
            name
            for name in varying
            if (axis in by_name[name] if name in by_name else name in moved.get(axis, ()))
        ]
        for axis in AXES
        if axis in axes
    }
    return {
        axis: tuple(name for name in names if name not in dict(find_dependent(log, names)))
        for axis, names in gains.items()
        if names
    }


def find_dependent(log: Log | None, names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield each command of a log that earlier ones determine, with the reason."""
    if log is None:
        return
    base: list[str] = []
    columns = [np.ones(log.n)]
    for name in filter(log.command_names.__contains__, names):
        values = log.command(name)
        share, *_ = np.linalg.lstsq(np.column_stack(columns), values, rcond=None)
        residual = values - np.column_stack(columns) @ share
        if base and np.var(residual) < _MAX_RESIDUAL_SHARE * np.var(values):
            largest = np.abs(share[1:]) * [np.std(column) for column in columns[1:]]
            used = [
                each for each, size in zip(base, largest, strict=True) if size > 0.1 * max(largest)
            ]
            yield (
                name,
                f"{name} is determined by {' and '.join(used)}: their gains cannot be separated",
            )
        else:
            base.append(name)
            columns.append(values)


def propose_commands(
    vehicle: Vehicle | None, log: Log | None, delays: Iterable[Delay] = ()
) -> dict[str, tuple[str, str, int]]:
    """Return, of each command of a vehicle that a log lacks, what of the log may be it.

    That is a command with its name, or half the difference of two opposite fins, and a sign.
    """
    if vehicle is None or log is None or not log.command_names:
        return {}
    responses = {each.command: each for each in delays}
    return {
        name: _propose(name, actuator, log.command_names, responses)
        for actuator in vehicle.actuators
        for name in actuator.commands
        if name not in log.command_names
    }


def _propose(
    name: str, actuator: Actuator, names: Sequence[str], responses: Mapping[str, Delay]
) -> tuple[str, str, int]:
    pair = _OPPOSITE_FINS.get(name, ())
    if pair and {*pair} <= {*names}:
        return (*pair, -1)
    named = next((each for each in names if {*words(name)} <= {*words(each)}), "")
    if named not in responses:
        return named, "", 1
    response = responses[named]
    effect = dict(getattr(actuator, "force", {})).get(axis_of(response), 0.0)
    return named, "", -1 if effect * response.sign < 0.0 else 1

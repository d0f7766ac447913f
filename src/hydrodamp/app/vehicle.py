"""Screen 3: vehicle from the fleet, from sizes or as text, and the gains of commands."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.channels import displayed_content
from hydrodamp.app.gains import is_edited, update_models
from hydrodamp.app.project import MAPPING, MODEL, VEHICLE, Project
from hydrodamp.app.recordings import inspect_project, make_log, read_log, read_vehicle
from hydrodamp.app.web import (
    FieldError,
    Form,
    field_value,
    number_field,
    project_of,
    redirect,
    render_screen,
)
from hydrodamp.basis.term import AXES
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError, ProblemError, VehicleError
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.mapping_editor import (
    add_commands,
    assignments,
    format_content,
    mix_commands,
)
from hydrodamp.simulation.draft_gains import (
    draft_gains,
    find_dependent,
    gain_term,
    is_wind,
    propose_commands,
)
from hydrodamp.vehicle.file import fleet, format_vehicle, parse_vehicle
from hydrodamp.vehicle.hulls import PLANAR
from hydrodamp.vehicle.template import SIZES, vehicle_template
from hydrodamp.vehicle.vehicle import Vehicle, without_righting

#: Units of the sizes of an estimate, and what is assumed of those that are not entered.
UNITS = {
    "length": "m", "diameter": "m", "beam": "m", "draft": "m", "mass": "kg",
    "block_coefficient": "", "height": "mm",
}  # fmt: skip
DEFAULTS = {**dict.fromkeys(UNITS, ""), "name": "my-vehicle", "height": "10", "axes": ""}

#: Kinds that move in all axes: the height of the center of buoyancy is theirs.
SUBMERGED = ("auv", "rov")

#: Largest length [m], mass [kg] and height [mm] of an estimate.
MAX_SIZE = 1e9


def show_vehicle(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    vehicle, fault = read_vehicle(project)
    log, delays = _commands(project)
    names = () if log is None else log.command_names
    gains = project.arguments.gains or _drafted_gains(project, vehicle)
    planar = log is not None and {*log.velocity_names} <= {"u", "v", "r"}
    return render_screen(
        request,
        project,
        "vehicle",
        fleet=list(fleet),
        vehicle=vehicle,
        facts=_facts(vehicle),
        fault=fault,
        righting="" if vehicle is None else without_righting(vehicle),
        commands=[name for name in names if not is_wind(name)],
        term_of=gain_term,
        delays=delays,
        ticked={(name, axis) for axis, each in gains.items() for name in each.split()},
        unmatched=propose_commands(vehicle, log, delays.values()),
        kinds=SIZES,
        submerged=SUBMERGED,
        units=UNITS,
        sizes={**DEFAULTS, "kind": "boat" if planar else "auv", **project.arguments.sizes},
        axes=vehicle.axes if vehicle is not None else PLANAR if planar else AXES,
        is_edited=is_edited(project),
        actuated=() if vehicle is None else tuple(vehicle.commands),
    )


def _facts(vehicle: Vehicle | None) -> list[tuple[str, str]]:
    """Return names and values of a vehicle: mass matrix, weight, trim and righting moment."""
    if vehicle is None:
        return []
    net = vehicle.weight - vehicle.buoyancy
    arm = float(vehicle.center_of_gravity[2] - vehicle.center_of_buoyancy[2])
    moment = vehicle.weight * arm * np.radians(10.0)
    return [
        ("free axes", " ".join(vehicle.axes)),
        ("source", vehicle.source or "not stated"),
        ("mass [kg] and inertia [kg m²] with added mass", ", ".join(
            f"{axis} {each:.4g}" for axis, each in
            zip(AXES, vehicle.mass_matrix.diagonal().tolist(), strict=True) if axis in vehicle.axes
        )),
        ("weight and buoyancy", f"{vehicle.weight:.4g} N and {vehicle.buoyancy:.4g} N "
                                f"({net:+.3g} N net, positive sinks)"),
        ("center of gravity below center of buoyancy", f"{1000.0 * arm:.3g} mm"),
        ("righting moment at 10° of roll", f"{moment:.3g} N m"),
        ("actuators", ", ".join(vehicle.commands) or "none: gains of commands are estimated"),
    ]  # fmt: skip


def _commands(project: Project) -> tuple[Log | None, dict[str, Delay]]:
    """Return the log, and the delay of each command that moves the vehicle."""
    try:
        log, report = read_log(project), inspect_project(project).report
    except HydrodampError:
        return None, {}
    return log, {each.command: each for each in (() if report is None else report.delays)}


def _drafted_gains(project: Project, vehicle: Vehicle | None) -> dict[str, str]:
    """Return the commands of each axis that the draft of gains has."""
    log, delays = _commands(project)
    if log is None:
        return {}
    gains = draft_gains(log, delays.values(), AXES if vehicle is None else vehicle.axes)
    return {axis: " ".join(names) for axis, names in gains.items()}


def choose_vehicle(request: Request, form: Form) -> Response:
    """Take a vehicle of the fleet, sizes of a hull, or the text of a vehicle file."""
    project, source = project_of(request), field_value(form, "source")
    version = field_value(form, "version")
    if source == "fleet":
        name = field_value(form, "name")
        if name not in fleet:
            raise VehicleError("choose a vehicle of the fleet")
        project.update(version, vehicle=name)
    else:
        text = field_value(form, "text").replace("\r\n", "\n")
        sizes = project.arguments.sizes
        if source == "sizes":
            entered = {key: values[-1] for key, values in form.items() if key in (*UNITS, "name")}
            kind = field_value(form, "kind", "auv")
            sizes = {**sizes, **entered, "kind": kind, "axes": " ".join(form.get("axis", []))}
            text = format_vehicle(_estimate(form, kind))
        parse_vehicle(text, source=VEHICLE)
        project.update(version, {VEHICLE: text}, vehicle=VEHICLE, sizes=sizes)
    _draft_gains(project)
    return redirect(request, project, "vehicle")


def _draft_gains(project: Project) -> None:
    """Write the gains that the log shows where nothing else states what commands do."""
    version = project.version
    vehicle, _ = read_vehicle(project)
    if vehicle is None or vehicle.commands or project.arguments.gains:
        return
    if gains := _drafted_gains(project, vehicle):
        update_models(project, version, gains=gains)


def copy_fleet_vehicle(request: Request, form: Form) -> Response:
    """Copy the vehicle of the fleet into the file of the project, to edit it."""
    project = project_of(request)
    vehicle, fault = read_vehicle(project)
    if vehicle is None:
        raise VehicleError(fault or "choose a vehicle first")
    contents = {VEHICLE: format_vehicle(vehicle)}
    project.update(field_value(form, "version"), contents, vehicle=VEHICLE)
    return redirect(request, project, "vehicle")


def _estimate(form: Form, kind: str) -> Vehicle:
    """Return the estimate from the dimensions of a kind; optional ones may be empty."""
    if kind not in SIZES:
        raise FieldError("kind", f"must be one of {', '.join(SIZES)}")
    needed, optional = SIZES[kind]
    entered = [*needed, *(name for name in optional if field_value(form, name).strip())]
    sizes = {name: number_field(form, name, UNITS[name], 0.0, MAX_SIZE) for name in entered}
    height = number_field(form, "height", "mm", 0.0, MAX_SIZE) if kind in SUBMERGED else 0.0
    axes = tuple(axis for axis in AXES if axis in form.get("axis", [])) or None
    name = field_value(form, "name") or "my-vehicle"
    text = vehicle_template(name, axes if kind in SUBMERGED else None, cast(Any, kind), **sizes)
    vehicle = parse_vehicle(text, source=VEHICLE)
    return replace(vehicle, center_of_buoyancy=np.array([0.0, 0.0, -height / 1000.0]))


def choose_gains(request: Request, form: Form) -> Response:
    """Set the gains: a command for each ticked axis."""
    project = project_of(request)
    if is_edited(project):
        raise ProblemError(f"{MODEL} was edited by hand: remove it, then the page writes it")
    pairs = [each.rpartition("|")[::2] for each in form.get("gain", [])]
    gains = {axis: [name for name, moved in pairs if moved == axis] for axis in AXES}
    gains = {axis: names for axis, names in gains.items() if names}
    log, _ = _commands(project)
    for axis, names in gains.items():
        for name, reason in find_dependent(log, names):
            raise ProblemError(f"{axis}: {reason}; untick {name} or the others")
    texts = {axis: " ".join(names) for axis, names in gains.items()}
    update_models(project, field_value(form, "version"), gains=texts)
    return redirect(request, project, "vehicle")


def map_actuators(request: Request, form: Form) -> Response:
    """Make the commands of actuators of those of the log; leave out the actuators without any."""
    project, version = project_of(request), field_value(form, "version")
    vehicle, _ = read_vehicle(project)
    content, log = displayed_content(project), read_log(project)
    commands = {each.channel: each.column for each in assignments(content)}
    listed = {name: name for name in log.command_names if name not in commands}
    content = add_commands(content, listed)  # of a canonical log
    absent: set[str] = set()
    for name in propose_commands(vehicle, log):
        first, second = field_value(form, f"first-{name}"), field_value(form, f"second-{name}")
        if not first:
            absent.add(name)
            continue
        weight = -1 if field_value(form, f"sign-{name}") == "-1" else 1
        content = mix_commands(content, name, first, second, weight)
    contents, changes = {MAPPING: format_content(content)}, {}
    if vehicle is not None and absent:
        actuators = tuple(each for each in vehicle.actuators if absent.isdisjoint(each.commands))
        contents[VEHICLE] = format_vehicle(replace(vehicle, actuators=actuators))
        changes["vehicle"] = VEHICLE
    make_log(project, contents[MAPPING])  # raises its faults before anything is written
    project.update(version, contents, **changes)
    return redirect(request, project, "vehicle")

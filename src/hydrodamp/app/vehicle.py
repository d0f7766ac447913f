"""Screen 3: vehicle from the fleet, from sizes or as text, and the gains of commands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.gains import is_edited, update_models
from hydrodamp.app.project import MODEL, VEHICLE, Project
from hydrodamp.app.recordings import inspect_project, read_log, read_vehicle
from hydrodamp.app.web import Form, field_value, number_field, project_of, redirect, render_screen
from hydrodamp.basis.term import AXES
from hydrodamp.errors import HydrodampError, ProblemError, VehicleError
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.draft_files import group_commands
from hydrodamp.vehicle.file import fleet, format_vehicle, parse_vehicle
from hydrodamp.vehicle.template import vehicle_template
from hydrodamp.vehicle.vehicle import Vehicle, without_righting

#: Largest length [m], mass [kg] and height [mm] of an estimate.
MAX_SIZE = 1e9


def show_vehicle(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    vehicle, fault = read_vehicle(project)
    commands, delays = _commands(project)
    return render_screen(
        request,
        project,
        "vehicle",
        fleet=list(fleet),
        vehicle=vehicle,
        facts=_facts(vehicle),
        fault=fault,
        righting="" if vehicle is None else without_righting(vehicle),
        commands=commands,
        delays=delays,
        ticked=_ticked(project, delays),
        axes=AXES if vehicle is None else vehicle.axes,
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


def _commands(project: Project) -> tuple[list[str], dict[str, Delay]]:
    """Return the commands of the log, and the delay of each that moves the vehicle."""
    try:
        log, report = read_log(project), inspect_project(project).report
    except HydrodampError:
        return [], {}
    delays = () if report is None else report.delays
    return list(log.command_names), {each.command: each for each in delays}


def _ticked(project: Project, delays: dict[str, Delay]) -> set[tuple[str, str]]:
    """Return commands and axes with a gain: those of the project, else those of the log."""
    gains = project.arguments.gains or drafted_gains(delays)
    return {(name, axis) for axis, names in gains.items() for name in names.split()}


def drafted_gains(delays: dict[str, Delay]) -> dict[str, str]:
    """Return the commands that move each axis."""
    groups = group_commands(delays.values())
    return {axis: " ".join(each.command for each in group) for axis, group in groups.items()}


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
        if source == "sizes":
            text = format_vehicle(_estimate(form))
        parse_vehicle(text, source=VEHICLE)
        project.update(version, {VEHICLE: text}, vehicle=VEHICLE)
    _draft_gains(project)
    return redirect(request, project, "vehicle")


def _draft_gains(project: Project) -> None:
    """Write the gains that the log shows where nothing else states what commands do."""
    version = project.version
    vehicle, _ = read_vehicle(project)
    if vehicle is None or vehicle.commands or project.arguments.gains:
        return
    if gains := drafted_gains(_commands(project)[1]):
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


def _estimate(form: Form) -> Vehicle:
    units = {"length": "m", "diameter": "m", "mass": "kg", "height": "mm"}
    sizes = {name: number_field(form, name, unit, 0.0, MAX_SIZE) for name, unit in units.items()}
    name = field_value(form, "name") or "my-vehicle"
    height = sizes.pop("height") / 1000.0
    axes = tuple(axis for axis in AXES if axis in form.get("axis", [])) or AXES
    vehicle = parse_vehicle(vehicle_template(name, axes, **sizes), source=VEHICLE)
    return replace(vehicle, center_of_buoyancy=np.array([0.0, 0.0, -height]))


def choose_gains(request: Request, form: Form) -> Response:
    """Set the gains: a command for each ticked axis."""
    project = project_of(request)
    if is_edited(project):
        raise ProblemError(f"{MODEL} was edited by hand: remove it, then the page writes it")
    pairs = [each.rpartition("|")[::2] for each in form.get("gain", [])]
    gains = {axis: " ".join(name for name, moved in pairs if moved == axis) for axis in AXES}
    gains = {axis: names for axis, names in gains.items() if names}
    update_models(project, field_value(form, "version"), gains=gains)
    return redirect(request, project, "vehicle")

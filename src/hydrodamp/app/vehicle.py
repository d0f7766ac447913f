"""Screen 3: vehicle from the fleet, from sizes or as text, and the gains of commands."""

from __future__ import annotations

import numpy as np
import yaml
from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.project import (
    DEFAULT_MODELS,
    MODEL,
    PROJECT,
    VEHICLE,
    Project,
    format_arguments,
)
from hydrodamp.app.recordings import inspect_project, read_log, read_vehicle
from hydrodamp.app.web import Form, field_value, project_of, render_screen
from hydrodamp.basis.term import AXES
from hydrodamp.errors import HydrodampError, VehicleError
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.draft_files import axis_of, group_commands
from hydrodamp.models.catalog import catalog
from hydrodamp.vehicle.file import (
    fleet,
    format_vehicle,
    parse_vehicle,
    vehicle_template,
)
from hydrodamp.vehicle.vehicle import Vehicle, without_righting

#: Suffix of models with gains of commands.
GAINS = "gains"


def show_vehicle(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    vehicle, fault = read_vehicle(project)
    commands, delays, moved = _commands(project)
    return render_screen(
        project,
        "vehicle",
        None,
        fleet=list(fleet),
        chosen=project.arguments.vehicle,
        vehicle=vehicle,
        facts=_facts(vehicle),
        fault=fault,
        righting="" if vehicle is None else without_righting(vehicle),
        text=project.text(VEHICLE),
        commands=commands,
        delays=delays,
        ticked=_ticked(project, moved),
        axes=AXES if vehicle is None else vehicle.axes,
        model_text=project.text(MODEL),
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
        ("mass and inertia with added mass", ", ".join(
            f"{axis} {each:.4g}" for axis, each in
            zip(AXES, vehicle.mass_matrix.diagonal().tolist(), strict=True) if axis in vehicle.axes
        )),
        ("weight and buoyancy", f"{vehicle.weight:.4g} N and {vehicle.buoyancy:.4g} N "
                                f"({net:+.3g} N net, positive sinks)"),
        ("center of gravity below center of buoyancy", f"{1000.0 * arm:.3g} mm"),
        ("righting moment at 10° of roll", f"{moment:.3g} N m"),
        ("actuators", ", ".join(vehicle.commands) or "none: gains of commands are estimated"),
    ]  # fmt: skip


def _commands(project: Project) -> tuple[list[str], dict[str, Delay], dict[str, str]]:
    """Return commands, the delay of each, and the axis that each moves."""
    try:
        log, report = read_log(project), inspect_project(project).report
    except HydrodampError:
        return [], {}, {}
    delays = () if report is None else report.delays
    by_command = {each.command: each for each in delays if each.command not in AXES}
    return list(log.command_names), by_command, {k: axis_of(d) for k, d in by_command.items()}


def _ticked(project: Project, moved: dict[str, str]) -> set[tuple[str, str]]:
    """Return commands and axes with a gain: of the model file, else those that the log shows."""
    content = parse_yaml(project.text(MODEL), MODEL) if project.text(MODEL) else None
    models = content.get("models") if isinstance(content, dict) else None
    if not isinstance(models, list) or not models or not isinstance(models[0], dict):
        return set(moved.items())
    terms = models[0].get("terms") or {}
    return {(name, axis) for axis, text in terms.items() for name in str(text).split()}


def choose_vehicle(request: Request, form: Form) -> Response:
    """Take a vehicle of the fleet, sizes of a hull, or the text of a vehicle file."""
    project, source = project_of(request), field_value(form, "source")
    version = field_value(form, "version")
    if source == "fleet":
        name = field_value(form, "name")
        if name not in fleet:
            raise VehicleError("choose a vehicle of the fleet")
        write_arguments(project, version, {}, vehicle=name)
    else:
        text = field_value(form, "text").replace("\r\n", "\n")
        if source == "sizes":
            text = format_vehicle(_estimate(form))
        parse_vehicle(text, source=VEHICLE)
        write_arguments(project, version, {VEHICLE: text}, vehicle=project.argument(VEHICLE))
    _draft_gains(project)
    return _go(project, "vehicle")


def _draft_gains(project: Project) -> None:
    """Write the gains that the log shows where nothing else states what commands do."""
    vehicle, _ = read_vehicle(project)
    if vehicle is None or vehicle.commands or project.path(MODEL).is_file():
        return
    text = format_models(project.arguments.models, drafted_pairs(project))
    if text:
        project.write(project.version, {MODEL: text})


def copy_fleet_vehicle(request: Request, form: Form) -> Response:
    """Copy the vehicle of the fleet into the file of the project, to edit it."""
    project = project_of(request)
    vehicle, fault = read_vehicle(project)
    if vehicle is None:
        raise VehicleError(fault or "choose a vehicle first")
    changes = {VEHICLE: format_vehicle(vehicle)}
    write_arguments(
        project, field_value(form, "version"), changes, vehicle=project.argument(VEHICLE)
    )
    return _go(project, "vehicle")


def _estimate(form: Form) -> Vehicle:
    sizes = {}
    for name, unit in (("length", "m"), ("diameter", "m"), ("mass", "kg"), ("height", "mm")):
        text = field_value(form, name)
        try:
            sizes[name] = float(text)
        except ValueError as error:
            raise VehicleError(f"`{name}` must be a number [{unit}]; got '{text}'") from error
    name = field_value(form, "name") or "my-vehicle"
    height = sizes.pop("height") / 1000.0
    template = vehicle_template(name, **sizes)
    vehicle = parse_vehicle(template, source=VEHICLE)
    changed = parse_yaml(format_vehicle(vehicle), VEHICLE)
    if not isinstance(changed, dict):
        raise VehicleError("the sizes give no vehicle")
    changed["center_of_buoyancy"] = [0.0, 0.0, -height]
    axes = form.get("axis", [])
    if axes:
        changed["axes"] = [axis for axis in AXES if axis in axes]
    return parse_vehicle(str(yaml.safe_dump(changed)), source=VEHICLE)


def write_arguments(
    project: Project, version: str, contents: dict[str, str], **changes: object
) -> None:
    """Write files and arguments together."""
    arguments = project.arguments.model_copy(update=changes)
    project.write(version, {**contents, PROJECT: format_arguments(arguments)})


def choose_gains(request: Request, form: Form) -> Response:
    """Write the model file with a gain of each ticked command and axis."""
    project = project_of(request)
    pairs = [tuple(each.split("|", 1)) for each in form.get("gain", []) if "|" in each]
    text = format_models(project.arguments.models or DEFAULT_MODELS, pairs)
    write_arguments(project, field_value(form, "version"), {MODEL: text})
    return _go(project, "vehicle")


def format_models(bases: tuple[str, ...], pairs: list[tuple[str, ...]]) -> str:
    """Return a file of models that extend others by gains of commands."""
    terms = {axis: " ".join(name for name, on in pairs if on == axis) for axis in AXES}
    terms = {axis: names for axis, names in terms.items() if names}
    models = [
        {"name": f"{base}-{GAINS}", "extends": base, "terms": dict(terms)}
        for base in bases
        if base in catalog
    ]
    return str(yaml.safe_dump({"models": models}, sort_keys=False)) if terms else ""


def drafted_pairs(project: Project) -> list[tuple[str, ...]]:
    """Return command and axis of each gain that the log shows."""
    _, delays, _ = _commands(project)
    groups = group_commands(delays.values())
    return [(delay.command, axis) for axis, group in groups.items() for delay in group]


def _go(project: Project, screen: str) -> Response:
    return Response(headers={"HX-Redirect": f"/p/{project.name}/{screen}"})

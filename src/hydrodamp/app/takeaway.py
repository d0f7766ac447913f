"""Screens 6 and 7: the verdict, and the files, exports, next dive and commands to take away."""

from __future__ import annotations

import io
import os
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

import yaml
from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse

from hydrodamp.app.commands import export_command, plan_command, script
from hydrodamp.app.jobs import Job
from hydrodamp.app.project import ENVELOPE, EXPORTS, PLAN, RESULTS, Project
from hydrodamp.app.recordings import read_log, read_vehicle
from hydrodamp.app.steps import exported_targets, outdated_exports
from hydrodamp.app.web import (
    FieldError,
    Form,
    field_value,
    jobs_of,
    number_field,
    project_address,
    project_of,
    render_screen,
)
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.experiment_design.envelope import read_envelope
from hydrodamp.export.export import TARGETS
from hydrodamp.files import load_json, save_text
from hydrodamp.report.fidelity_report import read_card
from hydrodamp.report.files import COMPARISON, DAMPING, REPORT
from hydrodamp.report.page import content_policy, read_sections

#: Smallest limit that is not zero.
SMALLEST = 1e-3

#: Limits of the next dive: label, unit, smallest value and default.
LIMITS = {
    "duration": ("Duration", "s", 1.0, 600.0),
    "slowest": ("Speed from", "m/s", 0.0, 1.0),
    "fastest": ("Speed to", "m/s", 0.0, 2.5),
    "shallowest": ("Depth from", "m", 0.0, 2.0),
    "deepest": ("Depth to", "m", 0.0, 30.0),
    "side": ("Side of the area, start in the middle", "m", SMALLEST, 1000.0),
}


def show_verdict(request: Request, form: Form) -> Response:
    """Return the screen with the sections of the report."""
    project = project_of(request)
    has_report = project.path(f"{RESULTS}/{REPORT}").is_file()
    page = read_sections(project.path(RESULTS)) if has_report else None
    address = f"{project_address(request, project.name)}/file/{RESULTS}/{REPORT}"
    return render_screen(request, project, "verdict", page=page, report=address)


def show_files(request: Request, form: Form) -> Response:
    """Return the screen with all files, exports and commands."""
    project = project_of(request)
    return render_screen(request, project, "files", **_files(request, project))


def _files(request: Request, project: Project) -> dict[str, Any]:
    jobs = jobs_of(request)
    exported, outdated = exported_targets(project), outdated_exports(project)
    exports = []
    for key in TARGETS:
        state = "outdated" if key in outdated else "exported" if key in exported else ""
        job = jobs.find(project, _export_name(key))
        exports.append(_describe_export(project, key, state, job))
    plan, damping = jobs.find(project, PLAN), project.path(f"{RESULTS}/{DAMPING}")
    jobs_of_page = [plan, *(each["job"] for each in exports)]
    return {
        "folder": project.argument(EXPORTS),
        "has_damping": damping.is_file(),
        "headline": _headline(project) if damping.is_file() else "",
        "listed": list(list_files(project).items()),
        "exports": exports,
        "is_busy": any(job.is_running for job in jobs_of_page if job is not None),
        "script": script(project, sorted(exported)),
        "plan": plan,
        "limits": [
            (key, *LIMITS[key][:2], f"{value:g}") for key, value in _limits(project).items()
        ],
    }


def _headline(project: Project) -> str:
    """Return what the results say on the use of the exported model."""
    with suppress(HydrodampError, KeyError, TypeError, IndexError):
        document: Any = load_json(project.path(f"{RESULTS}/{COMPARISON}"))
        return str(document["verdict"]["text"]).splitlines()[0]
    return ""


def _describe_export(project: Project, key: str, state: str, job: Job | None) -> dict[str, Any]:
    """Return the state of an export, and what its card says on its worth."""
    card: dict[str, Any] = {}
    if state:
        with suppress(HydrodampError):
            card = read_card(project.path(f"{EXPORTS}/{key}"))
    if state == "exported" and not card:
        state = ""
    if job is not None and (job.is_running or job.status != 0):
        state = "running" if job.is_running else "refused"
    errors = [each for each in card.get("wrench_error", {}).values() if each is not None]
    worth = f"Wrench error at most {max(errors):.2g} % of the damping." if errors else ""
    description = TARGETS[key].description
    return {"key": key, "description": description, "state": state, "worth": worth, "job": job}


def _limits(project: Project) -> dict[str, float]:
    """Return the limits of the next dive: those of the project, else the defaults."""
    values = {key: entry[-1] for key, entry in LIMITS.items()}
    with suppress(HydrodampError):
        envelope = read_envelope(project.path(ENVELOPE))
        values["slowest"], values["fastest"] = envelope.speed
        values["shallowest"], values["deepest"] = envelope.depth
        if envelope.area is not None:
            values["side"] = 2.0 * envelope.area.north[1]
    return values


def _export_name(target: str) -> str:
    return f"export-{target}"


def start_export(request: Request, form: Form) -> Response:
    """Export the selected model to a target."""
    project, target = project_of(request), field_value(form, "target")
    if target not in TARGETS:
        raise HydrodampError(f"there is no target `{target}`")
    if not project.path(f"{RESULTS}/{DAMPING}").is_file():
        raise ProblemError("there is no damping file yet: run the comparison first")
    command = export_command(project, target)
    try:
        project.path(EXPORTS).mkdir(exist_ok=True)
    except OSError as error:
        raise FileError(f"{project.path(EXPORTS)}: is no folder: {error}") from error
    jobs_of(request).start(project, _export_name(target), command)
    return show_exports(request, form)


def start_plan(request: Request, form: Form) -> Response:
    """Design the next dive by the selected model."""
    project = project_of(request)
    if not project.path(f"{RESULTS}/{DAMPING}").is_file():
        raise ProblemError("there is no damping file yet: run the comparison first")
    values = {key: number_field(form, key, unit, low) for key, (_, unit, low, _) in LIMITS.items()}
    for low, high in (("slowest", "fastest"), ("shallowest", "deepest")):
        if not values[low] < values[high]:
            raise FieldError(high, f"must be above {values[low]:g}; got {values[high]:g}")
    _write_envelope(project, values)
    jobs_of(request).start(project, PLAN, plan_command(project, values["duration"]))
    return show_exports(request, form)


def _write_envelope(project: Project, values: dict[str, float]) -> None:
    """Write the limits, and the ranges of commands in the log where the vehicle has none."""
    vehicle, _ = read_vehicle(project)
    log, half = read_log(project), 0.5 * values["side"]
    content: dict[str, Any] = {
        "speed": [values["slowest"], values["fastest"]],
        "depth": [values["shallowest"], values["deepest"]],
        "area": {"north": [-half, half], "east": [-half, half]},
    }
    if vehicle is not None and not vehicle.commands and log.command_names:
        low, high = log.commands.min(axis=0).tolist(), log.commands.max(axis=0).tolist()
        content["commands"] = {
            name: {"lowest": least, "highest": most}
            for name, least, most in zip(log.command_names, low, high, strict=True)
            if least < most
        }
    save_text(str(yaml.safe_dump(content)), project.path(ENVELOPE))


def show_exports(request: Request, form: Form) -> Response:
    """Return the files and the state of exports."""
    project = project_of(request)
    return render_screen(
        request, project, "files", "files_change.html.j2", **_files(request, project)
    )


def list_files(project: Project) -> dict[str, int]:
    """Return the sizes of the files of a project, by their paths in its folder."""
    sizes, folder = {}, project.folder.resolve()
    for home, folders, names in os.walk(folder):  # passes over what a job removes meanwhile
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for path in (Path(home, name) for name in sorted(names) if not name.startswith(".")):
            with suppress(OSError):
                if path.is_file() and path.resolve().is_relative_to(folder):
                    sizes[path.relative_to(folder).as_posix()] = path.stat().st_size
    return sizes


def send_file(request: Request, form: Form) -> Response:
    """Return a file of a project."""
    project, name = project_of(request), request.path_params["path"]
    if name not in list_files(project):
        raise FileError(f"there is no file `{name}` in the project")
    path: Path = project.path(name)
    if path.suffix == ".html":
        policy = f"{content_policy()}; frame-ancestors 'self'"  # a page of others runs no script
        headers = {"Content-Security-Policy": policy}
        return FileResponse(path, media_type="text/html", headers=headers)
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


def send_archive(request: Request, form: Form) -> Response:
    """Return all files of a project and the commands as a zip file."""
    project = project_of(request)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, strict_timestamps=False) as archive:
        for name in list_files(project):
            with suppress(FileNotFoundError):  # a job has removed it
                archive.write(project.path(name), project.argument(name))
        archive.writestr("commands.sh", script(project, sorted(exported_targets(project))))
    disposition = f"attachment; filename*=UTF-8''{quote(project.name)}.zip"
    headers = {"Content-Disposition": disposition}
    return StreamingResponse(
        iter([buffer.getvalue()]), media_type="application/zip", headers=headers
    )

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
from hydrodamp.app.project import ENVELOPE, EXPORTS, PLAN, RESULTS, Project
from hydrodamp.app.recordings import read_log, read_vehicle
from hydrodamp.app.results_state import is_outdated, outdated_exports
from hydrodamp.app.run import jobs_of
from hydrodamp.app.web import (
    Form,
    field_value,
    project_address,
    project_of,
    render,
    render_screen,
)
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.export.export import TARGETS
from hydrodamp.files import save_text
from hydrodamp.report.files import DAMPING, REPORT
from hydrodamp.report.page import content_policy


def show_verdict(request: Request, form: Form) -> Response:
    """Return the screen with the report of the comparison."""
    project = project_of(request)
    return render_screen(
        request,
        project,
        "verdict",
        project.version,
        ["report", project.argument(RESULTS)],
        is_outdated=is_outdated(project),
        has_report=project.path(f"{RESULTS}/{REPORT}").is_file(),
        report=f"{project_address(request, project.name)}/file/{RESULTS}/{REPORT}",
    )


def show_files(request: Request, form: Form) -> Response:
    """Return the screen with all files, exports and commands."""
    project = project_of(request)
    return render_screen(
        request, project, "files", project.version, None, **_files(request, project)
    )


def _files(request: Request, project: Project) -> dict[str, Any]:
    exported = [each for each in TARGETS if project.path(f"{EXPORTS}/{each}").is_dir()]
    pending = {
        name: job
        for name in TARGETS
        if (job := jobs_of(request).find(project, _export_name(name))) is not None
    }
    plan = jobs_of(request).find(project, PLAN)
    return {
        "is_outdated": is_outdated(project),
        "outdated": outdated_exports(project),
        "folder": project.argument(EXPORTS),
        "has_damping": project.path(f"{RESULTS}/{DAMPING}").is_file(),
        "listed": list(list_files(project).items()),
        "targets": [(key, TARGETS[key].description) for key in TARGETS],
        "exported": exported,
        "pending": pending,
        "is_busy": any(job.is_running for job in [*pending.values(), plan] if job is not None),
        "script": script(project, exported),
        "plan": plan,
    }


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
    path = project.path(f"{RESULTS}/{DAMPING}")
    if not path.is_file():
        raise ProblemError("there is no damping file yet: run the comparison first")
    try:
        duration = float(field_value(form, "duration"))
    except ValueError as error:
        raise ProblemError("the duration must be a number of seconds") from error
    has_envelope = _write_envelope(project)
    command = plan_command(project, duration, has_envelope)
    jobs_of(request).start(project, PLAN, command)
    return show_exports(request, form)


def _write_envelope(project: Project) -> bool:
    """Write the ranges of commands in the log as limits where the vehicle file has none."""
    vehicle, _ = read_vehicle(project)
    log = read_log(project)
    if vehicle is None or vehicle.commands or not log.command_names:
        return False
    low, high = log.commands.min(axis=0).tolist(), log.commands.max(axis=0).tolist()
    limits = {
        name: {"lowest": least, "highest": most}
        for name, least, most in zip(log.command_names, low, high, strict=True)
        if least < most
    }
    save_text(str(yaml.safe_dump({"commands": limits})), project.path(ENVELOPE))
    return True


def show_exports(request: Request, form: Form) -> Response:
    """Return the files and the state of exports."""
    project = project_of(request)
    return render(request, "files_change.html.j2", project=project, **_files(request, project))


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
        archive.writestr("commands.sh", script(project, _files(request, project)["exported"]))
    disposition = f"attachment; filename*=UTF-8''{quote(project.name)}.zip"
    headers = {"Content-Disposition": disposition}
    return StreamingResponse(
        iter([buffer.getvalue()]), media_type="application/zip", headers=headers
    )

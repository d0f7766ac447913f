"""Screens 5 to 7: run the comparison, read the verdict, take the files."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import FileResponse, Response, StreamingResponse

from hydrodamp.app.commands import compare_command, export_command, format_command, script
from hydrodamp.app.jobs import Job, Jobs
from hydrodamp.app.project import EXPORTS, MODEL, PROJECT, RESULTS, Project, format_arguments
from hydrodamp.app.vehicle import format_models
from hydrodamp.app.web import Form, field_value, project_of, render, render_screen
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.export.export import TARGETS
from hydrodamp.files import parse_yaml
from hydrodamp.identification.methods import METHODS
from hydrodamp.models.catalog import catalog
from hydrodamp.report.files import DAMPING, REPORT

#: Name of the comparison among the jobs of a project.
COMPARE = "compare"

#: Headers of a written page, which runs its own scripts without access to this server.
PAGE_HEADERS = {
    "Content-Security-Policy": "sandbox allow-scripts allow-downloads allow-popups; "
    "frame-ancestors 'self'"
}


def jobs_of(request: Request) -> Jobs:
    """Return the jobs of the server."""
    jobs: Jobs = request.app.state.jobs
    return jobs


def show_run(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    arguments = project.arguments
    command = compare_command(project) if not _lacking(project) else None
    return render_screen(
        project,
        "run",
        command,
        models=[(key, catalog[key].title, catalog[key].n_coefficients) for key in catalog],
        chosen_models=arguments.models,
        methods=[(key, METHODS[key]) for key in METHODS],
        chosen_methods=arguments.methods,
        lacking=_lacking(project),
        has_gains=bool(project.text(MODEL).strip()),
        **_status(request, project),
    )


def _lacking(project: Project) -> list[str]:
    """Return what the comparison lacks."""
    arguments = project.arguments
    needs = {
        "a vehicle (screen Vehicle)": arguments.vehicle,
        "training and test data (screen Split)": arguments.train and arguments.test,
        "at least one model": arguments.models,
        "at least one method": arguments.methods,
    }
    return [name for name, value in needs.items() if not value]


def _status(request: Request, project: Project) -> dict[str, Any]:
    """Return the state of the job and the finished fits."""
    job = jobs_of(request).find(project, COMPARE)
    arguments = project.arguments
    total = len(arguments.models) * len(arguments.methods)
    return {
        "job": job,
        "fits": list(_fits(project, job)),
        "total": total,
        "messages": "" if job is None else job.messages.strip(),
        "has_report": project.path(f"{RESULTS}/{REPORT}").is_file(),
    }


def _fits(project: Project, job: Job | None) -> Iterator[tuple[str, str, int, bool]]:
    """Yield model, method, number of coefficients, and whether a fit is of this run."""
    for path in sorted(project.path(f"{RESULTS}/fits").glob("*.json")):
        try:
            document = json.loads(path.read_text("utf-8"))
            model, method = document["model"]["key"], document["fit"]["method"]
            n = len(document["coefficients"])
        except (OSError, ValueError, KeyError, TypeError):
            continue
        yield str(model), str(method), n, job is None or path.stat().st_mtime >= job.started


def choose_models(request: Request, form: Form) -> Response:
    """Set models and methods; models with gains are written anew."""
    project = project_of(request)
    models, methods = (
        tuple(each for each in form.get(name, []) if each in known)
        for name, known in (("model", catalog), ("method", METHODS))
    )
    arguments = project.arguments.model_copy(update={"models": models, "methods": methods})
    contents = {PROJECT: format_arguments(arguments)}
    if project.text(MODEL).strip():
        contents[MODEL] = format_models(models, _gains(project))
    project.write(field_value(form, "version"), contents)
    lacking = _lacking(project)
    return render(
        "run_change.html.j2",
        project=project,
        version=project.version,
        lacking=lacking,
        command="" if lacking else format_command(compare_command(project)),
        **_status(request, project),
    )


def _gains(project: Project) -> list[tuple[str, ...]]:
    content = parse_yaml(project.text(MODEL), MODEL)
    models = content.get("models") if isinstance(content, dict) else None
    if not isinstance(models, list) or not models or not isinstance(models[0], dict):
        return []
    terms = models[0].get("terms") or {}
    return [(name, str(axis)) for axis, text in terms.items() for name in str(text).split()]


def start_run(request: Request, form: Form) -> Response:
    """Start the comparison; finished fits are reused."""
    project = project_of(request)
    if lacking := _lacking(project):
        raise ProblemError(f"the comparison needs {', '.join(lacking)}")
    jobs_of(request).start(project, COMPARE, compare_command(project))
    return _render_status(request, project)


def cancel_run(request: Request, form: Form) -> Response:
    """Interrupt the comparison; its finished fits stay."""
    project = project_of(request)
    job = jobs_of(request).find(project, COMPARE)
    if job is not None:
        job.interrupt()
    return _render_status(request, project)


def show_status(request: Request, form: Form) -> Response:
    """Return the state of the comparison."""
    return _render_status(request, project_of(request))


def _render_status(request: Request, project: Project) -> Response:
    return render("run_status.html.j2", project=project, lacking=[], **_status(request, project))


def show_verdict(request: Request, form: Form) -> Response:
    """Return the screen with the report of the comparison."""
    project = project_of(request)
    return render_screen(
        project,
        "verdict",
        ["report", project.argument(RESULTS)],
        has_report=project.path(f"{RESULTS}/{REPORT}").is_file(),
        report=f"/p/{project.name}/file/{RESULTS}/{REPORT}",
    )


def show_files(request: Request, form: Form) -> Response:
    """Return the screen with all files, exports and commands."""
    project = project_of(request)
    return render_screen(project, "files", None, **_files(request, project))


def _files(request: Request, project: Project) -> dict[str, Any]:
    exported = [each for each in TARGETS if project.path(f"{EXPORTS}/{each}").is_dir()]
    pending = {
        name: job
        for name in TARGETS
        if (job := jobs_of(request).find(project, _export_name(name))) is not None
    }
    return {
        "has_damping": project.path(f"{RESULTS}/{DAMPING}").is_file(),
        "listed": [(name, project.path(name).stat().st_size) for name in list_files(project)],
        "targets": [(key, TARGETS[key].description) for key in TARGETS],
        "exported": exported,
        "pending": pending,
        "is_exporting": any(job.is_running for job in pending.values()),
        "script": script(project, exported),
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
    project.path(EXPORTS).mkdir(exist_ok=True)
    jobs_of(request).start(project, _export_name(target), command)
    return show_exports(request, form)


def show_exports(request: Request, form: Form) -> Response:
    """Return the files and the state of exports."""
    project = project_of(request)
    return render("files_change.html.j2", project=project, **_files(request, project))


def list_files(project: Project) -> list[str]:
    """Return the files of a project, relative to its folder."""
    paths = (path for path in project.folder.rglob("*") if path.is_file())
    names = (path.relative_to(project.folder).as_posix() for path in paths)
    return sorted(name for name in names if not any(p.startswith(".") for p in name.split("/")))


def send_file(request: Request, form: Form) -> Response:
    """Return a file of a project."""
    project, name = project_of(request), request.path_params["path"]
    if name not in list_files(project):
        raise FileError(f"there is no file `{name}` in the project")
    path: Path = project.path(name)
    if path.suffix == ".html":
        return FileResponse(path, media_type="text/html", headers=dict(PAGE_HEADERS))
    return FileResponse(path, media_type="application/octet-stream", filename=path.name)


def send_archive(request: Request, form: Form) -> Response:
    """Return all files of a project and the commands as a zip file."""
    project = project_of(request)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in list_files(project):
            archive.write(project.path(name), name)
        archive.writestr("commands.sh", script(project, _files(request, project)["exported"]))
    headers = {"Content-Disposition": f'attachment; filename="{project.name}.zip"'}
    return StreamingResponse(
        iter([buffer.getvalue()]), media_type="application/zip", headers=headers
    )

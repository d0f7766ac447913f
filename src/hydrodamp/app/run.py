"""Screen 5: run the comparison, with its progress; cancel and resume it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.commands import compare_command, format_command
from hydrodamp.app.jobs import Job, Jobs
from hydrodamp.app.project import MODEL, PROJECT, RESULTS, Project, format_arguments
from hydrodamp.app.vehicle import format_models
from hydrodamp.app.web import Form, field_value, project_of, render, render_screen
from hydrodamp.errors import ProblemError
from hydrodamp.files import parse_yaml
from hydrodamp.identification.methods import METHODS
from hydrodamp.models.catalog import catalog
from hydrodamp.report.files import REPORT

#: Name of the comparison among the jobs of a project.
COMPARE = "compare"


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

"""Screen 5: run the comparison, with its progress; cancel and resume it."""

from __future__ import annotations

import inspect
import json
from collections.abc import Iterator
from contextlib import suppress
from itertools import product
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.commands import compare_command, format_command
from hydrodamp.app.gains import is_edited, update_models
from hydrodamp.app.jobs import Jobs
from hydrodamp.app.project import MODEL, RESULTS, Project
from hydrodamp.app.results_state import is_outdated
from hydrodamp.app.web import Form, field_value, project_of, render, render_screen
from hydrodamp.errors import HydrodampError, ProblemError
from hydrodamp.identification.fit import Method
from hydrodamp.identification.general_model import GENERAL_KEY, INPUTS
from hydrodamp.identification.methods import METHODS, find_method
from hydrodamp.models.catalog import catalog
from hydrodamp.models.files import read_models
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
    version, arguments, lacking = project.version, project.arguments, _lacking(project)
    return render_screen(
        request,
        project,
        "run",
        version,
        None if lacking else compare_command(project),
        general=GENERAL_KEY,
        models=[(key, catalog[key].n_coefficients, catalog[key].title) for key in catalog],
        chosen_models=arguments.models,
        methods=[(key, _first_line(find_method(key))) for key in METHODS],
        chosen_methods=arguments.methods,
        lacking=lacking,
        has_gains=bool(arguments.gains),
        is_edited=is_edited(project),
        **_status(request, project),
    )


def _first_line(method: Method) -> str:
    return (inspect.getdoc(type(method)) or "").splitlines()[0].replace("`", "")


def _lacking(project: Project) -> list[tuple[str, str]]:
    """Return what the comparison lacks, with the screen that has it."""
    arguments = project.arguments
    needs = {
        ("a vehicle", "vehicle"): arguments.vehicle,
        ("training and test data", "split"): arguments.train and arguments.test,
        ("at least one model", "run"): arguments.models,
        ("at least one method", "run"): arguments.methods,
    }
    return [need for need, value in needs.items() if not value]


def _status(request: Request, project: Project) -> dict[str, Any]:
    """Return the state of the job and the finished fits."""
    job = jobs_of(request).find(project, COMPARE)
    requested = _requested(project)
    fits = list(_fits(project, requested))
    return {
        "job": job,
        "fits": fits,
        "total": len(requested),
        "messages": "" if job is None else job.messages.strip(),
        "is_outdated": is_outdated(project),
        "has_report": project.path(f"{RESULTS}/{REPORT}").is_file(),
    }


def _requested(project: Project) -> set[tuple[str, str]]:
    """Return model and method of each requested fit."""
    arguments, models = project.arguments, project.arguments.models
    if project.text(MODEL).strip():
        with suppress(HydrodampError):  # the command says what is wrong with an edited file
            general = tuple(key for key in models if key == GENERAL_KEY)
            models = (*general, *(model.key for model in read_models(project.path(MODEL))))
    return set(product(models, arguments.methods))


def _fits(project: Project, requested: set[tuple[str, str]]) -> Iterator[tuple[str, str, int]]:
    """Yield model, method and number of coefficients of each requested fit that is on disk."""
    numbers: dict[tuple[str, str], int] = {}  # an earlier fit of other data has a file of its own
    for path in sorted(project.path(f"{RESULTS}/fits").glob("*.json")):
        try:
            document = json.loads(path.read_text("utf-8"))
            model = document["model"]["key"].removesuffix(INPUTS)
            key = model, document["fit"]["method"]
            n = len(document["coefficients"])
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if key in requested:
            numbers[key] = n
    for key, n in numbers.items():
        yield (*key, n)


def choose_models(request: Request, form: Form) -> Response:
    """Set models and methods; models with gains are written anew."""
    project = project_of(request)
    models, methods = (
        tuple(each for each in form.get(name, []) if each in known)
        for name, known in (("model", (GENERAL_KEY, *catalog)), ("method", METHODS))
    )
    update_models(project, field_value(form, "version"), models=models, methods=methods)
    lacking = _lacking(project)
    return render(
        request,
        "run_change.html.j2",
        project=project,
        version=project.version,
        lacking=lacking,
        command="" if lacking else format_command(compare_command(project)),
        **_status(request, project),
    )


def start_run(request: Request, form: Form) -> Response:
    """Start the comparison; finished fits are reused."""
    project = project_of(request)
    if lacking := _lacking(project):
        raise ProblemError(f"the comparison needs {', '.join(name for name, _ in lacking)}")
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
    return render(
        request, "run_status.html.j2", project=project, lacking=[], **_status(request, project)
    )

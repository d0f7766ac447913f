"""Screen 5: run the comparison, with its progress; cancel and resume it."""

from __future__ import annotations

import inspect
import json
import time
from collections.abc import Iterator
from contextlib import suppress
from itertools import product
from typing import Any

from starlette.requests import Request
from starlette.responses import Response

from hydrodamp.app.commands import compare_command
from hydrodamp.app.gains import SUFFIX, is_edited, update_models
from hydrodamp.app.jobs import Job
from hydrodamp.app.project import MODEL, RESULTS, Project
from hydrodamp.app.recordings import read_log
from hydrodamp.app.steps import Step, find_blocker, is_outdated, step_states
from hydrodamp.app.web import (
    COMPARE,
    Form,
    field_value,
    jobs_of,
    project_of,
    redirect,
    render_screen,
)
from hydrodamp.errors import HydrodampError, ProblemError
from hydrodamp.identification.fit import Method
from hydrodamp.identification.general_model import GENERAL_KEY, INPUTS
from hydrodamp.identification.methods import METHODS, find_method
from hydrodamp.identification.stepwise import SPARSE_KEY
from hydrodamp.models.catalog import catalog
from hydrodamp.models.files import read_models

#: Model, method, number of coefficients, and time of writing of a fit.
Finished = tuple[str, str, int, float]

#: Models that the comparison makes of the log: coefficients, title and source.
DERIVED = {
    GENERAL_KEY: ("by the log", "Terms of an expert", "all commands, or the wrench, have gains"),
    SPARSE_KEY: ("selected", "Sparse", "terms are added one by one while they predict better"),
}

#: Seconds per coefficient and sample on two cores, until a finished fit states them; of methods
#: that simulate, and of the others. Measured on 800 s of an AUV at 10 Hz.
SIMULATING, RATES = ("recommended", "oe"), (2e-5, 1e-6)

#: Coefficients that are assumed of a model that the comparison makes.
ASSUMED = 60


def show_run(request: Request, form: Form) -> Response:
    """Return the screen."""
    project = project_of(request)
    models = {key: (each.n_coefficients, each.title, each.source) for key, each in catalog.items()}
    return render_screen(
        request,
        project,
        "run",
        models=(DERIVED | models).items(),
        derived=DERIVED,
        methods=[(key, _first_line(find_method(key))) for key in METHODS],
        is_edited=is_edited(project),
        **_status(request, project),
    )


def _first_line(method: Method) -> str:
    return (inspect.getdoc(type(method)) or "").splitlines()[0].replace("`", "")


def _status(request: Request, project: Project) -> dict[str, Any]:
    """Return the state of the job, the finished fits and the time that the others take."""
    job = jobs_of(request).find(project, COMPARE)
    requested = _requested(project)
    fits = [] if job is None and is_outdated(project) else list(_fits(project, requested))
    return {
        "job": job,
        "fits": fits,
        "total": len(requested),
        "seconds": _estimate(project, requested, fits, job),
        "messages": "" if job is None else job.messages.strip(),
    }


def _estimate(
    project: Project, requested: set[tuple[str, str]], fits: list[Finished], job: Job | None
) -> float | None:
    """Return the seconds of the missing fits [s], by the finished ones where there are any."""
    missing = requested - {fit[:2] for fit in fits}
    sizes = {key: _size(key[0]) for key in requested}
    moment = job.started if job is not None and job.is_running else time.time()
    if finished := [fit for fit in fits if fit[3] > moment]:
        rate = (finished[-1][3] - moment) / sum(sizes[fit[:2]] for fit in finished)
        return rate * sum(sizes[key] for key in missing)
    try:
        n_samples = len(read_log(project).time)
    except HydrodampError:
        return None
    return n_samples * sum(sizes[key] * RATES[key[1] not in SIMULATING] for key in missing)


def _size(model: str) -> int:
    """Return the number of coefficients of a model, an assumed one where the log decides it."""
    key = model.removesuffix(f"-{SUFFIX}")
    return catalog[key].n_coefficients if key in catalog else ASSUMED


def _requested(project: Project) -> set[tuple[str, str]]:
    """Return model and method of each requested fit."""
    arguments, models = project.arguments, project.arguments.models
    if project.text(MODEL).strip():
        with suppress(HydrodampError):  # the command says what is wrong with an edited file
            derived = tuple(key for key in models if key in DERIVED)
            models = (*derived, *(model.key for model in read_models(project.path(MODEL))))
    return set(product(models, arguments.methods))


def _fits(project: Project, requested: set[tuple[str, str]]) -> Iterator[Finished]:
    """Yield model, method, number of coefficients and time of each requested fit on disk."""
    numbers: dict[
        tuple[str, str], tuple[int, float]
    ] = {}  # an earlier fit of other data has a file of its own
    for path in sorted(project.path(f"{RESULTS}/fits").glob("*.json")):
        try:
            document = json.loads(path.read_text("utf-8"))
            model = document["model"]["key"].removesuffix(INPUTS)
            key = model, document["fit"]["method"]
            n, modified = len(document["coefficients"]), path.stat().st_mtime
        except (OSError, ValueError, KeyError, TypeError):
            continue
        if key in requested:
            numbers[key] = n, modified
    for key, (n, modified) in sorted(numbers.items(), key=lambda each: each[1][1]):
        yield (*key, n, modified)


def choose_models(request: Request, form: Form) -> Response:
    """Set models and methods; models with gains are written anew."""
    project = project_of(request)
    models, methods = (
        tuple(each for each in form.get(name, []) if each in known)
        for name, known in (("model", (*DERIVED, *catalog)), ("method", METHODS))
    )
    update_models(project, field_value(form, "version"), models=models, methods=methods)
    return _render_status(request, project)


def start_run(request: Request, form: Form) -> Response:
    """Start the comparison; finished fits are reused."""
    project = project_of(request)
    if blocker := find_blocker(step_states(project), "run"):
        raise ProblemError(f"{blocker.title}: {blocker.note}")
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
    """Return the state of the comparison, or go to the verdict of a finished one.

    A comparison whose replays all diverge fails with a verdict.
    """
    project = project_of(request)
    job = jobs_of(request).find(project, COMPARE)
    is_finished = job is not None and job.status in (0, 1) and "wait" in request.query_params
    if is_finished and step_states(project)[-2] == Step("verdict", "done"):
        return redirect(request, project, "verdict")
    return _render_status(request, project)


def _render_status(request: Request, project: Project) -> Response:
    return render_screen(request, project, "run", "run_change.html.j2", **_status(request, project))

"""Pages, fragments and errors of the local server.

A page shows a project. A fragment answers a change: the part of the page that depends on it, with
the version of the files. Handlers run in threads; they raise errors that become messages.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Awaitable, Callable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, quote

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from hydrodamp.app.commands import compare_command, format_command, probe_command
from hydrodamp.app.jobs import Jobs
from hydrodamp.app.project import RESULTS, OutdatedEditError, Project, find_project, list_projects
from hydrodamp.app.steps import STEPS, find_blocker, step_states
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.report.page import page_environment

#: Name of the comparison among the jobs of a project.
COMPARE = "compare"

#: Commands that repeat a screen.
COMMANDS: dict[str, Callable[[Project], list[str]]] = {
    "channels": probe_command,
    "run": compare_command,
    "verdict": lambda project: ["report", project.argument(RESULTS)],
}

#: Projects in the switcher.
MAX_RECENT = 8

#: Bytes of a form.
MAX_FORM = 2_000_000

#: Headers that put a fragment into the message of a page.
MESSAGE_HEADERS = {"HX-Retarget": "#message", "HX-Reswap": "innerHTML"}

Form = Mapping[str, list[str]]

_logger = logging.getLogger("hydrodamp.app")


def render(request: Request, template: str, **variables: Any) -> HTMLResponse:
    """Return a page or a fragment; it knows the addresses of the server and of its project."""
    addresses = {
        "home": request.scope["root_path"],
        "address": project_address(request, request.path_params.get("project", "")),
    }
    page = page_environment("hydrodamp.app").get_template(template)
    return HTMLResponse(page.render(addresses | variables))


def project_address(request: Request, name: str) -> str:
    """Return the path of the pages of a project."""
    return f"{request.scope['root_path']}/p/{quote(name)}"


def render_screen(
    request: Request,
    project: Project,
    screen: str,
    template: str = "",
    **variables: Any,
) -> HTMLResponse:
    """Return a screen of a project, or a fragment of it, with the state of all steps."""
    job = jobs_of(request).find(project, COMPARE)
    steps = step_states(project, job is not None and job.is_running)
    blocker, listed = find_blocker(steps, screen), screen in COMMANDS
    has_command = listed and (blocker is None or screen == "channels")
    shell = {
        "project": project,
        "recent": list_projects(project.root)[:MAX_RECENT],
        "screen": screen,
        "title": STEPS[screen],
        "steps": steps,
        "blocker": blocker,
        "version": getattr(request.state, "version", "") or project.version,
        "command": format_command(COMMANDS[screen](project)) if has_command else "",
    }
    return render(request, template or f"{screen}.html.j2", **shell, **variables)


def jobs_of(request: Request) -> Jobs:
    """Return the jobs of the server."""
    jobs: Jobs = request.app.state.jobs
    return jobs


class FieldError(ProblemError):
    """A value of a field that is not possible."""

    def __init__(self, field: str, text: str) -> None:
        super().__init__(text)
        self.field = field


def render_error(request: Request, text: str, status: int, field: str = "") -> HTMLResponse:
    """Return a message in place of a fragment: at its field, or at the top of the page."""
    response = render(request, "message.html.j2", text=text, field=field)
    response.status_code = status
    at_field = {"HX-Retarget": f"#error-{field}"} if field else {}
    response.headers.update(MESSAGE_HEADERS | at_field)
    return response


def redirect(request: Request, project: Project, screen: str) -> Response:
    """Return the instruction to load a screen of a project."""
    return Response(headers={"HX-Redirect": f"{project_address(request, project.name)}/{screen}"})


def field_value(form: Form, name: str, default: str = "") -> str:
    """Return the last value of a field."""
    return form.get(name, [default])[-1]


def project_of(request: Request) -> Project:
    """Return the project that the path of a request names; a page has the version of its start."""
    project = find_project(request.app.state.root, request.path_params["project"])
    if request.method == "GET":
        request.state.version = project.version
    return project


Handler = Callable[[Request, Form], Response]


def handler(function: Handler) -> Callable[[Request], Awaitable[Response]]:
    """Return the endpoint of a function of a request and its form."""

    async def endpoint(request: Request) -> Response:
        form: Form = {}
        if request.method == "POST":
            body = b""
            async for chunk in request.stream():
                body += chunk
                if len(body) > MAX_FORM:
                    text = f"a form must have at most {MAX_FORM / 1e6:g} MB; send less text"
                    return render_error(request, text, 413)
            form = parse_qs(body.decode("utf-8", "replace"), keep_blank_values=True)
        try:
            return await run_in_threadpool(function, request, form)
        except Exception as error:
            return _render_failure(request, error)

    return endpoint


def describe_disk_failure(error: OSError, path: str = "") -> FileError:
    """Return the error of a file that cannot be read or written."""
    return FileError(
        f"{path or error.filename or 'a file'}: cannot be read or written: "
        f"{error.strerror or error}. Free disk space, or change the permissions of the folder."
    )


def _render_failure(request: Request, error: Exception) -> Response:
    """Return the message of an error: of the input, or of the program, whose log has it whole."""
    if isinstance(error, OSError) and not isinstance(error, HydrodampError):
        error = describe_disk_failure(error)
    is_input = isinstance(error, HydrodampError)
    status = 409 if isinstance(error, OutdatedEditError) else 422 if is_input else 500
    text = str(error) if is_input else f"internal error: {type(error).__name__}: {error}"
    if not is_input:
        _logger.error("%s %s", request.method, request.url.path, exc_info=error)
    if request.headers.get("hx-request"):
        return render_error(request, text, status, getattr(error, "field", ""))
    has_channels = "project" in request.path_params and "/channels" not in request.url.path
    page = render(
        request,
        "error.html.j2",
        text=text,
        title="Not possible",
        steps=step_states(None),
        screen="",
        has_channels=has_channels,
    )
    page.status_code = status
    return page


def number_field(
    form: Form, name: str, unit: str, low: float = 0.0, high: float = math.inf
) -> float:
    """Return the number of a field."""
    text = field_value(form, name).strip().replace(",", ".")
    try:
        value = float(text)
    except ValueError as error:
        got = f"got '{text}'" if text else "it is empty"
        raise FieldError(name, f"must be a number [{unit}]; {got}") from error
    if not low <= value < high:
        most = f" and below {high:g}" if high < math.inf else ""
        raise FieldError(name, f"must be at least {low:g}{most} [{unit}]; got {text}")
    return value


def number(request: Request, name: str, default: float) -> float:
    """Return a number of the query."""
    text = request.query_params.get(name)
    try:
        value = default if text is None else float(text)
    except ValueError as error:
        raise ProblemError(f"`{name}` must be a number; got '{text}'") from error
    return value if math.isfinite(value) else default


def asset_folder(package: str) -> Path:
    """Return the folder of the assets of a package."""
    return Path(str(files(package).joinpath("assets")))

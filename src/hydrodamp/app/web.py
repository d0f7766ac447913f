"""Pages, fragments and errors of the local server.

A page shows a project. A fragment answers a change: the part of the page that depends on it, with
the version of the files. Handlers run in threads; they raise errors that become messages.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs

from jinja2 import Environment, PackageLoader, StrictUndefined
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from hydrodamp.app.commands import format_command
from hydrodamp.app.project import OutdatedEditError, Project, find_project
from hydrodamp.errors import HydrodampError

#: Screens of a project: name, title.
SCREENS = (
    ("channels", "Channels"),
    ("vehicle", "Vehicle"),
    ("split", "Split"),
    ("run", "Run"),
    ("verdict", "Verdict"),
    ("files", "Take away"),
)

#: Bytes of a form.
MAX_FORM = 2_000_000

Form = Mapping[str, list[str]]


@cache
def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("hydrodamp.app", "assets"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render(template: str, **variables: Any) -> HTMLResponse:
    """Return a page or a fragment."""
    return HTMLResponse(_environment().get_template(template).render(variables))


def render_screen(
    project: Project, screen: str, command: list[str] | None, **variables: Any
) -> HTMLResponse:
    """Return a screen of a project with the command that repeats it."""
    return render(
        f"{screen}.html.j2",
        project=project,
        screen=screen,
        screens=SCREENS,
        title=dict(SCREENS)[screen],
        version=project.version,
        command=format_command(command) if command else "",
        **variables,
    )


def render_error(error: Exception, status: int = 422) -> HTMLResponse:
    """Return a message in place of a fragment."""
    response = render("message.html.j2", text=str(error))
    response.status_code = 409 if isinstance(error, OutdatedEditError) else status
    response.headers["HX-Retarget"] = "#message"
    response.headers["HX-Reswap"] = "innerHTML"
    return response


def field_value(form: Form, name: str, default: str = "") -> str:
    """Return the last value of a field."""
    return form.get(name, [default])[-1]


def project_of(request: Request) -> Project:
    """Return the project that the path of a request names."""
    return find_project(request.app.state.root, request.path_params["project"])


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
                    return render_error(HydrodampError("the form is too large"), 413)
            form = parse_qs(body.decode("utf-8", "replace"), keep_blank_values=True)
        try:
            return await run_in_threadpool(function, request, form)
        except HydrodampError as error:
            if request.headers.get("hx-request"):
                return render_error(error)
            page = render("error.html.j2", text=str(error), title="Not possible")
            page.status_code = 422
            return page

    return endpoint


def asset_folder(package: str) -> Path:
    """Return the folder of the assets of a package."""
    return Path(str(files(package).joinpath("assets")))

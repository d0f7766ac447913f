"""Server of the local pages: routes, session, and the start in a browser."""

from __future__ import annotations

import socket
import webbrowser
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from urllib.parse import quote

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import ClientDisconnect, Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from hydrodamp.app import channels, checks, run, series, split, start, takeaway, vehicle
from hydrodamp.app.jobs import Jobs
from hydrodamp.app.project import resolve_log
from hydrodamp.app.security import LOOPBACK, LocalAccess, Session
from hydrodamp.app.web import Handler, asset_folder, handler
from hydrodamp.errors import FileError

#: Seconds for open connections after Ctrl-C, and from the start to the visit of the browser.
SHUTDOWN, START = 2, 120

#: Handlers by method and path.
HANDLERS: dict[tuple[str, str], Handler] = {
    ("GET", "/"): start.show_start,
    ("POST", "/open"): start.open_logs,
    ("POST", "/example"): start.open_example,
    ("POST", "/p/{project}/project/{action}"): start.change_project,
    ("GET", "/p/{project}/channels"): channels.show_channels,
    ("GET", "/p/{project}/channels/checks"): checks.show_checks,
    ("POST", "/p/{project}/channels/column"): channels.change_column,
    ("POST", "/p/{project}/channels/frame"): channels.change_frame,
    ("POST", "/p/{project}/channels/step"): channels.apply_fix,
    ("POST", "/p/{project}/channels/preset"): channels.apply_preset,
    ("POST", "/p/{project}/channels/text"): channels.change_text,
    ("GET", "/p/{project}/channels/series"): series.column_series,
    ("GET", "/p/{project}/channels/series/pair"): series.column_pair,
    ("GET", "/p/{project}/channels/preview"): series.preview_step,
    ("GET", "/p/{project}/vehicle"): vehicle.show_vehicle,
    ("POST", "/p/{project}/vehicle"): vehicle.choose_vehicle,
    ("POST", "/p/{project}/vehicle/copy"): vehicle.copy_fleet_vehicle,
    ("POST", "/p/{project}/vehicle/actuators"): vehicle.map_actuators,
    ("POST", "/p/{project}/vehicle/gains"): vehicle.choose_gains,
    ("GET", "/p/{project}/split"): split.show_split,
    ("POST", "/p/{project}/split"): split.change_split,
    ("GET", "/p/{project}/split/series"): series.log_series,
    ("GET", "/p/{project}/split/series/pair"): series.track,
    ("GET", "/p/{project}/run"): run.show_run,
    ("POST", "/p/{project}/run/choice"): run.choose_models,
    ("POST", "/p/{project}/run/start"): run.start_run,
    ("POST", "/p/{project}/run/cancel"): run.cancel_run,
    ("GET", "/p/{project}/run/status"): run.show_status,
    ("GET", "/p/{project}/verdict"): takeaway.show_verdict,
    ("GET", "/p/{project}/files"): takeaway.show_files,
    ("POST", "/p/{project}/files/export"): takeaway.start_export,
    ("POST", "/p/{project}/files/plan"): takeaway.start_plan,
    ("GET", "/p/{project}/files/exports"): takeaway.show_exports,
    ("GET", "/p/{project}/file/{path:path}"): takeaway.send_file,
    ("GET", "/p/{project}/archive"): takeaway.send_archive,
}


def create_app(root: Path, session: Session) -> Starlette:
    """Return the application for the projects below a folder."""
    jobs = Jobs()

    @asynccontextmanager
    async def lifespan(app: Starlette) -> AsyncIterator[None]:
        yield
        jobs.stop_all()

    routes: list[BaseRoute] = [
        Route(path, handler(function), methods=[method])
        for (method, path), function in HANDLERS.items()
    ]
    routes += [
        Route("/upload", start.upload, methods=["PUT"]),
        Mount("/assets", StaticFiles(directory=asset_folder("hydrodamp.app"))),
        Mount("/report", StaticFiles(directory=asset_folder("hydrodamp.report"))),
    ]
    app = Starlette(
        routes=[Mount(session.path, routes=routes)],
        middleware=[Middleware(LocalAccess, session=session)],
        exception_handlers={ClientDisconnect: _end_request},
        lifespan=lifespan,
    )
    app.state.root, app.state.jobs = root.resolve(), jobs
    return app


def _end_request(request: Request, error: Exception) -> Response:
    """Return the answer to a browser that has gone before the end of its request."""
    return Response(status_code=400)


def serve(
    root: Path,
    logs: Sequence[str],
    port: int,
    announce: Callable[[str], None],
    open_browser: bool = True,
) -> None:
    """Serve the projects below a folder until Ctrl-C, and open the browser."""
    root = root.resolve()
    address = "/"
    if logs:
        project = start.open_project(root, tuple(resolve_log(root, log) for log in logs))
        address = f"/p/{quote(project.name)}/channels"
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((LOOPBACK[0], port))
        except OSError as error:
            raise FileError(
                f"port {port} cannot be used: {error}. Give another `--port`."
            ) from error
        listener.listen()  # the browser may be faster than the server
        port = listener.getsockname()[1]
        session = Session(port, announce, address)
        session.announce()
        if open_browser:
            webbrowser.open(session.new_address(START))
        config = uvicorn.Config(
            create_app(root, session),
            log_level="warning",
            timeout_graceful_shutdown=SHUTDOWN,
            server_header=False,
        )
        uvicorn.Server(config).run(sockets=[listener])

"""Screen 1: open logs by path or by drop, and projects."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response

from hydrodamp.app.project import (
    MAPPING,
    Project,
    create_project,
    list_logs,
    list_projects,
    resolve_log,
)
from hydrodamp.app.recordings import read_files
from hydrodamp.app.web import Form, render, render_error
from hydrodamp.errors import FileError
from hydrodamp.files import temporary_prefix

#: Folder of dropped files, and their largest size [bytes].
UPLOADS, MAX_UPLOAD = "logs", 4 * 2**30

_NAME = re.compile(r"[^\w.+()@ -]+")


def show_start(request: Request, form: Form) -> Response:
    """Return the page with projects and logs."""
    root: Path = request.app.state.root
    return render(
        "start.html.j2",
        title="hydrodamp",
        root=str(root),
        projects=list_projects(root),
        logs=list_logs(root),
    )


def open_logs(request: Request, form: Form) -> Response:
    """Create the project of logs and go to its channels."""
    root: Path = request.app.state.root
    paths = [line.strip() for text in form.get("log", []) for line in text.splitlines()]
    logs = tuple(dict.fromkeys(resolve_log(root, path) for path in paths if path))
    if not logs:
        raise FileError("name at least one log")
    if "joined" in form:
        logs = ("+".join(logs),)
    project = create_project(root, logs)
    try:
        draft_mapping(project)
    except Exception:
        with suppress(OSError):  # a log that cannot be read leaves no project
            project.path("project.yaml").unlink()
            project.folder.rmdir()
        raise
    address = f"/p/{project.name}/channels"
    if request.headers.get("hx-request"):
        return Response(headers={"HX-Redirect": address})
    return RedirectResponse(address, status_code=303)


def draft_mapping(project: Project) -> None:
    """Write the drafted mapping of logs that need one."""
    files = read_files(project)
    if not project.text(MAPPING) and not files.is_canonical:
        project.write(project.version, {MAPPING: files.probe.draft.text})


async def upload(request: Request) -> Response:
    """Write a dropped file into the folder of logs, whole or not at all."""
    root: Path = request.app.state.root
    name = _NAME.sub("-", Path(request.query_params.get("name", "")).name).strip(". ")
    if not name:
        return render_error(FileError("the dropped file has no name"))
    folder = root / UPLOADS
    folder.mkdir(exist_ok=True)
    target = folder / name
    temporary = folder / f"{temporary_prefix(target)}upload"
    size = 0
    try:
        with temporary.open("wb") as stream:
            async for chunk in request.stream():
                size += len(chunk)
                if size > MAX_UPLOAD:
                    error = FileError(f"{name}: is larger than {MAX_UPLOAD / 2**30:.0f} GiB")
                    return render_error(error, 413)
                stream.write(chunk)
        if target.exists() and target.read_bytes() != temporary.read_bytes():
            error = FileError(f"{UPLOADS}/{name}: exists with other content; rename one of the two")
            return render_error(error)
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
    return JSONResponse({"path": f"{UPLOADS}/{name}"})

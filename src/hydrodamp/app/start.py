"""Screen 1: open logs by path or by drop, and projects."""

from __future__ import annotations

import filecmp
import os
import re
import secrets
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from threading import Lock

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from hydrodamp.app.project import (
    MAPPING,
    PROJECT,
    Project,
    create_project,
    find_project_of,
    list_logs,
    list_projects,
    resolve_log,
)
from hydrodamp.app.recordings import read_files
from hydrodamp.app.web import Form, describe_disk_failure, redirect, render, render_error
from hydrodamp.errors import FileError
from hydrodamp.files import temporary_prefix

#: Folder of dropped files, and the largest size of all of them [bytes].
UPLOADS, MAX_UPLOAD = "logs", 16 * 2**30

#: Bytes of the name of a dropped file: that of a file, less the temporary suffix.
MAX_NAME = 180

_NAME = re.compile(r"[^\w.()@ -]+")

_lock = Lock()


def show_start(request: Request, form: Form) -> Response:
    """Return the page with projects and logs."""
    root: Path = request.app.state.root
    return render(
        request,
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
    return redirect(request, open_project(root, logs), "channels")


def open_project(root: Path, logs: tuple[str, ...]) -> Project:
    """Return the project of logs; a new one has a drafted mapping, or is not left behind."""
    known = find_project_of(root, logs)
    if known is not None:
        return known
    project = create_project(root, logs)
    try:
        draft_mapping(project)
    except Exception:
        with suppress(OSError):
            project.path(PROJECT).unlink()
            project.folder.rmdir()
        raise
    return project


def draft_mapping(project: Project) -> None:
    """Write the drafted mapping of logs that need one."""
    files = read_files(project)
    if not project.text(MAPPING) and not files.is_canonical:
        project.write(project.version, {MAPPING: files.probe.draft.text})


async def upload(request: Request) -> Response:
    """Write a dropped file into the folder of logs, whole or not at all."""
    root: Path = request.app.state.root
    name = _NAME.sub("-", Path(request.query_params.get("name", "")).name).strip(". -")
    if not name or len(name.encode()) > MAX_NAME:
        text = f"the name of the dropped file needs 1 to {MAX_NAME} bytes"
        return render_error(request, text, 422)
    size = request.headers.get("content-length", "")
    if not size.isdecimal():
        return render_error(request, "a dropped file needs the header Content-Length", 411)
    folder = root / UPLOADS
    temporary = folder / f"{temporary_prefix(folder / name)}{secrets.token_hex(8)}"
    try:
        folder.mkdir(exist_ok=True)
        if not folder.resolve().is_relative_to(root):
            raise FileError(f"{UPLOADS} is a link to a folder outside {root}")
        if not await run_in_threadpool(_reserve, temporary, folder / name, int(size)):
            text = (
                f"{UPLOADS}/{name}: the files in {UPLOADS} would have more than "
                f"{MAX_UPLOAD / 2**30:.0f} GiB; remove some, or copy this one into {root}"
            )
            return render_error(request, text, 413)
        with temporary.open("r+b") as stream:
            async for chunk in request.stream():
                stream.write(chunk)
        await run_in_threadpool(_publish, temporary, folder / name)
    except FileError as error:
        return render_error(request, str(error), 422)
    except OSError as error:
        text = str(describe_disk_failure(error, f"{UPLOADS}/{name}"))
        return render_error(request, text, 422)
    finally:
        with suppress(OSError):
            temporary.unlink()
    return JSONResponse({"path": f"{UPLOADS}/{name}"})


def _reserve(temporary: Path, target: Path, size: int) -> bool:
    """Give a temporary file the size that other uploads count; return whether it is allowed."""
    with _lock:
        n_bytes = _total_size(each for each in target.parent.iterdir() if each != target)
        if n_bytes + size > MAX_UPLOAD:
            return False
        with temporary.open("wb") as stream:
            stream.truncate(size)
        return True


def _total_size(paths: Iterable[Path]) -> int:
    """Return the bytes of files, of which others may be removed at any time."""
    total = 0
    for path in paths:
        with suppress(FileNotFoundError):
            total += path.stat().st_size
    return total


def _publish(temporary: Path, target: Path) -> None:
    """Move a whole file to its name, unless another content has it."""
    with _lock:
        if target.exists() and not filecmp.cmp(target, temporary, shallow=False):
            raise FileError(f"{target.name}: exists with other content; rename one of the two")
        os.replace(temporary, target)

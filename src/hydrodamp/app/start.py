"""Screen 1: open logs by path or by drop, and projects."""

from __future__ import annotations

import filecmp
import os
import re
import secrets
import shutil
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
    duplicate_project,
    find_project_of,
    list_logs,
    list_projects,
    rename_project,
    resolve_log,
)
from hydrodamp.app.recordings import read_files
from hydrodamp.app.steps import Step, step_states
from hydrodamp.app.web import (
    FieldError,
    Form,
    describe_disk_failure,
    field_value,
    jobs_of,
    project_of,
    redirect,
    render,
    render_error,
)
from hydrodamp.data.canonical import write_log
from hydrodamp.errors import FileError, HydrodampError, ProblemError
from hydrodamp.files import temporary_prefix
from hydrodamp.simulation.campaign.reenact import reenact

#: Folder of dropped files, and the largest size of all of them [bytes].
UPLOADS, MAX_UPLOAD = "logs", 16 * 2**30

#: Bytes of the name of a dropped file: that of a file, less the temporary suffix.
MAX_NAME = 180

#: Log of the example, and the duration of each of its runs [s].
EXAMPLE, EXAMPLE_SECONDS = "example-auv.csv", 60.0

_NAME = re.compile(r"[^\w.()@ -]+")

_lock = Lock()


def show_start(request: Request, form: Form) -> Response:
    """Return the page with projects and logs."""
    root: Path = request.app.state.root
    return render(
        request,
        "start.html.j2",
        title="Open a log",
        screen="open",
        steps=step_states(None),
        projects=[(project, next_step(project)) for project in list_projects(root)],
        logs=list_logs(root),
    )


def next_step(project: Project) -> Step | None:
    """Return the first step of a project that is not done, None of a damaged one."""
    with suppress(HydrodampError):
        steps = step_states(project)
        return next((step for step in steps if step.state != "done"), steps[-1])
    return None


def open_example(request: Request, form: Form) -> Response:
    """Open the log of a simulated AUV, which is written into the folder of logs."""
    root: Path = request.app.state.root
    path = root / UPLOADS / EXAMPLE
    if not path.is_file():
        path.parent.mkdir(exist_ok=True)
        write_log(reenact(seed=1, duration=EXAMPLE_SECONDS).train, path)
    log = resolve_log(root, f"{UPLOADS}/{EXAMPLE}")
    return redirect(request, open_project(root, (log,)), "channels")


def change_project(request: Request, form: Form) -> Response:
    """Rename, duplicate or delete the project; the logs stay."""
    project, action = project_of(request), request.path_params["action"]
    if jobs_of(request).is_busy(project):
        raise ProblemError("a command of this project is running: cancel it, or wait for its end")
    if action == "delete":
        shutil.rmtree(project.folder)
        return Response(headers={"HX-Redirect": f"{request.scope['root_path']}/"})
    if action == "duplicate":
        return redirect(request, duplicate_project(project), "channels")
    if not (name := field_value(form, "name").strip()):
        raise FieldError("name", "the project needs a name")
    if name != project.name:
        project = rename_project(project, name)
    return redirect(request, project, "channels")


def open_logs(request: Request, form: Form) -> Response:
    """Create the project of logs and go to its channels."""
    root: Path = request.app.state.root
    paths = [line.strip() for text in form.get("log", []) for line in text.splitlines()]
    logs = tuple(dict.fromkeys(resolve_log(root, path) for path in paths if path))
    if not logs:
        raise FieldError("log", "choose at least one log")
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

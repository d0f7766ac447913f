"""Output of a command: results, messages, exit status, checks of ``--out``, and provenance."""

from __future__ import annotations

import functools
import hashlib
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from datetime import datetime
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, ParamSpec, TypeVar

import typer

from hydrodamp.cli.options import command_signature, definition
from hydrodamp.errors import FileError, HydrodampError, HydrodampWarning, ProblemError, printable
from hydrodamp.files import as_json, protected_inputs
from hydrodamp.progress import show_progress
from hydrodamp.results import check_new_file, check_results, complete_inputs

if TYPE_CHECKING:
    from hydrodamp.data.log import Log
    from hydrodamp.report.table import Table

P = ParamSpec("P")
R = TypeVar("R")
Inputs = Iterable[str | None]

_COLOURS = {"error": "red", "warning": "yellow"}

WORK_FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130

#: Commands that draw pictures or pages into `--out`.
_REPORTING_COMMANDS = {"batch", "compare", "control", "demo", "identify", "manoeuvre", "plan"}

#: Commands that print lines of progress where standard error is no terminal.
_LONG_COMMANDS = _REPORTING_COMMANDS - {"batch"}

_collected: ContextVar[dict[str, None]] = ContextVar("warned")


def print_results(*results: Table | str) -> None:
    """Print tables and texts on standard output."""
    from hydrodamp.report.table import to_text

    width = min(shutil.get_terminal_size().columns, 100)
    texts = (result if isinstance(result, str) else to_text(result, width) for result in results)
    typer.echo("\n".join(map(printable, "\n\n".join(texts).split("\n"))))


def print_output(json: bool, document: object, *results: Table | str) -> None:
    """Print a result on standard output: as a JSON document, or as tables and texts."""
    emit(document) if json else print_results(*results)


def note(text: str) -> None:
    """Print a message on standard error, with paths relative to the working directory."""
    lines = text.replace(f"{Path.cwd()}{os.sep}", "").split("\n")
    message = "\n".join(map(printable, lines))
    kind, colon, content = message.partition(":")
    is_plain = "NO_COLOR" in os.environ or os.environ.get("TERM") == "dumb"
    if colon and kind in _COLOURS and not is_plain:
        message = f"{typer.style(kind + colon, fg=_COLOURS[kind], bold=True)}{content}"
    typer.echo(message, err=True)  # without colours where it is no terminal


def emit(document: object) -> None:
    """Print a machine-readable result on standard output."""
    typer.echo(as_json(document), nl=False)


def fail(message: str, status: int = WORK_FAILED) -> NoReturn:
    """Print an error on standard error and exit with a status."""
    note(f"error: {message}")
    raise typer.Exit(status)


def handle_errors(command: Callable[P, R]) -> Callable[P, R]:
    """Return a command with ``--quiet`` that turns exceptions into a message and a status."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        is_quiet = kwargs.pop("quiet", False)
        for name, value in kwargs.items():
            if not value and (hint := definition(command.__name__, name).get("missing")):
                fail(f"`--{name}` is missing: {hint}", WRONG_INPUT)
        lines = command.__name__ in _LONG_COMMANDS
        display = nullcontext() if is_quiet else show_progress(lines=lines)
        with warnings_as_notes(), display:
            try:
                inputs = named_inputs(kwargs)
                complete_inputs(inputs)
                with standard_input_as_file(kwargs), protected_inputs(inputs):
                    return command(*args, **kwargs)
            except (typer.Exit, BrokenPipeError):
                raise
            except HydrodampError as error:
                fail(_name_extras(error, command.__name__, kwargs), WRONG_INPUT)
            except OSError as error:
                fail(f"{error.filename or 'file'}: {error.strerror or error}", WRONG_INPUT)
            except (KeyboardInterrupt, Exception) as error:
                if _interrupted(error):
                    note("interrupted")
                    raise typer.Exit(INTERRUPTED) from None
                frame = traceback.extract_tb(error.__traceback__)[-1]
                fail(
                    f"internal failure: {type(error).__name__}: {error} "
                    f"({Path(frame.filename).name}:{frame.lineno}). This is a defect of hydrodamp: "
                    "please report it with the command."
                )

    signature = command_signature(command)
    run.__signature__ = signature  # type: ignore[attr-defined]
    run.__annotations__ = {key: each.annotation for key, each in signature.parameters.items()}
    return run


@contextmanager
def standard_input_as_file(arguments: dict[str, Any]) -> Iterator[None]:
    """Replace ``-`` among the logs of a call by a file with the table on standard input."""
    names = [
        name for name in ("logs", "log", "train", "test") if "-" in (arguments.get(name) or ())
    ]
    if not names:
        yield
        return
    content = sys.stdin.buffer.read()
    if not content.strip():
        raise FileError("standard input is empty: `-` reads a CSV table from it.")
    with tempfile.TemporaryDirectory(prefix="hydrodamp-") as folder:
        path = Path(folder, "standard-input.csv")
        path.write_bytes(content)
        for name in names:
            arguments[name] = [str(path) if each == "-" else each for each in arguments[name]]
        yield


def _name_extras(error: HydrodampError, command: str, arguments: Mapping[str, Any]) -> str:
    """Return the message of an error; a missing package is followed by those of the report."""
    draws = command in _REPORTING_COMMANDS and arguments.get("out") is not None
    is_missing = isinstance(error.__cause__, ImportError)
    if draws and is_missing and not all(map(find_spec, ("jinja2", "matplotlib"))):
        return f'{error}. The report needs more packages: pip install "hydrodamp[report]"'
    return str(error)


def named_inputs(arguments: Mapping[str, Any]) -> list[Path]:
    """Return the files and folders that a call may read: texts name inputs, and paths outputs."""
    from hydrodamp.ingest.formats.files import find_logs

    values = [
        each
        for value in arguments.values()
        for each in (value if isinstance(value, list) else [value])
    ]
    texts = [each for each in values if isinstance(each, str)]
    texts += [name.strip() for text in texts for name in text.split(",")]
    texts += [text.rpartition(":")[0] for text in texts]  # of FILE:NAME
    inputs = [path for path in _paths(texts) if os.path.exists(path)]
    if any(isinstance(each, Path) and each.is_file() for each in values):
        # Results in a folder have digests; any other file in it may be a log.
        inputs += [file for path in inputs if path.is_dir() for file in find_logs(path)]
    return inputs


def _interrupted(error: BaseException | None) -> bool:
    """Return whether Ctrl-C caused an error: a compiled module that loads replaces it."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


@contextmanager
def warnings_as_notes() -> Iterator[None]:
    """Print each warning once, as one line on standard error, and collect it."""
    printed: dict[str, None] = {}
    token = _collected.set(printed)

    def show(message: Warning | str, *_: object, **__: object) -> None:
        text = " ".join(str(message).split())
        if text not in printed:
            printed[text] = None
            note(f"warning: {text}")

    with warnings.catch_warnings():
        warnings.simplefilter("always", HydrodampWarning)
        warnings.showwarning = show
        try:
            yield
        finally:
            _collected.reset(token)


def collected_warnings() -> dict[str, str]:
    """Return the distinct warnings of the running command in order, for provenance."""
    lines = "\n".join(_collected.get({}))
    return {"warnings": lines} if lines else {}


def warn_quality_issues(log: Log, length: float | None = None) -> None:
    """Warn of the quality issues of a log."""
    from hydrodamp.simulation.log_issues import quality_issues, warn_issues

    warn_issues(log, quality_issues(log, length))


def check_out_log(out: Path | None, force: bool) -> None:
    """Raise if a log cannot be written, or its suffix is not that of a log."""
    from hydrodamp.data.canonical import check_log_file

    check_new_file(out, force)
    if out is not None:
        check_log_file(out)


def check_out_folder(out: Path | None, resume: bool, force: bool) -> None:
    """Raise if a folder cannot be written or files in it would be replaced."""
    from hydrodamp.report.files import RESULTS

    if out is not None:
        check_results(out, RESULTS, force or resume)
    elif resume:
        raise ProblemError(
            "`--resume` reuses fits of an interrupted run: give its folder with `--out DIR`."
        )


def run_provenance(inputs: Inputs) -> dict[str, str]:
    """Return the command line, input files with hashes, and versions."""
    import numpy
    import scipy

    paths = [each for path in _paths(inputs) for each in (path, *sorted(path.rglob("*")))]
    words = {
        "date": datetime.now().astimezone().isoformat(sep=" ", timespec="minutes"),
        "git": _git_state(),
        "command": shlex.join(["hydrodamp", *sys.argv[1:]]),
        "files": "\n".join(f"{_digest(path)}  {path}" for path in paths if path.is_file()),
        "versions": f"Python {platform.python_version()}, NumPy {numpy.__version__}, "
        f"SciPy {scipy.__version__}, {platform.system()} {platform.machine()}",
    }
    return {key: text for key, text in words.items() if text}


def _git_state() -> str:
    """Return the commit of the working directory, and whether files are changed."""
    try:
        call = ["git", "describe", "--always", "--dirty"]
        done = subprocess.run(call, capture_output=True, text=True, timeout=2.0, check=False)
    except (OSError, subprocess.SubprocessError):  # no git, or it takes too long
        return ""
    return done.stdout.strip()


def _paths(inputs: Inputs) -> list[Path]:
    """Return the distinct input files and folders."""
    from hydrodamp.ingest.formats.files import split_joined_paths

    return [*dict.fromkeys(path for name in inputs if name for path in split_joined_paths(name))]


def _digest(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()

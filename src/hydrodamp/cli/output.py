"""Results on standard output, messages on standard error, and the exit status of errors."""

from __future__ import annotations

import functools
import inspect
import os
import shutil
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn, ParamSpec, TypeVar

import typer

from hydrodamp.cli.options import Quiet
from hydrodamp.errors import HydrodampError, HydrodampWarning, printable
from hydrodamp.files import as_json
from hydrodamp.progress import show_progress

if TYPE_CHECKING:
    from hydrodamp.report.table import Table

P = ParamSpec("P")
R = TypeVar("R")

WORK_FAILED, WRONG_INPUT, INTERRUPTED = 1, 2, 130

_collected: ContextVar[dict[str, None]] = ContextVar("warned")


def print_results(*results: Table | str) -> None:
    """Print tables and texts on standard output."""
    from hydrodamp.report.table import to_text

    width = min(shutil.get_terminal_size().columns, 100)
    texts = (result if isinstance(result, str) else to_text(result, width) for result in results)
    typer.echo("\n".join(map(printable, "\n\n".join(texts).split("\n"))))


def note(text: str) -> None:
    """Print a message on standard error, with paths relative to the working directory."""
    lines = text.replace(f"{Path.cwd()}{os.sep}", "").split("\n")
    typer.echo("\n".join(map(printable, lines)), err=True)


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
        with warnings_as_notes(), nullcontext() if is_quiet else show_progress():
            try:
                return command(*args, **kwargs)
            except (typer.Exit, BrokenPipeError):
                raise
            except HydrodampError as error:
                fail(str(error), WRONG_INPUT)
            except OSError as error:
                fail(f"{error.filename or 'file'}: {error.strerror or error}", WRONG_INPUT)
            except KeyboardInterrupt:
                note("interrupted")
                raise typer.Exit(INTERRUPTED) from None
            except Exception as error:
                if _interrupted(error):
                    note("interrupted")
                    raise typer.Exit(INTERRUPTED) from None
                frame = traceback.extract_tb(error.__traceback__)[-1]
                fail(
                    f"internal failure: {type(error).__name__}: {error} "
                    f"({Path(frame.filename).name}:{frame.lineno}). This is a defect of hydrodamp: "
                    "please report it with the command."
                )

    signature = inspect.signature(command, eval_str=True)
    quiet = inspect.Parameter(
        "quiet", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=Quiet
    )
    parameters = (*signature.parameters.values(), quiet)
    run.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


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

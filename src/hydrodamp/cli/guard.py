"""From errors and warnings to sentences on standard error and an exit status."""

from __future__ import annotations

import functools
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import ParamSpec, TextIO, TypeVar

import typer

from hydrodamp.cli.output import fail, note
from hydrodamp.errors import HydrodampError, HydrodampWarning
from hydrodamp.files import absent

P = ParamSpec("P")
R = TypeVar("R")

WORK_FAILED = 1
"""Exit status where the input was right and the work did not succeed."""

WRONG_INPUT = 2
"""Exit status where the call or the input is wrong."""

INTERRUPTED = 130
"""Exit status after Ctrl-C."""

_warned: ContextVar[dict[str, None]] = ContextVar("warned")


def guarded(command: Callable[P, R]) -> Callable[P, R]:
    """Return a command that ends in a sentence and a status, never a traceback."""

    @functools.wraps(command)
    def run(*args: P.args, **kwargs: P.kwargs) -> R:
        with warnings_as_notes():
            try:
                return command(*args, **kwargs)
            except (typer.Exit, typer.Abort, typer.BadParameter, BrokenPipeError):
                raise
            except HydrodampError as error:
                fail(str(error), WRONG_INPUT)
            except FileNotFoundError as error:
                fail(absent(error.filename) if error.filename else str(error), WRONG_INPUT)
            except OSError as error:
                fail(f"{error.filename or 'file'}: {error.strerror or error}", WRONG_INPUT)
            except KeyboardInterrupt:
                note("interrupted")
                raise typer.Exit(INTERRUPTED) from None
            except Exception as error:
                fail(internal_failure(error), WORK_FAILED)

    return run


@contextmanager
def warnings_as_notes() -> Iterator[None]:
    """Print each warning once, as one line on standard error, and keep it."""
    seen: dict[str, None] = {}
    before = _warned.set(seen)

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        text = " ".join(str(message).split())
        if text not in seen:
            seen[text] = None
            note(f"warning: {text}")

    with warnings.catch_warnings():
        warnings.simplefilter("always", HydrodampWarning)
        warnings.showwarning = show
        try:
            yield
        finally:
            _warned.reset(before)


def warned() -> tuple[str, ...]:
    """Return the warnings of the command that is running, in order, each once."""
    return tuple(_warned.get({}))


def internal_failure(error: Exception) -> str:
    """Return the sentence for a failure that is ours."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{Path(frame.filename).name}:{frame.lineno}"
    return (
        f"internal failure: {type(error).__name__}: {error} ({where}). This is a fault of "
        "hydrodamp: please report it with the command."
    )

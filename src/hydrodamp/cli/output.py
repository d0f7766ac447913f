"""What is printed where: results on standard output, all else on standard error."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import typer

if TYPE_CHECKING:
    from rich.console import Console


def results() -> Console:
    """Return the console for results."""
    from rich.console import Console

    return Console(highlight=False, emoji=False)


def messages() -> Console:
    """Return the console for messages and progress."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, emoji=False)


def note(text: str) -> None:
    """Print a message on standard error."""
    typer.echo(text, err=True)


def emit(document: object) -> None:
    """Print a machine-readable result on standard output."""
    from hydrodamp.files import as_json

    typer.echo(as_json(document), nl=False)


def fail(sentence: str, status: int) -> NoReturn:
    """Print what is wrong on standard error and end with a status."""
    note(f"error: {sentence}")
    raise typer.Exit(status)

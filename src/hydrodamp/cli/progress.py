"""Progress on standard error, where that is a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from hydrodamp.advance import listening
from hydrodamp.cli.output import messages

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

_HOUR = 3600.0
"""Over how long the rate is taken: a single fit may last minutes [s]."""


@contextmanager
def progress(
    label: str, total: int | None = None, before: int = 0, *, unit: str = ""
) -> Iterator[Callable[..., None]]:
    """Show a bar while work goes on; it vanishes at the end."""
    with _bar(_columns(total not in (None, 1), unit)) as bar:
        task = bar.add_task(label, total=total, completed=before)
        bar.advance(task, 0)  # the rate counts from here, not from the end of the first step

        def step(*_: object, steps: int = 1) -> None:
            bar.advance(task, steps)

        yield step


@contextmanager
def stages(label: str, *, unit: str = "") -> Iterator[Callable[[str, int, int], None]]:
    """Show a bar for work that says by itself how far it has come; it vanishes at the end."""
    with _bar(_columns(True, unit)) as bar:
        task, last = bar.add_task(label, total=None), (0, 0)

        def reach(what: str, done: int, total: int) -> None:
            nonlocal task, last
            if total != last[1] or done < last[0]:  # the next of several works
                bar.remove_task(task)
                task = bar.add_task(label, total=total or None, completed=done)
                bar.advance(task, 0)  # as above
            bar.update(task, description=f"{label} {what}".rstrip(), completed=done)
            last = done, total

        yield reach


@contextmanager
def followed(label: str, total: int, *, unit: str = "") -> Iterator[None]:
    """Show a bar for work inside that tells what share of it is done; it vanishes at the end."""
    with (
        stages(label, unit=unit) as reach,
        listening(lambda share: reach("", int(share * total), total)),
    ):
        yield


@contextmanager
def _bar(columns: tuple[ProgressColumn, ...]) -> Iterator[Progress]:
    """Show a bar where standard error is a terminal."""
    from rich.progress import Progress

    console = messages()
    shown = console.file.isatty() and console.is_interactive  # colours may be forced on a file
    with Progress(
        *columns,
        console=console,
        transient=True,
        disable=not shown,
        redirect_stdout=False,
        speed_estimate_period=_HOUR,
    ) as bar:
        yield bar


def _columns(counted: bool, unit: str) -> tuple[ProgressColumn, ...]:
    """Return what a bar shows; without steps to count, how long it has taken."""
    from rich.progress import (
        BarColumn,
        DownloadColumn,
        MofNCompleteColumn,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
        TransferSpeedColumn,
    )

    from hydrodamp.cli.rate import OnceKnown, RateColumn

    label = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(20))
    if not counted:
        return (*label, TimeElapsedColumn())
    left = TimeRemainingColumn(compact=True), TextColumn("left")
    known: tuple[ProgressColumn, ...] = (MofNCompleteColumn(), RateColumn(), TimeElapsedColumn())
    if unit:
        known = (DownloadColumn(), TransferSpeedColumn())
    return (*label, *map(OnceKnown, (*known, *left)))

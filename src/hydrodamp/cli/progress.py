"""Progress on standard error, where that is a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from hydrodamp.cli.output import messages

if TYPE_CHECKING:
    from rich.progress import ProgressColumn

_HOUR = 3600.0
"""Over how long the rate is taken: a single fit may last minutes [s]."""


@contextmanager
def progress(
    label: str, total: int | None = None, before: int = 0, *, unit: str = ""
) -> Iterator[Callable[..., None]]:
    """Show a bar while work goes on; it vanishes at the end.

    Parameters
    ----------
    label : str
        What is being done.
    total : int, optional
        Number of steps; without it, or for one alone, the bar only shows that work goes on,
        and how long.
    before : int, optional
        Steps that were done in an earlier run, and say nothing of the rate.
    unit : {"", "B"}, optional
        What a step is: one of the things to do, or a byte.

    Yields
    ------
    step : callable
        To be called after each step, from any thread; what a callback is given besides
        is passed over. The keyword `steps` says that it were several.
    """
    from rich.progress import Progress

    console = messages()
    shown = console.file.isatty() and console.is_interactive  # colours may be forced on a file
    bar = Progress(
        *_columns(total, unit),
        console=console,
        transient=True,
        disable=not shown,
        redirect_stdout=False,
        speed_estimate_period=_HOUR,
    )
    with bar:
        task = bar.add_task(label, total=total, completed=before)
        bar.advance(task, 0)  # the rate counts from here, not from the end of the first step

        def step(*_: object, steps: int = 1) -> None:
            bar.advance(task, steps)

        yield step


def _columns(total: int | None, unit: str) -> tuple[ProgressColumn, ...]:
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

    from hydrodamp.cli.rate import RateColumn

    label = (SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(20))
    if total is None or total == 1:
        return (*label, TimeElapsedColumn())
    left = (TimeRemainingColumn(compact=True), TextColumn("left"))
    if unit:
        return (*label, DownloadColumn(), TransferSpeedColumn(), *left)
    return (*label, MofNCompleteColumn(), RateColumn(), TimeElapsedColumn(), *left)

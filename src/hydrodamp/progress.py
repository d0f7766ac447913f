"""Progress bars over bytes or steps, on a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress

Item = TypeVar("Item")
Step = Callable[..., None]

#: The progress bars; None if not shown.
_bars: ContextVar[Progress | None] = ContextVar("bars", default=None)


@contextmanager
def show_progress() -> Iterator[None]:
    """Show progress inside the context on standard error, if it is a terminal."""
    token = _bars.set(_new_bars() if sys.stderr.isatty() else None)
    try:
        yield
    finally:
        _bars.reset(token)


def disable_progress() -> None:
    """Disable progress, for example in a forked process."""
    _bars.set(None)


@contextmanager
def progress(label: str, total: float | None = None) -> Iterator[Step]:
    """Yield a thread-safe function that advances the bar."""
    bars = _bars.get()
    if bars is None:
        yield lambda steps=1: None
        return
    task = bars.add_task(label.replace("[", r"\["), total=total)
    bars.start()
    try:
        yield lambda steps=1: bars.advance(task, steps)
    finally:
        bars.refresh()
        bars.remove_task(task)
        if not bars.tasks:
            bars.stop()


def count_items(items: Iterable[Item], label: str, total: int) -> Iterator[Item]:
    """Iterate over items and show progress."""
    with progress(label, total) as step:
        for item in items:
            yield item
            step()


def _new_bars() -> Progress:
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True, highlight=False, emoji=False)
    # A single fit may last minutes.
    return Progress(
        console=console, transient=True, redirect_stdout=False, speed_estimate_period=3600.0
    )

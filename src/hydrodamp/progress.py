"""Long work: progress bars on a terminal, and a parallel map that Ctrl-C interrupts."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Lock
from time import monotonic
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from rich.progress import Progress

Item = TypeVar("Item")
Step = Callable[..., None]

#: The progress bars; None if not shown.
_bars: ContextVar[Progress | None] = ContextVar("bars", default=None)


#: The labels printed as lines where standard error is no terminal; None if no lines are shown.
_lines: ContextVar[set[str] | None] = ContextVar("lines", default=None)

_LINE_INTERVAL = 10.0
"""s; between lines of a piece of work."""
_MANY_STEPS = 100  # work of more steps, such as the bytes of a file, has lines only at intervals


@contextmanager
def show_progress(*, lines: bool = False) -> Iterator[None]:
    """Show progress inside the context on standard error: bars on a terminal, else lines or none.

    A line is for the first start of a piece of work, and for its progress at intervals.
    """
    is_terminal = sys.stderr.isatty()
    token = _bars.set(_new_bars() if is_terminal else None)
    lines_token = _lines.set(set() if lines else None)
    try:
        yield
    finally:
        _bars.reset(token)
        _lines.reset(lines_token)


@contextmanager
def progress(label: str, total: float | None = None) -> Iterator[Step]:
    """Yield a thread-safe function that advances the bar."""
    bars = _bars.get()
    if bars is None:
        yield _print_lines(label, total)
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


def _print_lines(label: str, total: float | None) -> Step:
    """Print a label once; return a function that prints the number of steps at intervals."""
    if (labels := _lines.get()) is None:
        return lambda steps=1: None
    if label not in labels and (total or 0) <= _MANY_STEPS:
        labels.add(label)
        print(label, file=sys.stderr, flush=True)
    lock, n_done, last = Lock(), 0.0, monotonic()

    def step(steps: float = 1) -> None:
        nonlocal n_done, last
        with lock:
            n_done += steps
            if total and monotonic() - last >= _LINE_INTERVAL:
                last = monotonic()
                print(f"{label}: {n_done / total:.0%}", file=sys.stderr, flush=True)

    return step


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


Result = TypeVar("Result")

_POLL_INTERVAL = 0.2
"""s; Ctrl-C is handled between waits of this length, since Windows does not interrupt a wait."""


def run_parallel(
    work: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[Result], None] = lambda _: None,
) -> tuple[Result, ...]:
    """Call ``work`` with each tuple of arguments, on as many threads as cores.

    ``done`` receives each result as soon as it is complete. After an error or Ctrl-C no further
    call starts. BLAS runs single-threaded meanwhile: nested threads take several times as long.
    """
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    executor = ThreadPoolExecutor(os.cpu_count())
    with threadpool_limits(limits=1):
        futures = [executor.submit(work, *call) for call in calls]
        pending = set(futures)
        try:
            while pending:
                finished, pending = wait(pending, _POLL_INTERVAL, FIRST_COMPLETED)
                for future in sorted(finished, key=futures.index):
                    done(future.result())
        except BaseException as error:
            # On Ctrl-C, do not wait for calls that may take minutes.
            executor.shutdown(wait=not isinstance(error, KeyboardInterrupt), cancel_futures=True)
            raise
        executor.shutdown()
    return tuple(future.result() for future in futures)

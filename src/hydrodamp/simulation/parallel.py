"""Parallel map over threads, interruptible by Ctrl-C."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any, TypeVar

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

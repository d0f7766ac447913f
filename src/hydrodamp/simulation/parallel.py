"""The same work for many, on all cores, until it is done or interrupted."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any, TypeVar

Result = TypeVar("Result")

_GLANCE = 0.2
"""How long a wait may last before Ctrl-C is looked for; Windows does not break a wait [s]."""


def run_parallel(
    work: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[Result], None] = lambda _: None,
) -> tuple[Result, ...]:
    """Call ``work`` with each tuple of arguments, on as many threads as cores.

    Results are handed to ``done`` as they come. After an error or Ctrl-C no more is begun.
    BLAS keeps to the thread that calls it meanwhile: threads of its own beside ours take
    several times as long.
    """
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    executor = ThreadPoolExecutor(os.cpu_count())
    with threadpool_limits(limits=1):
        futures = [executor.submit(work, *call) for call in calls]
        pending = set(futures)
        try:
            while pending:
                finished, pending = wait(pending, _GLANCE, FIRST_COMPLETED)
                for future in sorted(finished, key=futures.index):
                    done(future.result())
        except BaseException as error:
            # Ctrl-C does not wait for work that may last minutes.
            executor.shutdown(wait=not isinstance(error, KeyboardInterrupt), cancel_futures=True)
            raise
        executor.shutdown()
    return tuple(future.result() for future in futures)

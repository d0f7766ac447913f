"""The same work for many, on all cores, until it is done or interrupted."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, TypeVar

Result = TypeVar("Result")

_GLANCE = 0.2
"""How long a wait may last before Ctrl-C is looked for; Windows does not break a wait [s]."""


def each(
    work: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[Result], None] | None = None,
) -> tuple[Result, ...]:
    """Call ``work`` with each tuple of arguments, on as many threads as cores.

    BLAS keeps to the thread that calls it meanwhile: threads of its own beside ours take
    several times as long.
    """
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    with threadpool_limits(limits=1):
        return _each(work, calls, done)


def _each(
    work: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[Result], None] | None,
) -> tuple[Result, ...]:
    executor = ThreadPoolExecutor(max_workers=os.cpu_count())
    futures: list[Future[Result]] = []
    told: set[Future[Result]] = set()
    try:
        futures.extend(executor.submit(work, *call) for call in calls)
        _await(futures, told, done)
    except KeyboardInterrupt:
        executor.shutdown(wait=False, cancel_futures=True)
        _tell(futures, told, done)
        raise
    except BaseException:
        executor.shutdown(cancel_futures=True)
        raise
    executor.shutdown()
    return tuple(future.result() for future in futures)


def _await(
    futures: Sequence[Future[Result]],
    told: set[Future[Result]],
    done: Callable[[Result], None] | None,
) -> None:
    """Wait for all, hand out results as they come, and pass on what goes wrong."""
    pending, failures = set(futures), list[BaseException]()
    while pending:
        finished, pending = wait(pending, timeout=_GLANCE, return_when=FIRST_COMPLETED)
        errors = [error for future in finished if (error := future.exception()) is not None]
        for error in errors:
            if isinstance(error, KeyboardInterrupt):
                raise error
        _tell([future for future in futures if future in finished], told, done)
        failures += errors
        if failures:
            pending = {future for future in pending if not future.cancel()}
    if failures:
        raise failures[0]


def _tell(
    futures: Sequence[Future[Result]],
    told: set[Future[Result]],
    done: Callable[[Result], None] | None,
) -> None:
    for future in futures:
        there = future.done() and not future.cancelled() and future.exception() is None
        if done is not None and there and future not in told:
            done(future.result())
            told.add(future)

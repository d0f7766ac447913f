"""The same work for many, on all cores, until it is done or interrupted."""

from __future__ import annotations

import ctypes
import os
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Any, TypeVar

Result = TypeVar("Result")

_GLANCE = 0.2
"""How long a wait may last before Ctrl-C is looked for; Windows does not break a wait [s]."""

_LINGER = 0.02
"""How long a thread that ends while all are stopped waits for its own exception [s]."""


def each(
    work: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[Result], None] | None = None,
) -> tuple[Result, ...]:
    """Call ``work`` with each tuple of arguments, on as many threads as cores.

    The compiled core releases the interpreter, so threads scale; the NumPy
    reference does not and takes its time.

    Parameters
    ----------
    work : callable
        What to do.
    calls : sequence of tuple
        Arguments of each call.
    done : callable, optional
        Called with each result as it comes, in the thread that called, to keep it or for a
        progress bar. After Ctrl-C it has been called with every result there is.

    Returns
    -------
    results : tuple
        In the order of the calls.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C, once the work that was under way has stopped: within the call into
        compiled code that it was in.
    """
    executor, crew = ThreadPoolExecutor(max_workers=os.cpu_count()), _Crew()
    futures: list[Future[Result]] = []
    told: set[Future[Result]] = set()
    try:
        futures.extend(executor.submit(crew.call, work, *call) for call in calls)
        _await(futures, told, done)
    except KeyboardInterrupt:
        executor.shutdown(wait=False, cancel_futures=True)
        crew.stop()
        _tell(futures, told, done)
        raise
    finally:
        executor.shutdown(cancel_futures=True)
    return tuple(future.result() for future in futures)


def _await(
    futures: Sequence[Future[Result]],
    told: set[Future[Result]],
    done: Callable[[Result], None] | None,
) -> None:
    """Wait for all, hand out results as they come, and pass on an interruption."""
    pending = set(futures)
    while pending:
        finished, pending = wait(pending, timeout=_GLANCE, return_when=FIRST_COMPLETED)
        for future in finished:
            if isinstance(error := future.exception(), KeyboardInterrupt):
                raise error
        _tell([future for future in futures if future in finished], told, done)


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


class _Crew:
    """The threads at work, which can be stopped as Ctrl-C stops the main thread.

    A thread that computes looks for no flag, and a fit may take minutes. So it gets what
    the main thread got, an exception at the next line of Python that it comes to. There is
    no lock that such an exception could leave locked.
    """

    def __init__(self) -> None:
        self._at_work: set[int] = set()
        self._stopped = False

    def call(self, work: Callable[..., Result], *arguments: object) -> Result:
        """Return what the work returns; while it lasts this thread can be stopped."""
        me = threading.get_ident()
        try:
            self._at_work.add(me)
            if self._stopped:
                raise KeyboardInterrupt
            return work(*arguments)
        finally:
            self._at_work.discard(me)
            if self._stopped:
                time.sleep(_LINGER)  # an exception under way arrives here, not in the pool

    def stop(self) -> None:
        """Stop all work, again and again until it has: a handler may have caught the first."""
        self._stopped = True
        while self._at_work:
            for thread in tuple(self._at_work):
                _raise_in(thread, KeyboardInterrupt)
            time.sleep(_GLANCE)


def _raise_in(thread: int, error: type[BaseException]) -> None:
    """Raise an exception in a thread at its next line of Python."""
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(error))

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

_NAP = 0.001
"""How often a thread that ends looks whether the others have been told to stop [s]."""


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
        progress bar; after Ctrl-C or a failure too, with those that are finished.

    Returns
    -------
    results : tuple
        In the order of the calls.

    Raises
    ------
    KeyboardInterrupt
        After Ctrl-C. Work under way goes on to the end of the compiled code it is in, and
        is then stopped.
    Exception
        The first that a call raises; work under way is finished, and no more is begun.
    """
    executor, crew = ThreadPoolExecutor(max_workers=os.cpu_count()), _Crew()
    futures: list[Future[Result]] = []
    told: set[Future[Result]] = set()
    try:
        futures.extend(executor.submit(crew.call, work, *call) for call in calls)
        _await(futures, told, done)
    except KeyboardInterrupt:
        executor.shutdown(wait=False, cancel_futures=True)
        try:
            crew.stop()
        finally:
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


class _Crew:
    """The threads at work, which can be stopped as Ctrl-C stops the main thread.

    A thread that computes looks for no flag, and a fit may take minutes. So it gets what
    the main thread got, an exception at the next line of Python that it comes to. Like Ctrl-C
    that may be any line, one that has just taken a lock too: what was under way is not used
    again.
    """

    def __init__(self) -> None:
        self._at_work: set[int] = set()
        self._stopped = False
        self._telling = False

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
                self._linger()

    def _linger(self) -> None:
        """Wait for an exception that is on its way: it shall arrive here, not in the pool."""
        while self._telling:
            time.sleep(_NAP)
        time.sleep(0.0)  # one more place to arrive at

    def stop(self) -> None:
        """Stop all work, again and again until it has: a handler may have caught the first."""
        try:
            self._stopped = True
            while self._at_work:
                self._tell_all()
                time.sleep(_GLANCE)
        finally:
            self._telling = False

    def _tell_all(self) -> None:
        self._telling = True
        for thread in tuple(self._at_work):
            if not _raise_in(thread, KeyboardInterrupt):
                self._at_work.discard(thread)
        self._telling = False


def _raise_in(thread: int, error: type[BaseException]) -> bool:
    """Raise an exception in a thread at its next line of Python; tell whether there is one."""
    identity, what = ctypes.c_ulong(thread), ctypes.py_object(error)
    return bool(ctypes.pythonapi.PyThreadState_SetAsyncExc(identity, what))

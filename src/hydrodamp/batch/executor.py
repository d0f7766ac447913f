"""Executors: map a function over many logs in processes or on a cluster; an error is a result."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
)
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, TypeVar

from hydrodamp.errors import HydrodampError
from hydrodamp.progress import count_items

Result = TypeVar("Result")


class Failure(str):
    """Reason why a call has no result."""


class LocalProcesses(ProcessPoolExecutor):
    """Processes of one BLAS thread each, which end at once on ``shutdown`` or with their parent.

    They are not forks of this process: a fork copies the locks that threads of it hold.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        stopped, self._stop = multiprocessing.Pipe(duplex=False)
        methods = multiprocessing.get_all_start_methods()
        context = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
        super().__init__(n, context, initializer=_initialise_worker, initargs=(stopped,))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes, busy or not."""
        self._stop.send(None)  # nobody receives it, so each process sees it
        super().shutdown(wait, cancel_futures=cancel_futures)


def _initialise_worker(stopped: Connection) -> None:
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent stops its workers
    threadpool_limits(limits=1)
    Thread(target=_exit_when_stopped, args=(stopped,), daemon=True).start()


def _exit_when_stopped(stopped: Connection) -> None:
    parent = multiprocessing.parent_process()
    wait([stopped, *([parent.sentinel] if parent else [])])
    os._exit(1)


@contextmanager
def open_pool(client: Any, n: int | None, timeout: float) -> Iterator[Pool]:
    """Provide the workers of an executor or a Dask client, or ``n`` local processes.

    A call fails ``timeout`` [s] after its start on the worker.
    """
    executor = client.get_executor() if hasattr(client, "get_executor") else client
    pool = Pool(executor or LocalProcesses(n or os.cpu_count() or 1), timeout)
    try:
        yield pool
    finally:
        if client is None:
            pool.executor.shutdown()


@dataclass
class Pool:
    """Workers of an executor; local processes are started again if one of them is killed."""

    executor: Executor
    timeout: float

    def map(
        self, call: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failure]:
        """Yield a result or a ``Failure`` for each of the arguments, in their order."""

        def submit(executor: Executor, each: tuple[Any, ...]) -> Future[Result | Failure]:
            try:
                return executor.submit(_attempt_within, self.timeout, call, each)
            except BrokenExecutor as error:
                future = Future[Result | Failure]()
                future.set_exception(error)
                return future

        futures = deque(submit(self.executor, each) for each in arguments)
        for index in count_items(range(len(futures)), label, len(futures)):
            # No reference to the future: memory does not grow with the number of logs.
            result: Result | Failure = _outcome(futures.popleft())
            if isinstance(result, _Killed) and isinstance(self.executor, LocalProcesses):
                self.executor.shutdown()  # ends all calls
                with LocalProcesses(1) as alone:
                    result = _outcome(submit(alone, arguments[index]))
                self.executor = LocalProcesses(self.executor.n)
                pairs = zip(futures, arguments[index + 1 :], strict=True)
                futures = deque(
                    submit(self.executor, each) if isinstance(_outcome(future), _Killed) else future
                    for future, each in pairs
                )
            yield result


class _Killed(Failure):
    """A call whose process ended, or that of another call of its executor."""


def _outcome(future: Future[Any]) -> Any:
    try:
        return future.result()
    except BrokenExecutor:
        return _Killed("its process was killed, possibly as memory ran out.")
    except CancelledError:
        return Failure("it was cancelled: the scheduler is lost or was closed.")
    except Exception as error:  # a lost worker
        return Failure(f"{type(error).__name__}: {error}")


def _attempt_within(
    timeout: float, call: Callable[..., Result], arguments: tuple[Any, ...]
) -> Result | Failure:
    """Call in a separate thread, so that a hung call does not block its worker."""
    results: SimpleQueue[Result | Failure] = SimpleQueue()

    def attempt() -> None:
        try:
            results.put(call(*arguments))
        except HydrodampError as error:
            results.put(Failure(str(error)))
        except Exception as error:  # a file may raise any error in its reader
            results.put(Failure(f"{type(error).__name__}: {error}"))

    Thread(target=attempt, daemon=True).start()
    try:
        return results.get(timeout=timeout)
    except Empty:
        return Failure(f"it exceeded the timeout of {timeout:g} s.")

"""Executors: map a function over many logs in processes or on a cluster; an error is a result."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from queue import Empty, SimpleQueue
from threading import Thread
from time import monotonic
from typing import Any, TypeVar

from hydrodamp.errors import HydrodampError
from hydrodamp.progress import count_items, disable_progress

Result = TypeVar("Result")

POLL_INTERVAL = 1.0  # s, longest wait between two checks of the processes; a result ends it

MAX_STARTS = 2  # of a call: one is repeated if the system kills its process


class Failure(str):
    """Reason why a call has no result."""


@contextmanager
def open_pool(client: Any, n: int | None, timeout: float) -> Iterator[ExecutorPool | ProcessPool]:
    """Provide the workers of an executor or a Dask client, or ``n`` local processes.

    A call fails ``timeout`` [s] after its start on the worker.
    """
    if client is not None:
        executor = client.get_executor() if hasattr(client, "get_executor") else client
        yield ExecutorPool(executor, timeout)
        return
    with closing(ProcessPool(n or os.cpu_count() or 1, timeout)) as pool:
        yield pool


@dataclass
class ExecutorPool:
    """Workers of an executor, which restarts them."""

    executor: Executor
    timeout: float

    def map(
        self, call: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failure]:
        """Yield a result or a ``Failure`` for each of the arguments, in their order."""
        futures = deque(
            self.executor.submit(_attempt_within, self.timeout, call, each) for each in arguments
        )
        for _ in count_items(range(len(futures)), label, len(futures)):
            future = futures.popleft()  # no reference: memory does not grow with the number of logs
            try:
                result: Result | Failure = future.result()
            except CancelledError:
                result = Failure("it was cancelled: the scheduler is lost or was closed.")
            except Exception as error:  # a lost worker, a broken executor
                result = Failure(f"{type(error).__name__}: {error}")
            yield result


class _Worker:
    """A process that runs one call at a time."""

    def __init__(self) -> None:
        self.connection, remote = multiprocessing.Pipe()
        self.process = multiprocessing.Process(target=_serve, args=(remote,))
        self.process.start()
        remote.close()

    def kill(self) -> None:
        self.process.kill()
        self.process.join()
        self.connection.close()


@dataclass
class ProcessPool:
    """Local processes: a hung or killed one is replaced, and only its call fails."""

    n: int
    timeout: float
    _idle: list[_Worker] = field(default_factory=list)

    def map(
        self, call: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failure]:
        """Yield a result or a ``Failure`` for each of the arguments, in their order."""
        total = len(arguments)
        self._idle += [_Worker() for _ in range(min(self.n, total) - len(self._idle))]
        queue, starts = deque(range(total)), [0] * total
        busy: dict[_Worker, tuple[int, float]] = {}
        results: dict[int, Result | Failure] = {}
        try:
            for index in count_items(range(total), label, total):
                while index not in results:
                    while queue and len(busy) < self.n:
                        worker = self._idle.pop() if self._idle else _Worker()
                        task = queue.popleft()
                        starts[task] += 1
                        busy[worker] = task, monotonic() + self.timeout
                        with suppress(OSError):  # it was killed while idle, as `_collect` finds
                            worker.connection.send((call, arguments[task]))
                    for worker, task, result in self._collect(busy):
                        del busy[worker]
                        if result is None and starts[task] < MAX_STARTS:
                            queue.appendleft(task)
                        else:
                            results[task] = _kill_failure(worker) if result is None else result
                yield results.pop(index)
        finally:
            for worker in busy:
                worker.kill()

    def _collect(
        self, busy: dict[_Worker, tuple[int, float]]
    ) -> list[tuple[_Worker, int, Any | None]]:
        """Wait for a result, a killed process or a deadline; return results, None if killed."""
        nearest = min(deadline for _, deadline in busy.values()) - monotonic()
        wait([each.connection for each in busy], min(max(nearest, 0.0), POLL_INTERVAL))
        ended: list[tuple[_Worker, int, Any | None]] = []
        for worker, (task, deadline) in busy.items():
            is_alive = worker.process.is_alive()  # before the poll: no last result is lost
            if worker.connection.poll():
                try:
                    ended.append((worker, task, worker.connection.recv()))
                    self._idle.append(worker)
                    continue
                except (EOFError, OSError):
                    is_alive = False
            if not is_alive:
                worker.kill()
                ended.append((worker, task, None))
            elif monotonic() >= deadline:
                worker.kill()
                ended.append((worker, task, _timeout_failure(self.timeout)))
        return ended

    def close(self) -> None:
        """Stop the processes."""
        while self._idle:
            self._idle.pop().kill()


def _kill_failure(worker: _Worker) -> Failure:
    code = worker.process.exitcode or 0
    reason = f"exit status {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
    memory = ", possibly out of memory" if code == -getattr(signal, "SIGKILL", 0) else ""
    return Failure(f"its process was killed {MAX_STARTS} times ({reason}{memory}).")


def _timeout_failure(timeout: float) -> Failure:
    return Failure(f"it exceeded the timeout of {timeout:g} s.")


def _attempt(call: Callable[..., Result], arguments: tuple[Any, ...]) -> Result | Failure:
    try:
        return call(*arguments)
    except HydrodampError as error:
        return Failure(str(error))
    except Exception as error:  # a file may raise any error in its reader
        return Failure(f"{type(error).__name__}: {error}")


def _attempt_within(
    timeout: float, call: Callable[..., Result], arguments: tuple[Any, ...]
) -> Result | Failure:
    """Call in a separate thread, so that a hung call does not block its worker."""
    results: SimpleQueue[Result | Failure] = SimpleQueue()
    Thread(target=lambda: results.put(_attempt(call, arguments)), daemon=True).start()
    try:
        return results.get(timeout=timeout)
    except Empty:
        return _timeout_failure(timeout)


def _serve(connection: Connection) -> None:
    """Run calls until the pipe or the parent process ends."""
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent stops its workers
    Thread(target=_exit_with_parent, daemon=True).start()
    threadpool_limits(limits=1)
    disable_progress()
    while True:
        try:
            call, arguments = connection.recv()
        except EOFError:
            return
        result = _attempt(call, arguments)
        try:
            connection.send(result)
        except (TypeError, AttributeError, ValueError) as error:  # a result that cannot be pickled
            connection.send(Failure(f"{type(error).__name__}: {error}"))


def _exit_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)

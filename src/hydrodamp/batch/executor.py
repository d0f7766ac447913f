"""Map a call over many logs, in processes or on a cluster; a failure is a result with a reason."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from queue import Empty, SimpleQueue
from threading import Thread
from time import monotonic
from typing import Any, Protocol, TypeVar

from hydrodamp.errors import HydrodampError
from hydrodamp.progress import count_items, disable_progress

Result = TypeVar("Result")

#: Longest wait between two checks of the processes [s]; answers end a wait at once.
_POLL_INTERVAL = 1.0

#: How often a call may start: a process that somebody else killed costs no log.
_MAX_STARTS = 2


class Failure(str):
    """Why a call has no result."""


class WorkerPool(Protocol):
    """Workers that make the same call with many arguments."""

    def map(
        self, call: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failure]:
        """Yield the results in the order of the arguments, or why there is none."""


@contextmanager
def open_pool(client: Any, n: int | None, timeout: float) -> Iterator[WorkerPool]:
    """Provide an executor's workers, those of a Dask client, or ``n`` processes of this machine.

    A call ends ``timeout`` [s] after its start on the worker.
    """
    if client is not None:
        executor = client.get_executor() if hasattr(client, "get_executor") else client
        yield ExecutorPool(executor, timeout)
        return
    pool = ProcessPool(n or os.cpu_count() or 1, timeout)
    try:
        yield pool
    finally:
        pool.close()


@dataclass
class ExecutorPool:
    """Workers of an executor, which restarts them itself."""

    executor: Executor
    timeout: float

    def map(
        self, call: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failure]:
        """Yield the results in the order of the arguments, or why there is none."""
        futures = deque(
            self.executor.submit(_attempt_within, self.timeout, call, each) for each in arguments
        )
        for _ in count_items(range(len(futures)), label, len(futures)):
            future = futures.popleft()  # without the reference, memory does not grow with the logs
            try:
                result: Result | Failure = future.result()
            except CancelledError:
                result = Failure("its work was cancelled: the scheduler is lost, or was closed.")
            except Exception as error:  # a lost worker, a broken executor
                result = Failure(f"{type(error).__name__}: {error}")
            yield result


class _Worker:
    """A process that makes a call at a time."""

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
    """Processes of this machine: a hung or dead one is replaced and costs its call alone."""

    n: int
    timeout: float
    _idle: list[_Worker] = field(default_factory=list)

    def map(
        self, call: Callable[..., Result], arguments: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failure]:
        """Yield the results in the order of the arguments, or why there is none."""
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
                        _send(worker, (call, arguments[task]))
                    for worker, task, result in self._collect(busy):
                        del busy[worker]
                        if result is None and starts[task] < _MAX_STARTS:
                            queue.appendleft(task)
                        else:
                            results[task] = _death(worker) if result is None else result
                yield results.pop(index)
        finally:
            for worker in busy:
                worker.kill()

    def _collect(
        self, busy: dict[_Worker, tuple[int, float]]
    ) -> list[tuple[_Worker, int, Any | None]]:
        """Wait for an answer, a death or a deadline; return what ended, None for a death."""
        nearest = min(deadline for _, deadline in busy.values()) - monotonic()
        wait([each.connection for each in busy], min(max(nearest, 0.0), _POLL_INTERVAL))
        ended: list[tuple[_Worker, int, Any | None]] = []
        for worker, (task, deadline) in busy.items():
            is_alive = worker.process.is_alive()  # before the poll: a last answer is not lost
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
        """End the processes."""
        while self._idle:
            self._idle.pop().kill()


def _send(worker: _Worker, task: Any) -> None:
    try:
        worker.connection.send(task)
    except OSError:  # it died while idle; `_collect` finds it dead
        worker.process.join()


def _death(worker: _Worker) -> Failure:
    code = worker.process.exitcode or 0
    reason = f"exit status {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"
    memory = ", for want of memory perhaps" if code == -getattr(signal, "SIGKILL", 0) else ""
    return Failure(f"its process was killed {_MAX_STARTS} times ({reason}{memory}).")


def _timeout_failure(timeout: float) -> Failure:
    return Failure(f"it was given up after {timeout:g} s without an answer.")


def _attempt(call: Callable[..., Result], arguments: tuple[Any, ...]) -> Result | Failure:
    try:
        return call(*arguments)
    except HydrodampError as error:
        return Failure(str(error))
    except Exception as error:  # a file that breaks its reader
        return Failure(f"{type(error).__name__}: {error}")


def _attempt_within(
    timeout: float, call: Callable[..., Result], arguments: tuple[Any, ...]
) -> Result | Failure:
    """Make a call on a thread of its own, so that a hung one leaves its worker free."""
    answers: SimpleQueue[Result | Failure] = SimpleQueue()
    Thread(target=lambda: answers.put(_attempt(call, arguments)), daemon=True).start()
    try:
        return answers.get(timeout=timeout)
    except Empty:
        return _timeout_failure(timeout)


def _serve(connection: Connection) -> None:
    """Answer calls until the pipe or the parent process ends."""
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends its workers
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

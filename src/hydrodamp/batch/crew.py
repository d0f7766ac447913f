"""The same call for many logs, in processes or on a cluster; what fails is a reason, not an end."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from hydrodamp.errors import HydrodampError
from hydrodamp.progress import counted, unwatched

Result = TypeVar("Result")


class Failed(str):
    """Why there is no result, in words."""


@dataclass
class Crew:
    """Workers, and how long one of them may be silent [s]."""

    workers: Executor
    patience: float

    def each(
        self, call: Callable[..., Result], given: Sequence[tuple[Any, ...]], label: str
    ) -> Iterator[Result | Failed]:
        """Yield the results in the order of what is given, or why there is none."""
        futures = {place: self.workers.submit(call, *one) for place, one in enumerate(given)}
        for place, one in enumerate(counted(given, label, len(given))):
            try:
                # What is told is forgotten, or memory would grow with the logs.
                made: Result | Failed = _result(futures.pop(place), self.patience)
                yield made
            except BrokenProcessPool:
                # One of those under way killed its process: this one is tried by itself.
                yield self._alone(call, one)
                self.workers = _processes(getattr(self.workers, "_max_workers", None))
                for later, future in futures.items():
                    if not future.done() or future.exception() is not None:
                        futures[later] = self.workers.submit(call, *given[later])

    def _alone(self, call: Callable[..., Result], given: tuple[Any, ...]) -> Result | Failed:
        with _processes(1) as one:
            try:
                made: Result | Failed = _result(one.submit(call, *given), self.patience)
            except BrokenProcessPool:
                return Failed("its process was killed, for want of memory perhaps.")
        return made


@contextmanager
def crew(client: Any, n: int | None, patience: float) -> Iterator[Crew]:
    """Hold the workers: an executor, those of a Dask client, or processes of this machine."""
    if client is not None:
        yield Crew(client.get_executor() if hasattr(client, "get_executor") else client, patience)
        return
    own = Crew(_processes(n), patience)
    try:
        yield own
    finally:
        children = [*getattr(own.workers, "_processes").values()]  # noqa: B009 (of no Executor)
        own.workers.shutdown(wait=False, cancel_futures=True)
        for child in children:  # one may hang
            child.kill()


def _result(future: Future[Any], patience: float) -> Any:
    try:
        return future.result(patience)
    except TimeoutError:
        return Failed(f"it was given up after {patience:g} s without an answer.")
    except BrokenProcessPool:
        raise
    except CancelledError:
        return Failed("its work was cancelled: the scheduler is lost, or was closed.")
    except HydrodampError as error:
        return Failed(str(error))
    except Exception as error:  # of a worker, a scheduler, or a file that breaks its reader
        return Failed(f"{type(error).__name__}: {error}")


def _processes(n: int | None) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(n or os.cpu_count(), initializer=_quiet)


def _quiet() -> None:
    """Keep a process to one thread of BLAS, and from drawing bars beside those of the first."""
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    threadpool_limits(limits=1)
    unwatched()

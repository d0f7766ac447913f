"""Batches of up to a second or two, by name, so that another process can make them for itself."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from multiprocessing import get_context

from workload import FULL, PAPER, problem, truth

import hydrodamp as hd
from hydrodamp.identification.regression import accumulate
from hydrodamp.kernels import core

SAMPLES = 200_000
REPEATS = {"replay": 3, "adapt": 8, "triangle": 1}


@cache
def batch(name: str) -> Callable[[], object]:
    """Return a batch, its data made once a process."""
    if name == "triangle":
        prepared = problem(SAMPLES, PAPER)
        return lambda: accumulate(prepared, hd.RecordedAcceleration())
    prepared = problem(SAMPLES)
    segments, inputs = prepared.segments, prepared.inputs
    if name == "replay":
        plant, table = prepared.equations.plant, prepared.matrix(truth())
        return lambda: core.replay(plant, table, inputs, segments)
    bound = hd.AdaptiveIdentifier().bind(prepared, FULL)
    arguments = (bound.settings, bound.table, inputs, segments)
    return lambda: core.adapt(*arguments)


def run(name: str) -> None:
    """Run a batch several times."""
    work = batch(name)
    for _ in range(REPEATS[name]):
        work()


def ready(name: str) -> None:
    """Make the data, and hold the worker long enough for the other to take its share."""
    batch(name)()
    time.sleep(0.5)


@contextmanager
def pool(kind: str, name: str, workers: int = 2) -> Iterator[Executor]:
    """Yield a warm pool of threads or of fresh processes."""
    made: Executor
    if kind == "threads":
        made = ThreadPoolExecutor(workers)
    else:
        made = ProcessPoolExecutor(workers, mp_context=get_context("spawn"))
    with made as executor:
        list(executor.map(ready, [name] * workers))
        yield executor


def together(executor: Executor, name: str, workers: int = 2) -> None:
    """Run as many batches as there are workers, at once."""
    list(executor.map(run, [name] * workers))

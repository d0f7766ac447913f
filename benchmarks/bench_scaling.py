"""Two cores: threads against processes for the core, processes against one for the triangle."""

from __future__ import annotations

import os

import pytest
from batches import batch, pool, run, together
from interleaving import Watch, on_all_cores

pytestmark = pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="scaling takes two cores")


def medians(ours: Watch, other: Watch, work: float = 1.0) -> str:
    """Return the ratio of the medians, which busy cores press down, beside that of the best."""
    return f" (by medians {work * other.median / ours.median:.2f})"


@pytest.mark.parametrize("name", ["replay", "adapt"])
def test_threads_reach_processes(benchmark, ledger, name):
    """The core releases the interpreter; wall time counts, on whatever cores are free."""
    batch(name)()
    with pool("threads", name) as threads, pool("processes", name) as processes:
        by_threads, by_processes = on_all_cores(
            benchmark,
            lambda: together(threads, name),
            lambda: together(processes, name),
        )
    ledger.reaches(
        f"{name}: two threads, as a share of two processes{medians(by_threads, by_processes)}",
        1.0 / by_threads.best,
        1.0 / by_processes.best,
        unit="rounds/s",
        target=0.85,
    )


@pytest.mark.parametrize("kind", ["processes", "threads"])
def test_triangle_on_two_cores(benchmark, ledger, kind):
    """SciPy's LAPACK wrappers hold the interpreter, so only processes scale.

    Many short rounds: on a busy machine some of them find both cores free.
    """
    name = "triangle"
    batch(name)()
    with pool(kind, name) as workers:
        two, one = on_all_cores(
            benchmark,
            lambda: together(workers, name),
            lambda: run(name),
            rounds=40,
        )
    target = 1.5 if kind == "processes" else None
    what = f"triangle: two {kind}, against one{medians(two, one, 2.0)}"
    ledger.reaches(what, 2.0 / two.best, 1.0 / one.best, unit="batches/s", target=target)

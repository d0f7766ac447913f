"""The same work for many, on all cores."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

Result = TypeVar("Result")


def each(
    work: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    done: Callable[[], None] | None = None,
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
        Called after each result, for a progress bar.

    Returns
    -------
    results : tuple
        In the order of the calls.
    """
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as executor:
        futures = [executor.submit(work, *call) for call in calls]
        if done is not None:
            for future in futures:
                future.add_done_callback(lambda _: done())
        return tuple(future.result() for future in futures)

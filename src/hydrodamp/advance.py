"""How far long work has come, told from deep inside to whoever listens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import accumulate, pairwise
from threading import Lock
from typing import TypeVar

Item = TypeVar("Item")

Listener = Callable[[float], None]
"""Called with the share of everything that is done, from 0 to 1."""


By = Callable[..., None]
"""Says that so many more steps are done, one where nothing is said; from any thread."""

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Have a listener told how far the work inside has come."""
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


@contextmanager
def within(begin: float, end: float) -> Iterator[None]:
    """Say that the work inside is a part of that at hand."""
    outside = _listener.get()
    if outside is None:
        yield
        return
    with listening(lambda share: outside(begin + (end - begin) * share)):
        yield
    outside(end)


def advance(total: float) -> By:
    """Return how to say that the work at hand goes on."""
    listener = _listener.get()  # a thread begun later would not know it
    if listener is None or not total > 0:
        return _silence
    done, lock = 0.0, Lock()

    def by(steps: float = 1) -> None:
        nonlocal done
        with lock:
            done += steps
            listener(min(done / total, 1.0))

    return by


def _silence(steps: float = 1) -> None:
    """Tell nobody."""


def counted(items: Iterable[Item], total: int, each: int = 1) -> Iterator[Item]:
    """Go through items, and tell how many are done."""
    by = advance(total)
    for number, item in enumerate(items, start=1):
        yield item
        if number % each == 0:
            by(each)


def shares(weights: Sequence[float]) -> list[tuple[float, float]]:
    """Return what :func:`within` is to be told of parts that follow one another."""
    known = weights if any(weights) else [1.0] * len(weights)
    return [*pairwise(accumulate((each / sum(known) for each in known), initial=0.0))]

"""How far long work has come, told from deep inside to whoever listens.

Reading a log goes through many hands, and the one who knows how far it is stands at the bottom.
What is told goes past them all: work says what share of it is done, work that consists of parts
gives each a share, and a listener, if there is one, hears what share of everything that makes::

    with listening(print):
        with within(0.0, 0.5):
            by = advance(2)
            by()                # prints 0.25, and 0.5 after it
"""

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
    """Have a listener told how far the work inside has come.

    Parameters
    ----------
    listener : callable
        As :data:`Listener`.
    """
    before = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(before)


@contextmanager
def within(begin: float, end: float) -> Iterator[None]:
    """Say that the work inside is a part of that at hand.

    Parameters
    ----------
    begin, end : float
        What share is done before it and after it.

    Examples
    --------
    >>> with listening(print), within(0.5, 1.0):
    ...     advance(2)()
    0.75
    1.0
    """
    outside = _listener.get()
    if outside is None:
        yield
        return
    with listening(lambda share: outside(begin + (end - begin) * share)):
        yield
    outside(end)


def advance(total: float) -> By:
    """Return how to say that the work at hand goes on.

    Parameters
    ----------
    total : float
        Of how many steps it consists.

    Returns
    -------
    by : callable
        As :data:`By`. Where nobody listens it does nothing.

    Examples
    --------
    >>> with listening(print):
    ...     by = advance(4)
    ...     by(3)
    0.75
    """
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
    """Go through items, and tell how many are done.

    Parameters
    ----------
    items : iterable
        Any.
    total : int
        How many there are.
    each : int, optional
        After how many it is told.

    Yields
    ------
    item
        The next.

    Examples
    --------
    >>> with listening(print):
    ...     _ = [*counted("ab", 2)]
    0.5
    1.0
    """
    by = advance(total)
    for number, item in enumerate(items, start=1):
        yield item
        if number % each == 0:
            by(each)


def shares(weights: Sequence[float]) -> list[tuple[float, float]]:
    """Return what :func:`within` is to be told of parts that follow one another.

    Parameters
    ----------
    weights : sequence of float
        How long each takes, in any unit.

    Returns
    -------
    shares : list of (float, float)
        Where each begins and ends; all alike where the weights are all 0.

    Examples
    --------
    >>> shares([1, 3])
    [(0.0, 0.25), (0.25, 1.0)]
    """
    known = weights if any(weights) else [1.0] * len(weights)
    return [*pairwise(accumulate((each / sum(known) for each in known), initial=0.0))]

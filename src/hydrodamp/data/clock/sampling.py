"""A topic's values at other times: interpolated, held or turned, never across a gap."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.clock.stamps import Stamps

_CLOSE = 1e-6  # rad; below it sines are angles to all digits


@dataclass(frozen=True, eq=False)
class Ticks:
    """The times that all topics are brought to.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Increasing within each run [s].
    run : ndarray of int, shape (n,)
        The run each belongs to, from 0.
    """

    time: FloatArray
    run: IntArray


@dataclass(frozen=True, eq=False)
class Brackets:
    """Between which messages each tick lies.

    Attributes
    ----------
    messages : tuple of slice
        Where the messages of each stretch lie.
    ticks : tuple of slice
        Where the ticks of each stretch lie.
    times : tuple of (ndarray, ndarray)
        Those of messages and ticks, stretch by stretch [s].
    before : ndarray of int, shape (n,)
        The last message not after the tick; the first of its stretch where there is none.
    unknown : ndarray of bool, shape (n,), or None
        Where nothing can be interpolated: outside the messages, or in a gap between them; None
        where everything can.
    spent : ndarray of bool, shape (n,), or None
        Where no value holds any more; None where one always does.
    early : ndarray of bool, shape (n,), or None
        Where there is no message yet; None where there always is.
    """

    messages: tuple[slice, ...]
    ticks: tuple[slice, ...]
    times: tuple[tuple[FloatArray, FloatArray], ...]
    before: IntArray
    unknown: BoolArray | None
    spent: BoolArray | None
    early: BoolArray | None


def brackets(stamps: Stamps, ticks: Ticks) -> Brackets:
    """Return between which messages each tick lies.

    Parameters
    ----------
    stamps : Stamps
        The messages, their runs numbered as those of the ticks.
    ticks : Ticks
        Where values are wanted.

    Returns
    -------
    brackets : Brackets
        For :func:`interpolated`, :func:`held` and :func:`turned`.

    Examples
    --------
    >>> zeros = np.zeros(3, np.int64)
    >>> dvl = Stamps(np.arange(3), np.array([0.0, 1.0, 9.0]), zeros, 1.0, 5.0)
    >>> found = brackets(dvl, Ticks(np.array([0.5, 4.0, 9.0]), zeros))
    >>> found.before.tolist(), found.unknown.tolist()
    ([0, 1, 2], [False, True, False])
    """
    n = len(ticks.time)
    own = {number: place for number, place in parts_of(stamps.run) if number >= 0}
    pairs = [(own[number], place) for number, place in parts_of(ticks.run) if number in own]
    before = np.zeros(n, np.int64)
    unknown, spent, early = (np.ones(n, np.bool_) for _ in range(3))
    times = tuple((stamps.time[mine], ticks.time[its]) for mine, its in pairs)
    for (mine, its), (messages, wanted) in zip(pairs, times, strict=True):
        index, unknown[its], spent[its], early[its] = _within(stamps, messages, wanted)
        before[its] = index + mine.start
    masks = (mask if mask.any() else None for mask in (unknown, spent, early))
    places = tuple(one for one, _ in pairs), tuple(one for _, one in pairs)
    return Brackets(*places, times, before, *masks)


def _within(
    stamps: Stamps, messages: FloatArray, wanted: FloatArray
) -> tuple[IntArray, BoolArray, BoolArray, BoolArray]:
    """Return the message before each tick of one stretch, and where it is of no use."""
    last = len(messages) - 1
    # Faster than a binary search for each, as both are in order; rounding may reach the next.
    index = np.interp(wanted, messages, np.arange(float(len(messages)))).astype(np.int64)
    index -= (messages[index] > wanted) & (index > 0)
    since = wanted - messages[index]
    early = since < 0
    beyond = since > 0
    gaps = np.append(np.diff(messages) > stamps.limit, True)
    unknown = early | (beyond & gaps[index])
    spent = unknown & ~((index == last) & beyond & (since <= stamps.step))
    return index, unknown, spent, early


def interpolated(values: FloatArray, found: Brackets) -> FloatArray:
    """Return values between messages on a straight line.

    Parameters
    ----------
    values : ndarray, shape (m,)
        One a message, finite.
    found : Brackets
        Where the ticks lie.

    Returns
    -------
    values : ndarray, shape (n,)
        NaN where nothing is known.

    Examples
    --------
    >>> zeros = np.zeros(3, np.int64)
    >>> dvl = Stamps(np.arange(3), np.array([0.0, 1.0, 9.0]), zeros, 1.0, 5.0)
    >>> found = brackets(dvl, Ticks(np.array([0.5, 4.0, 9.0]), zeros))
    >>> interpolated(np.array([1.0, 2.0, 3.0]), found).tolist()
    [1.5, nan, 3.0]
    """
    taken = np.empty(len(found.before))
    for mine, its, (messages, wanted) in zip(found.messages, found.ticks, found.times, strict=True):
        taken[its] = np.interp(wanted, messages, values[mine])
    return _masked(taken, found.unknown)


def held(values: FloatArray, found: Brackets, *, until_next: bool = False) -> FloatArray:
    """Return the value of the last message before each tick.

    Parameters
    ----------
    values : ndarray, shape (m,)
        One a message.
    found : Brackets
        Where the ticks lie.
    until_next : bool, optional
        Whether a value holds until the next one, however long that is; else not into a gap, and
        no longer than a median step after the last.

    Returns
    -------
    values : ndarray, shape (n,)
        NaN where nothing holds.
    """
    if len(values) == 0:
        return np.full(len(found.before), np.nan)
    return _masked(values[found.before], found.early if until_next else found.spent)


def _masked(values: FloatArray, mask: BoolArray | None) -> FloatArray:
    if mask is not None:
        values[mask] = np.nan
    return values


def turned(quaternions: FloatArray, found: Brackets) -> FloatArray:
    """Return attitudes between messages, turned at a constant rate.

    Parameters
    ----------
    quaternions : ndarray, shape (m, 4)
        Unit quaternions, one a message; either sign.
    found : Brackets
        Where the ticks lie.

    Returns
    -------
    quaternions : ndarray, shape (n, 4)
        Spherical linear interpolation (Shoemake 1985) the shorter way round; NaN where nothing is
        known.
    """
    if len(quaternions) == 0:
        return np.full((len(found.before), 4), np.nan)
    after = np.minimum(found.before + 1, len(quaternions) - 1)
    share = interpolated(np.arange(float(len(quaternions))), found) - found.before
    first, second = quaternions[found.before], quaternions[after]
    cosine = np.einsum("ni,ni->n", first, second)
    second *= np.where(cosine < 0, -1.0, 1.0)[:, np.newaxis]
    np.abs(cosine, out=cosine)
    angle = np.arccos(np.minimum(cosine, 1.0))
    sine = np.sin(angle)
    # Where both are nearly the same the turn is a straight line.
    close = sine < _CLOSE
    sine[close] = 1.0
    near = np.where(close, 1 - share, np.sin((1 - share) * angle) / sine)
    far = np.where(close, share, np.sin(share * angle) / sine)
    first *= near[:, np.newaxis]
    second *= far[:, np.newaxis]
    first += second
    return first


def parts_of(run: IntArray) -> list[tuple[int, slice]]:
    """Return every run of consecutive equal numbers and where it lies.

    Parameters
    ----------
    run : ndarray of int, shape (n,)
        A number for every message.

    Returns
    -------
    parts : list of (int, slice)
        In order.

    Examples
    --------
    >>> parts_of(np.array([0, 0, 1]))
    [(0, slice(0, 2, None)), (1, slice(2, 3, None))]
    """
    if len(run) == 0:
        return []
    edges = [0, *(np.flatnonzero(np.diff(run)) + 1).tolist(), len(run)]
    return [(int(run[a]), slice(a, b)) for a, b in itertools.pairwise(edges)]

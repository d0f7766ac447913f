"""Dropouts of sensors taken out: bridged where the gap is short, cut where it is long."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import between
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import BLOCKS
from hydrodamp.data.log import Log, take
from hydrodamp.data.record import Segment, longest_step
from hydrodamp.errors import LogError

#: How the channel of the quaternions is called.
ATTITUDE = "attitude"

_SENSED = [
    (block.name, place, name)
    for block in BLOCKS
    if block.is_sensed
    for place, name in enumerate(block.columns)
]


class _Gaps(NamedTuple):
    """The good samples about every sample of a channel."""

    before: IntArray
    after: IntArray
    share: FloatArray  # of the way from one to the other
    bridged: BoolArray
    cut: BoolArray


def measured(log: Log) -> dict[str, FloatArray]:
    """Return what sensors wrote, column by column, without attitude and commands."""
    sensed = {name for _, _, name in _SENSED}
    return {name: values for name, values in columns_of(log).items() if name in sensed}


def without_samples(
    log: Log, lost: Mapping[str, BoolArray], reason: str, longest: float | None = None
) -> Log:
    """Return a log without some samples of some channels, with a note on each channel."""
    joins = np.zeros(log.n, dtype=np.bool_)
    joins[log.bounds[:, 0]] = True
    span = longest_step(log.time, joins) if longest is None else longest
    gaps = {name: _gaps(log, rows, span) for name, rows in lost.items() if rows.any()}
    if not gaps:
        return log
    notes = [
        counted(reason, name, int(rows.sum()), log.n, done)
        for name, one in gaps.items()
        for rows, done in ((one.bridged, "interpolated"), (one.cut, "cut out"))
        if rows.any()
    ]
    cut = np.logical_or.reduce([one.cut for one in gaps.values()])
    return _without_rows(_bridged(log, gaps), cut, reason).noted(*notes)


def runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Return the first and one-past-last place of each run of true ones."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def counted(reason: str, channel: str, samples: int, of: int, done: str) -> str:
    """Return the sentence on samples of a channel and what became of them."""
    share = f"{100 * samples / of:.2g} %"
    return f"{reason}: {samples} of {of} samples of `{channel}` ({share}) {done}"


def _gaps(log: Log, lost: BoolArray, longest: float) -> _Gaps:
    index = np.arange(log.n)
    before = np.maximum.accumulate(np.where(lost, -1, index))
    after = np.minimum.accumulate(np.where(lost, log.n, index)[::-1])[::-1]
    inside = (before >= 0) & (after < log.n)
    before, after = np.maximum(before, 0), np.minimum(after, log.n - 1)
    segment = np.repeat(np.arange(len(log.segments)), np.diff(log.bounds, axis=1).ravel())
    near = inside & (segment[before] == segment) & (segment[after] == segment)
    span = log.time[after] - log.time[before]
    bridged = lost & near & (span <= longest * (1 + 1e-9))
    share = np.divide(log.time - log.time[before], span, out=np.zeros(log.n), where=bridged)
    return _Gaps(before, after, share, bridged, lost & ~bridged)


def _bridged(log: Log, gaps: Mapping[str, _Gaps]) -> Log:
    blocks: dict[str, Any] = {}
    for block, place, name in _SENSED:
        if name in gaps:
            column = blocks.setdefault(block, getattr(log, block).copy())[:, place]
            one, rows = gaps[name], gaps[name].bridged
            first, last = column[one.before[rows]], column[one.after[rows]]
            column[rows] = first + one.share[rows] * (last - first)
    if ATTITUDE in gaps and log.attitude is not None:
        one, rows = gaps[ATTITUDE], gaps[ATTITUDE].bridged
        first, last = log.attitude[one.before[rows]], log.attitude[one.after[rows]]
        blocks[ATTITUDE] = log.attitude.copy()
        blocks[ATTITUDE][rows] = between(first, last, one.share[rows])
    return dataclasses.replace(log, **blocks)


def _without_rows(log: Log, cut: BoolArray, reason: str) -> Log:
    """Leave out samples; each segment falls into the pieces between them."""
    if not cut.any():
        return log
    pieces = [piece for part in log.segments for piece in _pieces(part, cut)]
    if not pieces:
        fault = f"{reason}: no two neighbouring samples are left; all {log.n} were to be taken out"
        raise LogError(fault, source=log.source)
    return take(log, pieces)


def _pieces(part: Segment, cut: BoolArray) -> Iterator[Segment]:
    """Yield what is left of a segment, numbered where there are several."""
    spans = [(a, b) for a, b in runs(~cut[part.start : part.stop]) if b - a >= 2]
    for number, (start, stop) in enumerate(spans, start=1):
        name = part.name if len(spans) == 1 else f"{part.name}.{number}"
        yield Segment(name, part.start + start, part.start + stop)


_TIMES_USUAL = 3.0
_USUAL = 0.9  # quantile of the lengths of a channel's runs
_LEAST_STEPS = 3
_MOVING = 0.5  # of the steps of a run, on which something else must change


def mask_frozen(log: Log, *, seconds: float = 1.0) -> Log:
    """Take out what a frozen velocity sensor repeats.

    Parameters
    ----------
    log : Log
        Any log.
    seconds : float, optional
        No run of one value up to this long is taken for frozen [s].

    Returns
    -------
    log : Log
        The first sample of a run is kept. A velocity that never changes at all is left
        alone: :func:`~hydrodamp.conditioning.suspicions.suspicions` reports it.

    Examples
    --------
    >>> time = np.arange(0.0, 10.0, 0.1)
    >>> surge, rate = np.sin(time), np.cos(time)
    >>> surge[40:60] = surge[40]
    >>> mask_frozen(Log.from_arrays(time, {"u": surge, "r": rate})).notes
    ('frozen: 19 of 100 samples of `u` (19 %) cut out',)
    """
    columns = measured(log)
    velocities = {name: columns[name] for name in log.velocity_names}
    steady = {name: _steady(values, log.bounds) for name, values in velocities.items()}
    others = [] if log.attitude is None else [_steady(log.attitude, log.bounds)]
    lost = {}
    for name, values in velocities.items():
        rest = [same for other, same in steady.items() if other != name] + others
        moving = ~np.logical_and.reduce(rest) if rest else np.zeros(log.n, dtype=np.bool_)
        lost[name] = _frozen(log, values, steady[name], moving, seconds)
    return without_samples(log, lost, "frozen")


def _steady(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Tell which samples repeat the one before in the same segment."""
    flat = values.reshape(len(values), -1)
    same = np.zeros(len(values), dtype=np.bool_)
    same[1:] = (flat[1:] == flat[:-1]).all(axis=1)
    same[bounds[:, 0]] = False
    return same


def _frozen(
    log: Log, values: FloatArray, same: BoolArray, moving: BoolArray, seconds: float
) -> BoolArray:
    first = np.flatnonzero(~same)  # of each run of one value
    last = np.append(first[1:], log.n) - 1
    lasted = log.time[last] - log.time[first]
    found = np.zeros(log.n, dtype=np.bool_)
    if len(first) <= len(log.segments):  # one run a segment: it never changes
        return found
    limit = max(seconds, _TIMES_USUAL * float(np.quantile(lasted, _USUAL)))
    steps = last - first
    count = np.concatenate(([0], np.cumsum(moving)))
    moved = count[last + 1] - count[first + 1]
    long = (lasted > limit) & (steps >= _LEAST_STEPS) & (values[first] != 0.0)
    for run in np.flatnonzero(long & (moved >= _MOVING * steps)).tolist():
        found[first[run] + 1 : last[run] + 1] = True
    return found


#: Velocities that stand for none [m/s]: the ends of a 16-bit count of mm/s.
SENTINELS = (-32.768, 32.768, 32.767, -32.767)

_NEAR = 1e-6  # m/s, about a sentinel
_LINEAR = ("u", "v", "w")
_BREAK = 0.1  # m/s; from this speed no vehicle stands still within a sample


def mask_bottom_lock(log: Log, *, flag: str | None = None, fastest: float = 30.0) -> Log:
    """Take out linear velocities that were written without bottom lock.

    Parameters
    ----------
    log : Log
        Any log.
    flag : str, optional
        A command channel that is zero where the velocity is not good.
    fastest : float, optional
        Size of a velocity that no craft of this log reaches [m/s]; where most do, their
        unit is to blame, and they stay.

    Returns
    -------
    log : Log
        Without the samples that are :data:`SENTINELS`, too fast, flagged, or zero in all
        linear velocities at once between samples under way.

    Raises
    ------
    LogError
        If there is no such flag, or nothing is left.

    Examples
    --------
    >>> log = Log.from_arrays(np.arange(6) / 5, {"u": [1, 1, 1, -32.768, 1, 1]})
    >>> mask_bottom_lock(log).velocity[:, 0].tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    linear = {name: one for name, one in measured(log).items() if name in _LINEAR}
    if not linear:
        return log
    values = np.column_stack([*linear.values()])
    usual = float(np.median(np.abs(values).max(axis=1)))
    lost = lost_lock(values, fastest if usual <= fastest else np.inf).any(axis=1)
    lost |= _dropped_to_zero(values, log.bounds)
    if flag is not None:
        lost |= log.command(flag) == 0.0
    return without_samples(log, dict.fromkeys(linear, lost), "no bottom lock")


def lost_lock(values: FloatArray, fastest: float = 30.0) -> BoolArray:
    """Return which numbers of a velocity sensor stand for none."""
    sentinel = np.abs(values[..., np.newaxis] - np.array(SENTINELS)).min(axis=-1) < _NEAR
    return np.asarray(sentinel | ~(np.abs(values) <= fastest))


def _dropped_to_zero(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Return zeros in two or more velocities at once that begin and end with a jump."""
    found = np.zeros(len(values), dtype=np.bool_)
    if values.shape[1] < 2:
        return found
    speed = np.linalg.norm(values, axis=1)
    for start, stop in bounds.tolist():
        part = speed[start:stop]
        for a, b in runs(part == 0.0):
            inside = a > 0 and b < len(part)
            found[start + a : start + b] = inside and min(part[a - 1], part[b]) > _BREAK
    return found

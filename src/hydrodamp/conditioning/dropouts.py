"""Dropouts: what a frozen sensor repeats, or a Doppler log wrote without seeing the bottom."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.gaps import measured, runs, without_samples
from hydrodamp.data.log import Log

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
    columns = measured(log)
    linear = [columns[name] for name in _LINEAR if name in log.velocity_names]
    if not linear:
        return log
    values = np.column_stack(linear)
    usual = float(np.median(np.abs(values).max(axis=1)))
    lost = lost_lock(values, fastest if usual <= fastest else np.inf).any(axis=1)
    lost |= _dropped_to_zero(values, log.bounds)
    if flag is not None:
        lost |= log.command(flag) == 0.0
    names = (name for name in _LINEAR if name in log.velocity_names)
    return without_samples(log, dict.fromkeys(names, lost), "no bottom lock")


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

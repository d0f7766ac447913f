"""Velocities that a Doppler log wrote without seeing the bottom (or the water)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.gaps import measured, without_samples
from hydrodamp.data.log import Log

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
    lost = lost_lock(values, fastest if usual <= fastest else np.inf)
    lost |= _dropped_to_zero(values, log.bounds)
    if flag is not None:
        lost |= log.command(flag) == 0.0
    names = (name for name in _LINEAR if name in log.velocity_names)
    return without_samples(log, dict.fromkeys(names, lost), "no bottom lock")


def lost_lock(values: npt.ArrayLike, fastest: float = 30.0) -> BoolArray:
    """Return which samples of a velocity sensor stand for none."""
    array: FloatArray = np.asarray(values, dtype=np.float64)
    flat = array.reshape(len(array), -1)
    sentinel = np.abs(flat[..., np.newaxis] - np.array(SENTINELS)).min(axis=-1) < _NEAR
    lost: BoolArray = (sentinel | ~(np.abs(flat) <= fastest)).any(axis=1)
    return lost


def _dropped_to_zero(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Return zeros in two or more velocities at once that begin and end with a jump."""
    found = np.zeros(len(values), dtype=np.bool_)
    if values.shape[1] < 2:
        return found
    speed = np.linalg.norm(values, axis=1)
    for start, stop in bounds.tolist():
        part = speed[start:stop]
        zero = np.concatenate(([False], part == 0.0, [False]))
        edges = np.flatnonzero(zero[1:] != zero[:-1])
        first, last = edges[::2], edges[1::2]  # one past the last
        inside = (first > 0) & (last < len(part))
        first, last = first[inside], last[inside]
        jumps = (part[first - 1] > _BREAK) & (part[last] > _BREAK)
        for a, b in zip(first[jumps].tolist(), last[jumps].tolist(), strict=True):
            found[start + a : start + b] = True
    return found

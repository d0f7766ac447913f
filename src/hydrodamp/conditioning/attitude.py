"""Attitude that leaps there and back: wraps that were averaged, and other false samples."""

from __future__ import annotations

import dataclasses

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.gaps import ATTITUDE, counted, without_samples
from hydrodamp.conditioning.spikes import off_the_line, standing_out
from hydrodamp.data.attitude import turn
from hydrodamp.data.log import Log

#: A turn there and back that is smaller is left to the noise [rad].
LEAST_LEAP = np.radians(2.0)


def steady_attitude(log: Log, *, window: int = 7, threshold: float = 6.0) -> Log:
    """Take out samples of attitude that leap there and back, and make signs continuous.

    Parameters
    ----------
    log : Log
        Any log; without an attitude it is left alone.
    window : int, optional
        Samples compared, odd.
    threshold : float, optional
        Robust standard deviations of the turn from the window's middle; two degrees are
        allowed in any case.

    Returns
    -------
    log : Log
        Leaps are interpolated along the shorter turn.

    Examples
    --------
    >>> from hydrodamp.data.attitude import quaternion_from_euler
    >>> yaw = np.radians([178.0, 178.5, 179.0, 179.5, 0.0, -179.5, -179.0, -178.5, -178.0])
    >>> attitude = quaternion_from_euler(np.outer(yaw, (0, 0, 1)))
    >>> log = Log.from_arrays(np.arange(9) / 10, {"r": np.full(9, 0.0873)}, attitude=attitude)
    >>> np.degrees(2 * np.arcsin(steady_attitude(log).attitude[4, 3])).item()
    180.0
    """
    if log.attitude is None:
        return log
    found = leaps(log.time, log.attitude, log.bounds, window=window, threshold=threshold)
    made = without_samples(log, {ATTITUDE: found}, "attitude leaps")
    attitude = made.attitude
    assert attitude is not None
    followed = following(attitude, made.bounds)
    flipped = np.any(followed != attitude, axis=1)
    if not flipped.any():
        return made
    jumps = int(np.count_nonzero(flipped[1:] != flipped[:-1]))
    note = counted("quaternion signs", ATTITUDE, jumps, made.n, "changed sign, made continuous")
    return dataclasses.replace(made, attitude=followed).noted(note)


def following(attitude: FloatArray, bounds: IntArray) -> FloatArray:
    """Return the same attitudes with continuous signs within each segment."""
    along = np.sum(attitude[1:] * attitude[:-1], axis=1)
    sign = np.concatenate(([1.0], np.where(along < 0, -1.0, 1.0)))
    sign[bounds[:, 0]] = 1.0
    product = np.cumprod(sign)
    # What the segments before have gathered is taken back.
    start = np.repeat(product[bounds[:, 0]], bounds[:, 1] - bounds[:, 0])
    return attitude * (product * start)[:, np.newaxis]


def leaps(
    time: FloatArray,
    attitude: FloatArray,
    bounds: IntArray,
    *,
    window: int = 7,
    threshold: float = 6.0,
) -> BoolArray:
    """Return which samples of attitude leap there and back."""
    few = np.zeros(len(attitude), dtype=np.bool_)
    for start, stop in bounds.tolist():
        few[start:stop] = _jolts(attitude[start:stop]) > LEAST_LEAP / 2
    return standing_out(time, attitude, bounds, few, _off_turn, window, threshold, LEAST_LEAP)


def _jolts(attitude: FloatArray) -> FloatArray:
    """Return how much the turn from sample to sample changes at each one [rad]."""
    steps = turn(attitude[:-1], attitude[1:])
    change = np.linalg.norm(np.diff(steps, axis=0), axis=1)
    size = np.linalg.norm(steps[1:], axis=1)
    return np.concatenate(([np.inf], np.where(size > 1.0, size, change), [np.inf]))


def _off_turn(time: FloatArray, around: FloatArray) -> FloatArray:
    """Return how far samples are off the steady turn of their window."""
    along = np.abs(np.einsum("nkj,nlj->nkl", around, around))
    central = np.median(along, axis=2).argmax(axis=1)
    origin = np.repeat(around[np.arange(len(around)), central], around.shape[1], axis=0)
    turns = turn(origin, around.reshape(-1, 4)).reshape(*around.shape[:2], 3)
    return np.sqrt(sum(off_the_line(time, turns[:, :, axis]) ** 2 for axis in range(3)))

"""Ratios of two channels that should measure the same motion."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.attitude import rotation
from hydrodamp.data.log import Log

LEAST_AGREEMENT = 0.8
"""Correlation below which two channels do not measure the same motion."""

_WINDOW = 5.0  # s, over which ways are compared: long against the noise of a position
_LEAST_PAIRS = 8
_LEAST_PART = 1e-4  # of the way, that a velocity must have; one in km/s beside others in m/s has
_TINY = 1e-9  # of any unit; less is no motion


def rate_ratio(time: FloatArray, angle: FloatArray, rate: FloatArray, bounds: IntArray) -> float:
    """Return how many times faster an angle turns than a recorded rate says."""
    inner = _inner_steps(bounds, len(time))
    difference = np.diff(angle)
    wrapped = difference - 2 * np.pi * np.round(difference / (2 * np.pi))
    slope = np.divide(wrapped, np.diff(time), out=np.zeros(len(time) - 1), where=inner)
    mean = (rate[1:] + rate[:-1]) / 2
    return _ratio(slope[inner], mean[inner])


def path_ratio(log: Log) -> float:
    """Return how many times longer the way of the velocity is than that of the position."""
    if log.position is None or log.attitude is None:
        return float("nan")
    made, gone = _ways(log)
    return _ratio(made.sum(axis=2).ravel(), gone.ravel())


def axis_ratios(log: Log) -> FloatArray:
    """Return how many times longer the way of each velocity is than its part of the position's."""
    ratios = np.full(3, np.nan)
    if log.position is None or log.attitude is None:
        return ratios
    made, gone = _ways(log)
    ways, way = made.reshape(-1, 3), gone.ravel()
    sizes = np.linalg.norm(ways, axis=0)
    there = np.flatnonzero(sizes > _LEAST_PART * np.linalg.norm(sizes))
    shares = np.zeros(3)
    shares[there] = np.linalg.lstsq(ways[:, there] / sizes[there], way)[0] / sizes[there]
    for axis in there.tolist():
        rest = way - ways @ shares + ways[:, axis] * shares[axis]
        ratios[axis] = _ratio(ways[:, axis], rest)
    return ratios


def _ways(log: Log) -> tuple[FloatArray, FloatArray]:
    """Return ways of some seconds: (m, 3, 3) made along u v w, in the world, and (m, 3) gone."""
    assert log.attitude is not None
    assert log.position is not None
    world = rotation(log.attitude) * log.velocity[:, np.newaxis, :3]
    made, gone = [], []
    for start, stop in log.bounds.tolist():
        time, place = log.time[start:stop], log.position[start:stop]
        mean = (world[start + 1 : stop] + world[start : stop - 1]) / 2
        steps = np.diff(time)[:, np.newaxis, np.newaxis] * mean
        way = np.concatenate((np.zeros((1, 3, 3)), np.cumsum(steps, axis=0)))
        first = np.arange(stop - start)
        last = np.minimum(np.searchsorted(time, time + _WINDOW), stop - start - 1)
        first, last = first[last > first], last[last > first]
        made.append(way[last] - way[first])
        gone.append(place[last] - place[first])
    return np.concatenate(made), np.concatenate(gone)


def _inner_steps(bounds: IntArray, n: int) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Tell which steps lie within a segment."""
    inner = np.ones(n - 1, dtype=np.bool_)
    inner[bounds[1:, 0] - 1] = False
    return inner


def _ratio(first: FloatArray, second: FloatArray) -> float:
    """Return the size of one against another, with the sign of their correlation."""
    one, other = float(np.linalg.norm(first)), float(np.linalg.norm(second))
    if len(first) < _LEAST_PAIRS or min(one, other) < _TINY:
        return float("nan")
    agreement = float((first / one) @ (second / other))
    return float(np.sign(agreement)) * one / other if abs(agreement) > LEAST_AGREEMENT else np.nan

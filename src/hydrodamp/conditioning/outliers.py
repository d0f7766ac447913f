"""Spikes of channels and leaps of attitude: samples far off their neighbours, by Hampel's rule."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, mad_std
from hydrodamp.conditioning.gaps import ATTITUDE, remove_samples, sensor_columns
from hydrodamp.data.attitude import rotation_vectors
from hydrodamp.data.channels import ACCELERATION
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, no_such

#: Clocks and values of windows, shape (m, w, ...) -> how far off each sample is, shape (m, w).
DeviationFunction = Callable[[FloatArray, FloatArray], FloatArray]

#: Samples compared, and as many as must be there. A third of them side by side is the most that
#: can be told from motion.
_WINDOW_SAMPLES, _MIN_SAMPLES = 7, 5

_ROUNDING_SHARE = 1e-9  # of the largest value; less is no distance
_MIN_FLICKER_SHARE = 0.02  # share of samples off their line from which a coarse sensor flickers
_NEGLIGIBLE_SHARE = 0.01  # of the range of most values
_MAX_SPREAD_SAMPLES = 20000  # samples at which the usual spread is taken, about
_CHUNK_ROWS = 16384


def remove_outliers(log: Log, *, names: Sequence[str] | None = None, threshold: float = 6.0) -> Log:
    """Interpolate over single samples, or a few, that stand out of their neighbours.

    Parameters
    ----------
    log : Log
        Any log; nothing is compared across a join.
    names : sequence of str, optional
        Channels to look at; where not given all that were measured but accelerations.
        These and commands may jump; commands are never touched.
    threshold : float, optional
        Robust standard deviations from the median. At six, white noise has a spike in some
        ten million samples.

    Returns
    -------
    log : Log
        Spikes are interpolated; at the edge of a segment they are cut out. Its notes count them.

    Raises
    ------
    LogError
        If a channel is unknown or a setting cannot be.

    Examples
    --------
    >>> surge = np.sin(np.arange(50.0) / 9)
    >>> surge[20] += 5
    >>> remove_outliers(Log.from_arrays(np.arange(50.0), {"u": surge})).notes
    ('spikes: 1 of 50 samples of `u` (2 %) interpolated',)
    """
    if not threshold > 0:
        raise LogError(f"`threshold` must be positive; got {threshold:g}", source=log.source)
    columns = sensor_columns(log)
    for name in names or ():
        if name not in columns:
            raise LogError(no_such("measured channel", name, columns), source=log.source)
    usual = [name for name in columns if name not in ACCELERATION.columns]
    lost = {
        name: find_outliers(log, columns[name], threshold)
        for name in (usual if names is None else names)
    }
    return remove_samples(log, lost, "spikes")


def find_outliers(log: Log, values: FloatArray, threshold: float = 6.0) -> BoolArray:
    """Return which samples of a channel are spikes."""
    from scipy.ndimage import median_filter  # takes long to import

    # The segment is mirrored at its ends.
    parts = [
        median_filter(values[a:b], size=_WINDOW_SAMPLES, mode="mirror")
        for a, b in log.bounds.tolist()
    ]
    distance = np.abs(values - np.concatenate(parts))
    low, high = np.quantile(values, (0.05, 0.95))
    small = _NEGLIGIBLE_SHARE * float(
        high - low
    )  # too small to matter, of motion without noise above all
    least = max(threshold * _typical_deviation(log, values), small, _rounding_error(values))
    found = np.zeros(log.n, dtype=np.bool_)
    for rows, own, spread in _window_deviations(
        log, values, distance > least, _deviation_from_line
    ):
        found[rows] = own > np.maximum(threshold * spread, least)
    return found


def _window_deviations(
    log: Log, values: FloatArray, candidates: BoolArray, off: DeviationFunction
) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield candidates, how far each is off its window, and how far most about it."""
    for start, stop in log.bounds.tolist():
        width = min(_WINDOW_SAMPLES, stop - start)
        rows = np.flatnonzero(candidates[start:stop] & (stop - start >= _MIN_SAMPLES))
        for low in range(0, len(rows), _CHUNK_ROWS):
            part = start + rows[low : low + _CHUNK_ROWS]
            first = np.clip(part - width // 2, start, stop - width)
            around = first[:, np.newaxis] + np.arange(width)
            rest = off(log.time[around], values[around])
            yield part, rest[np.arange(len(part)), part - first], mad_std(rest, axis=1)


def _deviation_from_line(time: FloatArray, around: FloatArray) -> FloatArray:
    """Return how far samples are off the line through their window."""
    width = around.shape[1]
    others = np.array([[k for k in range(width) if k != own] for own in range(width)])
    rise = around[:, others] - around[:, :, np.newaxis]
    run = time[:, others] - time[:, :, np.newaxis]
    slope = np.median(np.median(rise / run, axis=2), axis=1)
    level = around - slope[:, np.newaxis] * (time - time[:, :1])
    return np.abs(level - np.median(level, axis=1, keepdims=True))


def _typical_deviation(log: Log, values: FloatArray) -> float:
    """Return the usual spread; of a coarse sensor, which mostly stands still, its flicker."""
    some = np.zeros(log.n, dtype=np.bool_)
    for start, stop in log.bounds.tolist():
        some[start : stop : -(-log.n // _MAX_SPREAD_SAMPLES)] = True
    parts = [own for _, own, _ in _window_deviations(log, values, some, _deviation_from_line)]
    rest = np.concatenate(parts) if parts else np.zeros(1)
    moved = rest > _rounding_error(values)
    flickers = np.median(rest) <= _rounding_error(values) and np.mean(moved) > _MIN_FLICKER_SHARE
    return float(mad_std(rest[moved] if flickers else rest))


def _rounding_error(values: FloatArray) -> float:
    return _ROUNDING_SHARE * float(np.abs(values).max(initial=0.0))


#: A turn there and back that is smaller is left to the noise [rad].
_MIN_ATTITUDE_JUMP = np.radians(2.0)


def remove_attitude_outliers(log: Log, *, threshold: float = 6.0) -> Log:
    """Take out samples of attitude that leap there and back.

    Parameters
    ----------
    log : Log
        Any log; without an attitude it is left alone.
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
    >>> np.degrees(2 * np.arcsin(remove_attitude_outliers(log).attitude[4, 3])).item()
    180.0
    """
    return remove_samples(log, {ATTITUDE: find_attitude_outliers(log, threshold)}, "attitude leaps")


def find_attitude_outliers(log: Log, threshold: float = 6.0) -> BoolArray:
    """Return which samples of attitude leap there and back."""
    few, found = np.zeros((2, log.n), dtype=np.bool_)
    if log.attitude is None:
        return found
    for start, stop in log.bounds.tolist():
        few[start:stop] = _rotation_changes(log.attitude[start:stop]) > _MIN_ATTITUDE_JUMP / 2
    for rows, own, spread in _window_deviations(log, log.attitude, few, _deviation_from_rotation):
        found[rows] = own > np.maximum(threshold * spread, _MIN_ATTITUDE_JUMP)
    return found


def _rotation_changes(attitude: FloatArray) -> FloatArray:
    """Return how much the turn from sample to sample changes at each one [rad]."""
    steps = rotation_vectors(attitude[:-1], attitude[1:])
    change = np.linalg.norm(np.diff(steps, axis=0), axis=1)
    size = np.linalg.norm(steps[1:], axis=1)
    return np.concatenate(([np.inf], np.where(size > 1.0, size, change), [np.inf]))


def _deviation_from_rotation(time: FloatArray, around: FloatArray) -> FloatArray:
    """Return how far samples are off the steady turn of their window."""
    along = np.abs(np.einsum("nkj,nlj->nkl", around, around))
    central = np.median(along, axis=2).argmax(axis=1)
    origin = np.repeat(around[np.arange(len(around)), central], around.shape[1], axis=0)
    turns = rotation_vectors(origin, around.reshape(-1, 4)).reshape(*around.shape[:2], 3)
    return np.sqrt(sum(_deviation_from_line(time, turns[:, :, axis]) ** 2 for axis in range(3)))

"""Outliers of channels and attitude, by a Hampel filter about a local Theil-Sen line."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, mad_std
from hydrodamp.conditioning.dropouts import ATTITUDE, remove_samples, sensor_columns
from hydrodamp.data.attitude import rotation_vectors
from hydrodamp.data.channels import ACCELERATION
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, no_such

#: Times and values of windows, shape (m, w, ...) -> deviation of each sample, shape (m, w).
DeviationFunction = Callable[[FloatArray, FloatArray], FloatArray]

#: Window length and least number of samples. Up to a third of a window can be outliers.
_WINDOW_SAMPLES, _MIN_SAMPLES = 7, 5

_ROUNDING_SHARE = 1e-9  # of the largest value; rounding error
_MIN_FLICKER_SHARE = 0.02  # share of nonzero deviations from which a coarse sensor flickers
_NEGLIGIBLE_SHARE = 0.01  # of the 5-95 % range
_MAX_SPREAD_SAMPLES = 20000  # samples for the typical deviation, about
_CHUNK_ROWS = 16384
_USUAL_SHARE = 0.9  # of the rotations from sample to sample


def remove_outliers(log: Log, *, names: Sequence[str] | None = None, threshold: float = 6.0) -> Log:
    """Interpolate outliers: single samples, or a few, far from adjacent samples.

    Parameters
    ----------
    log : Log
        Any log; segments are filtered separately.
    names : sequence of str, optional
        Channels to filter; default: all measured channels except accelerations, which may
        jump. Commands are never changed.
    threshold : float, optional
        Robust standard deviations from the median. At six, white noise has a false outlier
        in some ten million samples.

    Returns
    -------
    log : Log
        Outliers are interpolated, at segment edges cut. Its notes count them.

    Raises
    ------
    LogError
        If a channel is unknown or a setting is invalid.

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
    default = [name for name in columns if name not in ACCELERATION.columns]
    masks = {
        name: find_outliers(log, columns[name], threshold)
        for name in (default if names is None else names)
    }
    return remove_samples(log, masks, "spikes")


def find_outliers(log: Log, values: FloatArray, threshold: float = 6.0) -> BoolArray:
    """Return which samples of a channel are outliers."""
    from scipy.ndimage import median_filter  # takes long to import

    # The segment is mirrored at its ends.
    segments = [values[a:b] for a, b in log.bounds.tolist()]
    medians = [median_filter(item, size=_WINDOW_SAMPLES, mode="mirror") for item in segments]
    distance = np.abs(values - np.concatenate(medians))
    low, high = np.quantile(values, (0.05, 0.95))
    negligible = max(_NEGLIGIBLE_SHARE * float(high - low), _rounding_error(values))
    limit = max(threshold * _typical_deviation(log, values), negligible)
    return _outlying(log, values, distance > limit, _deviation_from_line, (threshold, limit))


def _outlying(
    log: Log,
    values: FloatArray,
    candidates: BoolArray,
    deviation_of: DeviationFunction,
    limits: tuple[float, float],
) -> BoolArray:
    """Return which candidates deviate by more than a relative and an absolute limit."""
    mask = np.zeros(log.n, dtype=np.bool_)
    windows = _window_deviations(log, values, candidates, deviation_of)
    for rows, deviation, spread in windows:
        mask[rows] = deviation > np.maximum(limits[0] * spread, limits[1])
    return mask


def _window_deviations(
    log: Log, values: FloatArray, candidates: BoolArray, deviation_of: DeviationFunction
) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield candidate rows, their deviations and the robust scale of their windows."""
    for start, stop in log.bounds.tolist():
        width = min(_WINDOW_SAMPLES, stop - start)
        rows = np.flatnonzero(candidates[start:stop] & (stop - start >= _MIN_SAMPLES))
        for low in range(0, len(rows), _CHUNK_ROWS):
            centres = start + rows[low : low + _CHUNK_ROWS]
            first = np.clip(centres - width // 2, start, stop - width)
            window = first[:, np.newaxis] + np.arange(width)
            deviations = deviation_of(log.time[window], values[window])
            at_centre = deviations[np.arange(len(centres)), centres - first]
            yield centres, at_centre, mad_std(deviations, axis=1)


def _deviation_from_line(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return the deviation of samples from the Theil-Sen line of their window."""
    width = values.shape[1]
    pairs = np.array([[k for k in range(width) if k != index] for index in range(width)])
    rise = values[:, pairs] - values[:, :, np.newaxis]
    run = time[:, pairs] - time[:, :, np.newaxis]
    slope = np.median(np.median(rise / run, axis=2), axis=1)
    level = values - slope[:, np.newaxis] * (time - time[:, :1])
    return np.abs(level - np.median(level, axis=1, keepdims=True))


def _typical_deviation(log: Log, values: FloatArray) -> float:
    """Return the robust scale of deviations; for a coarse sensor that of nonzero deviations."""
    sampled = np.zeros(log.n, dtype=np.bool_)
    for start, stop in log.bounds.tolist():
        sampled[start : stop : -(-log.n // _MAX_SPREAD_SAMPLES)] = True
    windows = _window_deviations(log, values, sampled, _deviation_from_line)
    deviations = np.concatenate([np.empty(0), *(deviation for _, deviation, _ in windows)])
    if not len(deviations):
        return 0.0
    nonzero = deviations > (rounding := _rounding_error(values))
    flickers = np.median(deviations) <= rounding and np.mean(nonzero) > _MIN_FLICKER_SHARE
    return float(mad_std(deviations[nonzero] if flickers else deviations))


def _rounding_error(values: FloatArray) -> float:
    return _ROUNDING_SHARE * float(np.abs(values).max(initial=0.0))


#: Smaller attitude jumps are regarded as noise [rad].
_MIN_ATTITUDE_JUMP = np.radians(2.0)


def remove_attitude_outliers(log: Log, *, threshold: float = 6.0) -> Log:
    """Remove attitude samples that jump away and back.

    Parameters
    ----------
    log : Log
        Any log; without an attitude it is returned unchanged.
    threshold : float, optional
        Robust standard deviations of the rotation from the centre of the window; rotations
        below two degrees are never removed.

    Returns
    -------
    log : Log
        Outliers are interpolated along the shorter rotation.

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
    """Return which attitude samples jump away and back, single ones or several in between."""
    candidates = np.zeros(log.n, dtype=np.bool_)
    if log.attitude is None:
        return candidates
    for start, stop in log.bounds.tolist():
        changes = _rotation_changes(log.attitude[start:stop])
        candidates[start:stop] = changes > _MIN_ATTITUDE_JUMP / 2
    limits = threshold, _MIN_ATTITUDE_JUMP
    outliers = _outlying(log, log.attitude, candidates, _deviation_from_rotation, limits)
    return outliers | _find_excursions(log, log.attitude, threshold)


def _find_excursions(log: Log, attitude: FloatArray, threshold: float) -> BoolArray:
    """Return the samples between a leap of the attitude and the leaps that bring it back."""
    mask = np.zeros(log.n, dtype=np.bool_)
    turns = np.linalg.norm(rotation_vectors(attitude[:-1], attitude[1:]), axis=1)
    turns[log.bounds[1:, 0] - 1] = 0.0
    moving = turns[turns > 0.0]  # a sensor slower than the clock repeats its values
    usual = float(np.quantile(moving, _USUAL_SHARE)) if len(moving) else 0.0
    usual = max(usual, _MIN_ATTITUDE_JUMP / threshold)
    padded = np.pad(turns, 1)
    adjacent = np.maximum(np.maximum(padded[:-2], padded[2:]), usual)  # a turn begins gradually
    leaps = np.flatnonzero(turns > threshold * adjacent).tolist()
    first = -1
    for number, leap in enumerate(leaps):
        if leap < first:
            continue
        for end in leaps[number + 1 :]:
            if (end - leap) * usual > 1.0:  # longer than a turn by one radian
                break
            turn = np.linalg.norm(rotation_vectors(attitude[[leap]], attitude[[end + 1]]))
            if turn < min(turns[leap], turns[end], 0.5 * threshold * usual * (end + 1 - leap)):
                mask[leap + 1 : end + 1] = True
                first = end + 1
                break
    return mask


def _rotation_changes(attitude: FloatArray) -> FloatArray:
    """Return the change of the sample-to-sample rotation at each sample [rad]."""
    steps = rotation_vectors(attitude[:-1], attitude[1:])
    change = np.linalg.norm(np.diff(steps, axis=0), axis=1)
    size = np.linalg.norm(steps[1:], axis=1)
    return np.concatenate(([np.inf], np.where(size > 1.0, size, change), [np.inf]))


def _deviation_from_rotation(time: FloatArray, attitudes: FloatArray) -> FloatArray:
    """Return the deviation of attitudes from a steady rotation in their window."""
    cosines = np.abs(np.einsum("nkj,nlj->nkl", attitudes, attitudes))
    central = np.median(cosines, axis=2).argmax(axis=1)
    origin = np.repeat(attitudes[np.arange(len(attitudes)), central], attitudes.shape[1], axis=0)
    turns = rotation_vectors(origin, attitudes.reshape(-1, 4)).reshape(*attitudes.shape[:2], 3)
    return np.sqrt(sum(_deviation_from_line(time, turns[:, :, axis]) ** 2 for axis in range(3)))

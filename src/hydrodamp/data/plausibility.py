"""Implausible values of channels: beyond a physical limit, sentinels, and isolated outliers."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.channels import ATTITUDE, EULER, unit_of
from hydrodamp.errors import OutlierWarning, format_time, warn

#: Largest component of a recorded velocity [m/s, rad/s]; beyond it a replay has diverged.
MAX_VELOCITY = 50.0

MAX_NORM_ERROR = 1e-3  # how far the norm of a quaternion may be off one
FULL_TURN = 2.0 * np.pi  # rad

#: Largest Euler angles [rad]; only yaw may count turns, up to a thousand.
MAX_ANGLES = dict(zip(EULER, (FULL_TURN, FULL_TURN, 1000.0 * FULL_TURN), strict=True))

#: Largest integers of MAVLink, which mean "unknown": INT16_MAX, UINT16_MAX, INT32_MAX, UINT32_MAX.
SENTINELS = frozenset((32767.0, 65535.0, 2147483647.0, 4294967295.0))

UNKNOWN = -1.0  # of a channel without a negative range, and of a propeller speed
MAX_RATIO = 3.0  # of an outlier to the largest other value, least; by choice
MAX_SHARE = 0.05  # of the samples of a channel that outliers can be; by choice
MIN_SAMPLES = 20  # of a channel that has a distribution; by choice
MAX_RUN = 5  # consecutive outliers, as steps that make no gap; a step that lasts longer is real


def find_absurd(values: FloatArray, limit: float) -> BoolArray:
    """Return which values are beyond a limit; none where they are many, or near the others."""
    with np.errstate(invalid="ignore"):
        size = np.abs(values)
        absurd = size > limit
    usual = float(np.nanmax(size[~absurd], initial=0.0))
    n_most = _most(values)
    isolated = 0 < absurd.sum() <= n_most and size[absurd].min() > MAX_RATIO * usual
    return absurd if isolated else np.zeros_like(absurd)


def find_sentinels(values: FloatArray, ordinary: float, largest: float) -> BoolArray:
    """Return which values are sentinels beyond an ordinary value and all others.

    Many of them are commands at full scale, unless they are beyond the largest plausible value.
    """
    size = np.abs(values)
    sentinel: BoolArray = np.isin(values, [*SENTINELS])
    usual = float(size[~sentinel].max(initial=0.0))
    # Where all others are zero, a sentinel may be the full scale of a switch.
    sentinel &= (size > max(MAX_RATIO * usual, ordinary)) & (usual > 0.0)
    if sentinel.sum() > _most(values):
        sentinel &= size > largest
    return sentinel


def find_unknown(values: FloatArray) -> BoolArray:
    """Return which values of a channel without a negative range mean "unknown", if they are few."""
    unknown: BoolArray = values == UNKNOWN
    is_positive = values[~unknown].min(initial=np.inf) >= 0.0
    if not (0 < unknown.sum() <= _most(values) and is_positive and _is_brief(unknown)):
        return np.zeros_like(unknown)
    near = np.flatnonzero(~unknown)
    index = np.searchsorted(near, np.flatnonzero(unknown))
    before, after = near[np.maximum(index - 1, 0)], near[np.minimum(index, len(near) - 1)]
    unknown[unknown] = np.minimum(values[before], values[after]) > MAX_RATIO * -UNKNOWN
    return unknown


def find_isolated(values: FloatArray, ordinary: float, ratio: float = MAX_RATIO) -> BoolArray:
    """Return which values are far larger than all others and than an ordinary one, and soon end.

    A run of more than :data:`MAX_RUN` samples is a step that lasts, and so are all values of its
    size.
    """
    size, n_most = np.abs(values), _most(values)
    largest = float(size.max(initial=0.0))
    if largest <= ordinary or np.count_nonzero(size * ratio > largest) > n_most:
        return np.zeros(len(values), dtype=np.bool_)
    top = np.sort(np.partition(size, len(size) - n_most - 1)[len(size) - n_most - 1 :])
    jumps = (top[1:] > ratio * top[:-1]) & (top[:-1] > 0.0) & (top[1:] > ordinary)
    for limit in top[1:][jumps].tolist():
        isolated = size >= limit
        if _is_brief(isolated):
            return np.asarray(isolated)
    return np.zeros(len(values), dtype=np.bool_)


def _is_brief(mask: BoolArray) -> bool:
    """Return whether no run of a mask, which has some, is a step that lasts."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    return bool((edges[1::2] - edges[::2]).max() <= MAX_RUN)


def _most(values: FloatArray) -> int:
    """Return how many samples of a channel can be outliers."""
    return int(MAX_SHARE * len(values)) if len(values) >= MIN_SAMPLES else 0


def mask_absurd(
    columns: Mapping[str, FloatArray], time: FloatArray, source: str
) -> dict[str, FloatArray]:
    """Return columns with NaN for absurd velocities and attitudes, with a warning of each."""
    masked = {name: values for name, values in columns.items() if len(values) == len(time)}
    limits = {**dict.fromkeys(VELOCITIES, MAX_VELOCITY), **MAX_ANGLES}
    for name, limit in limits.items():
        if name not in masked:
            continue
        absurd = find_absurd(values := masked[name], limit)
        if absurd.any():
            masked[name] = np.where(absurd, np.nan, values)
            reason = f"beyond {limit:.4g} {unit_of(name)}"
            warn_outliers(source, describe_outliers(name, values, absurd, time, reason))
    if masked.keys() >= set(names := ATTITUDE.columns):
        norm = np.linalg.norm(np.stack([masked[name] for name in names]), axis=0)
        absurd = find_absurd(norm - 1.0, MAX_NORM_ERROR)
        if absurd.any():
            masked |= {name: np.where(absurd, np.nan, masked[name]) for name in names}
            sentence = describe_outliers(" ".join(names), norm, absurd, time, "norm not 1")
            warn_outliers(source, sentence)
    return {**columns, **masked}


def warn_outliers(source: str, *sentences: str) -> None:
    """Warn of the samples of a file that are left out."""
    for sentence in sentences:
        warn(f"{source or 'log'}: {sentence}", OutlierWarning, stacklevel=4)


def describe_outliers(
    name: str, values: FloatArray, mask: BoolArray, time: FloatArray, reason: str
) -> str:
    """Return channel, count, values and times of the samples that are left out."""
    rows = np.flatnonzero(mask)
    each = [f"{values[row]:.6g} at {format_time(time[row], time[0])}" for row in rows[:3].tolist()]
    more = f" and {len(rows) - 3} more" if len(rows) > 3 else ""
    samples = f"{len(rows)} implausible sample{'s' * (len(rows) > 1)}"
    return f"`{name}`: {samples} ({reason}) left out: {', '.join(each)}{more}"

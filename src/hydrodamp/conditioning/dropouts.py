"""Sensor dropouts (frozen, sample-and-hold, lost bottom lock or frames), and their removal.

Short gaps are interpolated, linearly or by slerp; the log is cut at long gaps.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.attitude import slerp
from hydrodamp.data.channels import BLOCKS, POSITION
from hydrodamp.data.log import Log, columns_of, extract_segments, recorded_velocities
from hydrodamp.data.record import RELATIVE_GAP, Segment, max_step
from hydrodamp.errors import LogError

#: Name of the quaternion channel.
ATTITUDE = "attitude"

_SENSOR_CHANNELS = [
    (block.name, index, name)
    for block in BLOCKS
    if block.is_sensed
    for index, name in enumerate(block.columns)
]


class _Gaps(NamedTuple):
    """The valid samples before and after every sample of a channel."""

    before: IntArray
    after: IntArray
    share: FloatArray  # interpolation weight of the sample after
    bridged: BoolArray
    cut: BoolArray

    def ends(self, values: FloatArray) -> tuple[BoolArray, FloatArray, FloatArray, FloatArray]:
        """Return the bridged rows, their values before and after, and the weights."""
        rows = self.bridged
        return rows, values[self.before[rows]], values[self.after[rows]], self.share[rows]


def sensor_columns(log: Log) -> dict[str, FloatArray]:
    """Return the columns of sensors, without attitude and commands."""
    sensed = {name for _, _, name in _SENSOR_CHANNELS}
    return {name: values for name, values in columns_of(log).items() if name in sensed}


def remove_samples(
    log: Log, masks: Mapping[str, BoolArray], reason: str, longest: float | None = None
) -> Log:
    """Return a log without the masked samples; its notes count them per channel."""
    span = max_step(log.steps, shortest_gap(log)) if longest is None else longest
    gaps = {name: _find_gaps(log, rows, span) for name, rows in masks.items() if rows.any()}
    if not gaps:
        return log
    notes = [
        f"{reason}: {n} of {log.n} samples of `{name}` ({100 * n / log.n:.2g} %) {done}"
        for name, gap in gaps.items()
        for rows, done in ((gap.bridged, "interpolated"), (gap.cut, "cut out"))
        if (n := int(rows.sum()))
    ]
    cut = np.logical_or.reduce([gap.cut for gap in gaps.values()])
    return _cut_rows(_interpolate_gaps(log, gaps), cut, reason).with_notes(*notes)


def shortest_gap(log: Log) -> float:
    """Return the shortest interval without a measurement that counts as a gap [s]."""
    return RELATIVE_GAP * log.time_scale


def true_runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Return the half-open index ranges in which a mask is true."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def _find_gaps(log: Log, lost: BoolArray, longest: float) -> _Gaps:
    index = np.arange(log.n)
    before = np.maximum.accumulate(np.where(lost, -1, index))
    after = np.minimum.accumulate(np.where(lost, log.n, index)[::-1])[::-1]
    inside = (before >= 0) & (after < log.n)
    before, after = np.maximum(before, 0), np.minimum(after, log.n - 1)
    segment = log.segment_numbers
    near = inside & (segment[before] == segment) & (segment[after] == segment)
    span = log.time[after] - log.time[before]
    bridged = lost & near & (span <= longest * (1 + 1e-9))
    share = np.divide(log.time - log.time[before], span, out=np.zeros(log.n), where=bridged)
    return _Gaps(before, after, share, bridged, lost & ~bridged)


def _interpolate_gaps(log: Log, gaps: Mapping[str, _Gaps]) -> Log:
    blocks: dict[str, Any] = {}
    for block, column_index, name in _SENSOR_CHANNELS:
        if name in gaps:
            column = blocks.setdefault(block, getattr(log, block).copy())[:, column_index]
            rows, first, last, share = gaps[name].ends(column)
            column[rows] = first + share * (last - first)
    if ATTITUDE in gaps and log.attitude is not None:
        blocks[ATTITUDE] = log.attitude.copy()
        rows, *ends = gaps[ATTITUDE].ends(log.attitude)
        blocks[ATTITUDE][rows] = slerp(*ends)
    return dataclasses.replace(log, **blocks)


def _cut_rows(log: Log, cut: BoolArray, reason: str) -> Log:
    """Remove samples and split segments there."""
    if not cut.any():
        return log
    pieces = [piece for segment in log.segments for piece in _split_segment(segment, cut)]
    if not pieces:
        fault = f"{reason}: no two adjacent samples remain of {log.n}"
        raise LogError(fault, source=log.source)
    return extract_segments(log, pieces)


def _split_segment(segment: Segment, cut: BoolArray) -> Iterator[Segment]:
    """Yield the remaining parts of a segment, numbered if there are several."""
    spans = [(a, b) for a, b in true_runs(~cut[segment.start : segment.stop]) if b - a >= 2]
    for number, (start, stop) in enumerate(spans, start=1):
        name = segment.name if len(spans) == 1 else f"{segment.name}.{number}"
        yield Segment(name, segment.start + start, segment.start + stop)


#: By channel, which samples to remove, shape (n,).
Masks = dict[str, BoolArray]

_FROZEN_FACTOR = 3.0
_RUN_QUANTILE = 0.9  # quantile of the durations of constant runs
_MIN_FROZEN_STEPS = 3
_MIN_REPEATED_SHARE = 0.4  # repeated share from which a channel is sample-and-hold
_MIN_UPDATES = 10  # updates of the slower sensor, at least
_MIN_REGULARITY = 0.6  # shortest over median run; a coarse sensor repeats irregularly
_JUMP_FACTOR = 3.0  # times the median step
_MIN_STEP_SHARE = 0.3  # of a median step of a pose
_MIN_MOVING_SHARE = 0.5  # of the steps of a run on which another channel changes


def mask_frozen(log: Log, *, seconds: float | None = None) -> Log:
    """Remove the repeated samples of a frozen velocity, attitude or position sensor.

    Parameters
    ----------
    log : Log
        Any log.
    seconds : float, optional
        Shorter constant runs are not regarded as frozen [s]; by default 0.4 times the
        correlation time of the velocities.

    Returns
    -------
    log : Log
        The first sample of a run is kept. A channel that never changes is not masked;
        :func:`~hydrodamp.conditioning.quality_checks.check_quality` reports it.

    Examples
    --------
    >>> time = np.arange(0.0, 10.0, 0.1)
    >>> surge, rate = np.sin(time), np.cos(time)
    >>> surge[40:60] = surge[40]
    >>> mask_frozen(Log.from_arrays(time, {"u": surge, "r": rate})).notes
    ('frozen: 19 of 100 samples of `u` (19 %) cut out',)
    """
    return remove_samples(log, find_frozen(log, seconds), "frozen")


def find_frozen(log: Log, seconds: float | None = None) -> Masks:
    """Return the repeated samples of frozen velocities, attitude and position."""
    seconds = shortest_gap(log) if seconds is None else seconds
    repeats, masks = _repeat_masks(log), Masks()
    for name, values in recorded_velocities(log).items():
        other_repeats = [mask for channel, mask in repeats.items() if channel != name]
        moving = ~np.logical_and.reduce(other_repeats or [np.ones(log.n, dtype=np.bool_)])
        masks[name] = _frozen_mask(log, values, repeats[name], moving, seconds)
    turning = None if log.attitude is None else log.attitude[:, 1:]
    poses = (((ATTITUDE,), turning, 3), (POSITION.columns, varying_position(log), 0))
    for names, pose, first in poses:
        if pose is not None:
            repeated = _repeats_previous(pose, log.bounds)
            moving = _motion_expected(log, pose, repeated, log.velocity[:, first : first + 3])
            masks |= dict.fromkeys(names, _frozen_mask(log, pose, repeated, moving, seconds))
    return masks


def varying_position(log: Log) -> FloatArray | None:
    """Return the position if at least two of its components vary (not a depth only)."""
    if log.position is None or np.count_nonzero(np.ptp(log.position, axis=0)) < 2:
        return None
    return log.position


def _motion_expected(
    log: Log, pose: FloatArray, same: BoolArray, velocity: FloatArray
) -> BoolArray:
    """Return where the velocities predict a change of the pose."""
    steps = np.linalg.norm(np.diff(pose, axis=0), axis=1)[~same[1:]]
    usual = float(np.median(steps)) if len(steps) else np.inf
    speed = np.linalg.norm(velocity, axis=1)
    return np.asarray(speed * np.median(log.steps) > _MIN_STEP_SHARE * usual)


def _constant_runs(log: Log, same: BoolArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Return first sample, last sample and duration [s] of each constant run."""
    first = np.flatnonzero(~same)
    last = np.append(first[1:], log.n) - 1
    return first, last, log.time[last] - log.time[first]


def interpolate_sample_and_hold(log: Log) -> Log:
    """Interpolate velocities of a slower sensor that were recorded by sample and hold.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    log : Log
        Its notes count the repeated samples.

    Examples
    --------
    >>> time = np.arange(0.0, 20.0, 0.2)
    >>> surge = np.repeat(np.sin(time[::5]), 5)
    >>> interpolate_sample_and_hold(Log.from_arrays(time, {"u": surge, "r": np.cos(time)})).notes[0]
    'held: 76 of 100 samples of `u` (76 %) interpolated'
    """
    masks = find_sample_and_hold(log)
    spans = [_constant_runs(log, rows)[2].max() for rows in masks.values()]
    longest = max(spans, default=0.0) + 2 * float(np.median(log.steps))
    return remove_samples(log, masks, "held", longest)


def find_sample_and_hold(log: Log) -> Masks:
    """Return the repeated samples of velocities recorded by sample and hold."""
    repeats, masks = _repeat_masks(log), Masks()
    least = min((float(same.mean()) for same in repeats.values()), default=0.0)
    min_share = max(_MIN_REPEATED_SHARE, _FROZEN_FACTOR * least)
    for name in log.velocity_names:
        first, last, _ = _constant_runs(log, same := repeats[name])
        if same.mean() < min_share or len(first) < _MIN_UPDATES:
            continue
        short, median, long = np.quantile(last - first + 1, (0.1, 0.5, 0.75)).tolist()
        if median > 1.0 and short > _MIN_REGULARITY * median and long < median / _MIN_REGULARITY:
            masks[name] = same
    return masks


def _repeat_masks(log: Log) -> Masks:
    """Return which samples of velocities and attitude repeat the previous sample."""
    columns = recorded_velocities(log) | ({} if log.attitude is None else {ATTITUDE: log.attitude})
    return {name: _repeats_previous(values, log.bounds) for name, values in columns.items()}


def _repeats_previous(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Return which samples repeat the previous sample of their segment."""
    flat = values.reshape(len(values), -1)
    same = np.zeros(len(values), dtype=np.bool_)
    same[1:] = (flat[1:] == flat[:-1]).all(axis=1)
    same[bounds[:, 0]] = False
    return same


def _frozen_mask(
    log: Log, values: FloatArray, same: BoolArray, moving: BoolArray, seconds: float
) -> BoolArray:
    first, last, durations = _constant_runs(log, same)
    mask = np.zeros(log.n, dtype=np.bool_)
    if len(first) <= len(log.segments):  # a constant channel
        return mask
    limit = max(seconds, _FROZEN_FACTOR * float(np.quantile(durations, _RUN_QUANTILE)))
    steps, is_nonzero = last - first, values[first].reshape(len(first), -1).any(axis=1)
    count = np.concatenate(([0], np.cumsum(moving)))
    is_moving = count[last + 1] - count[first + 1] >= _MIN_MOVING_SHARE * steps
    frozen = (durations > limit) & (steps >= _MIN_FROZEN_STEPS) & is_nonzero & is_moving
    for run in np.flatnonzero(frozen).tolist():
        mask[first[run] + 1 : last[run] + 1] = True
    return mask


#: Invalid velocities of DVLs [m/s]: limits of a 16-bit integer in mm/s.
DVL_SENTINELS = (-32.768, 32.768, 32.767, -32.767)

#: Speed no marine vehicle exceeds; a median of half of it indicates another unit.
MAX_SPEED = 30.0  # m/s

_SENTINEL_TOLERANCE = 1e-6  # m/s, about a sentinel
_MIN_DROPOUT_SPEED = 0.1  # m/s; no vehicle stops from this speed within one sample


def mask_dvl_dropouts(log: Log, *, flag: str | None = None) -> Log:
    """Remove linear velocities that a DVL wrote without bottom lock.

    Parameters
    ----------
    log : Log
        Any log.
    flag : str, optional
        A command channel that is zero where the velocity is invalid.

    Returns
    -------
    log : Log
        Without samples that are :data:`DVL_SENTINELS`, exceed :data:`MAX_SPEED`, are flagged,
        or drop to zero in all linear velocities at once. If the median speed exceeds 15 m/s
        the unit is wrong and no sample is removed for its speed.

    Raises
    ------
    LogError
        If the flag does not exist, or no sample remains.

    Examples
    --------
    >>> log = Log.from_arrays(np.arange(6) / 5, {"u": [1, 1, 1, -32.768, 1, 1]})
    >>> mask_dvl_dropouts(log).velocity[:, 0].tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    return remove_samples(log, find_dvl_dropouts(log, flag), "no measurement")


def find_dvl_dropouts(log: Log, flag: str | None = None) -> Masks:
    """Return the linear velocities written without bottom lock."""
    linear = [name for name in VELOCITIES[:3] if name in log.velocity_names]
    if not linear:
        return {}
    values = log.velocity[:, [VELOCITIES.index(name) for name in linear]]
    median_speed = float(np.median(np.abs(values).max(axis=1)))
    fastest = MAX_SPEED if median_speed <= MAX_SPEED / 2 else np.inf
    mask = is_invalid_velocity(values, fastest).any(axis=1)
    mask |= _zero_dropouts(values, log.bounds, _MIN_DROPOUT_SPEED)
    if flag is not None:
        mask |= log.command(flag) == 0.0
    return dict.fromkeys(linear, mask)


def is_invalid_velocity(values: FloatArray, fastest: float) -> BoolArray:
    """Return which values of a velocity sensor are invalid."""
    invalid = ~(np.abs(values) <= fastest)
    for sentinel in DVL_SENTINELS:
        invalid |= np.abs(values - sentinel) < _SENTINEL_TOLERANCE
    return np.asarray(invalid)


def _zero_dropouts(values: FloatArray, bounds: IntArray, threshold: float) -> BoolArray:
    """Return zeros of all components at once that begin and end with a jump."""
    mask = np.zeros(len(values), dtype=np.bool_)
    if values.shape[1] < 2:
        return mask
    size = np.linalg.norm(values, axis=1)
    for start, stop in bounds.tolist():
        speeds = size[start:stop]
        for a, b in true_runs(speeds == 0.0):
            inside = a > 0 and b < len(speeds)
            mask[start + a : start + b] = inside and min(speeds[a - 1], speeds[b]) > threshold
    return mask


def mask_mocap_dropouts(log: Log) -> Log:
    """Remove poses that motion capture wrote as zeros when it lost the vehicle.

    Parameters
    ----------
    log : Log
        Any log; derive velocities from its position afterwards.

    Returns
    -------
    log : Log
        Without positions and attitudes that are zero in all components between nonzero
        samples.

    Examples
    --------
    >>> place = np.outer(np.arange(9.0), (1.0, 0.5, 0.1)) + 1.0
    >>> place[4] = 0.0
    >>> log = Log.from_arrays(np.arange(9.0), {"u": np.ones(9)}, position=place)
    >>> mask_mocap_dropouts(log).position[4].round(9).tolist()
    [5.0, 3.0, 1.4]
    """
    return remove_samples(log, find_mocap_dropouts(log), "lost frames")


def find_mocap_dropouts(log: Log) -> Masks:
    """Return the poses that are zero between nonzero samples."""
    masks = Masks()
    if log.position is not None:
        masks |= dict.fromkeys(POSITION.columns, _zero_pose_dropouts(log.position, log.bounds))
    # A heading averaged across a wrap can be zero as well.
    if log.attitude is not None and log.attitude[:, 1:3].any():
        masks[ATTITUDE] = _zero_pose_dropouts(log.attitude[:, 1:], log.bounds)
    return masks


def _zero_pose_dropouts(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Return zeros whose distance to adjacent samples exceeds three median steps."""
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    return _zero_dropouts(values, bounds, _JUMP_FACTOR * float(np.median(steps)))

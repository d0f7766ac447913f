"""Dropouts of sensors: what is frozen, held, lost, or stands for no measurement."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.conditioning.gaps import ATTITUDE, remove_samples, true_runs
from hydrodamp.data.channels import POSITION
from hydrodamp.data.log import Log, recorded_velocities

#: Channels, and which samples of each are to be taken out.
Masks = dict[str, BoolArray]

_FROZEN_FACTOR = 3.0
_RUN_QUANTILE = 0.9  # quantile of the lengths of a channel's runs
_MIN_FROZEN_STEPS = 3
_MIN_REPEATED_SHARE = (
    0.4  # share of samples that repeat the one before, from which a channel is held
)
_MIN_UPDATES = 10  # times at least
_MIN_REGULARITY = (
    0.6  # of the usual number of rows; a coarse sensor repeats itself any number of times
)
_JUMP_FACTOR = 3.0  # times the usual step
_MIN_STEP_SHARE = 0.3  # of a usual step of a pose
_MIN_MOVING_SHARE = 0.5  # of the steps of a run, on which something else must change


def mask_frozen(log: Log, *, seconds: float = 1.0) -> Log:
    """Take out what a frozen sensor of velocity, attitude or position repeats.

    Parameters
    ----------
    log : Log
        Any log.
    seconds : float, optional
        No run of one value up to this long is taken for frozen [s].

    Returns
    -------
    log : Log
        The first sample of a run is kept. A channel that never changes at all is left
        alone: :func:`~hydrodamp.conditioning.quality_checks.suspicions` reports it.

    Examples
    --------
    >>> time = np.arange(0.0, 10.0, 0.1)
    >>> surge, rate = np.sin(time), np.cos(time)
    >>> surge[40:60] = surge[40]
    >>> mask_frozen(Log.from_arrays(time, {"u": surge, "r": rate})).notes
    ('frozen: 19 of 100 samples of `u` (19 %) cut out',)
    """
    return remove_samples(log, find_frozen(log, seconds), "frozen")


def find_frozen(log: Log, seconds: float = 1.0) -> Masks:
    """Return what a frozen sensor repeats: of a velocity, of the attitude, of the position."""
    steady, lost = _repeat_masks(log), Masks()
    for name, values in recorded_velocities(log).items():
        rest = [other for one, other in steady.items() if one != name]
        moving = ~np.logical_and.reduce(rest or [np.ones(log.n, dtype=np.bool_)])
        lost[name] = _frozen_mask(log, values, steady[name], moving, seconds)
    turning = None if log.attitude is None else log.attitude[:, 1:]
    poses = (((ATTITUDE,), turning, 3), (POSITION.columns, varying_position(log), 0))
    for names, pose, first in poses:
        if pose is not None:
            same = _repeats_previous(pose, log.bounds)
            moving = _motion_expected(log, pose, same, log.velocity[:, first : first + 3])
            lost |= dict.fromkeys(names, _frozen_mask(log, pose, same, moving, seconds))
    return lost


def varying_position(log: Log) -> FloatArray | None:
    """Return the position, unless it is a depth alone: that may well stay, and is no way."""
    if log.position is None or np.count_nonzero(np.ptp(log.position, axis=0)) < 2:
        return None
    return log.position


def _motion_expected(
    log: Log, pose: FloatArray, same: BoolArray, velocity: FloatArray
) -> BoolArray:
    """Return where velocities would change a pose by as much as it usually does in a step."""
    steps = np.linalg.norm(np.diff(pose, axis=0), axis=1)[~same[1:]]
    usual = float(np.median(steps)) if len(steps) else np.inf
    speed = np.linalg.norm(velocity, axis=1)
    return np.asarray(speed * np.median(log.steps) > _MIN_STEP_SHARE * usual)


def _constant_runs(log: Log, same: BoolArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the first and the last sample of each run of one value, and how long it lasted."""
    first = np.flatnonzero(~same)
    last = np.append(first[1:], log.n) - 1
    return first, last, log.time[last] - log.time[first]


def interpolate_sample_and_hold(log: Log) -> Log:
    """Interpolate velocities that a slower sensor sent and that were held from row to row.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    log : Log
        Its notes count the samples that repeated the one before.

    Examples
    --------
    >>> time = np.arange(0.0, 20.0, 0.2)
    >>> surge = np.repeat(np.sin(time[::5]), 5)
    >>> interpolate_sample_and_hold(Log.from_arrays(time, {"u": surge, "r": np.cos(time)})).notes[0]
    'held: 76 of 100 samples of `u` (76 %) interpolated'
    """
    lost = find_sample_and_hold(log)
    spans = [_constant_runs(log, rows)[2].max() for rows in lost.values()]
    longest = max(spans, default=0.0) + 2 * float(np.median(log.steps))
    return remove_samples(log, lost, "held", longest)


def find_sample_and_hold(log: Log) -> Masks:
    """Return the samples of velocities that repeat a slower sensor's last."""
    steady, lost = _repeat_masks(log), Masks()
    least = min((float(same.mean()) for same in steady.values()), default=0.0)
    for name in log.velocity_names:
        first, last, _ = _constant_runs(log, same := steady[name])
        if (
            same.mean() < max(_MIN_REPEATED_SHARE, _FROZEN_FACTOR * least)
            or len(first) < _MIN_UPDATES
        ):
            continue
        short, usual, long = np.quantile(last - first + 1, (0.1, 0.5, 0.75)).tolist()
        if usual > 1.0 and short > _MIN_REGULARITY * usual and long < usual / _MIN_REGULARITY:
            lost[name] = same
    return lost


def _repeat_masks(log: Log) -> Masks:
    """Tell which samples of velocities and of the attitude repeat the one before."""
    columns = recorded_velocities(log) | ({} if log.attitude is None else {ATTITUDE: log.attitude})
    return {name: _repeats_previous(values, log.bounds) for name, values in columns.items()}


def _repeats_previous(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Tell which samples repeat the one before in the same segment."""
    flat = values.reshape(len(values), -1)
    same = np.zeros(len(values), dtype=np.bool_)
    same[1:] = (flat[1:] == flat[:-1]).all(axis=1)
    same[bounds[:, 0]] = False
    return same


def _frozen_mask(
    log: Log, values: FloatArray, same: BoolArray, moving: BoolArray, seconds: float
) -> BoolArray:
    first, last, lasted = _constant_runs(log, same)
    found = np.zeros(log.n, dtype=np.bool_)
    if len(first) <= len(log.segments):  # one run a segment: it never changes
        return found
    limit = max(seconds, _FROZEN_FACTOR * float(np.quantile(lasted, _RUN_QUANTILE)))
    steps = last - first
    count = np.concatenate(([0], np.cumsum(moving)))
    moved = count[last + 1] - count[first + 1]
    long = (
        (lasted > limit)
        & (steps >= _MIN_FROZEN_STEPS)
        & values[first].reshape(len(first), -1).any(axis=1)
    )
    for run in np.flatnonzero(long & (moved >= _MIN_MOVING_SHARE * steps)).tolist():
        found[first[run] + 1 : last[run] + 1] = True
    return found


#: Velocities that stand for none [m/s]: the ends of a 16-bit count of mm/s.
DVL_SENTINELS = (-32.768, 32.768, 32.767, -32.767)

#: What hardly any craft reaches; a usual speed of half of it is in another unit.
MAX_SPEED = 30.0  # m/s

_SENTINEL_TOLERANCE = 1e-6  # m/s, about a sentinel
_MIN_DROPOUT_SPEED = 0.1  # m/s; from this speed no vehicle stands still within a sample


def mask_dvl_dropouts(log: Log, *, flag: str | None = None) -> Log:
    """Take out linear velocities that were written without bottom lock.

    Parameters
    ----------
    log : Log
        Any log.
    flag : str, optional
        A command channel that is zero where the velocity is not good.

    Returns
    -------
    log : Log
        Without the samples that are :data:`SENTINELS`, beyond :data:`FASTEST`, flagged, or
        zero in all linear velocities at once between samples under way. Where most are above
        15 m/s their unit is to blame, and they stay.

    Raises
    ------
    LogError
        If there is no such flag, or nothing is left.

    Examples
    --------
    >>> log = Log.from_arrays(np.arange(6) / 5, {"u": [1, 1, 1, -32.768, 1, 1]})
    >>> mask_dvl_dropouts(log).velocity[:, 0].tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]
    """
    return remove_samples(log, find_dvl_dropouts(log, flag), "no measurement")


def find_dvl_dropouts(log: Log, flag: str | None = None) -> Masks:
    """Return the linear velocities that were written without bottom lock."""
    linear = {name: one for name, one in recorded_velocities(log).items() if name in VELOCITIES[:3]}
    if not linear:
        return {}
    values = np.column_stack([*linear.values()])
    usual = float(np.median(np.abs(values).max(axis=1)))
    lost = is_invalid_velocity(values, MAX_SPEED if usual <= MAX_SPEED / 2 else np.inf).any(axis=1)
    lost |= _zero_dropouts(values, log.bounds, _MIN_DROPOUT_SPEED)
    if flag is not None:
        lost |= log.command(flag) == 0.0
    return dict.fromkeys(linear, lost)


def is_invalid_velocity(values: FloatArray, fastest: float) -> BoolArray:
    """Return which numbers of a velocity sensor stand for none."""
    sentinel = (
        np.abs(values[..., np.newaxis] - np.array(DVL_SENTINELS)).min(axis=-1) < _SENTINEL_TOLERANCE
    )
    return np.asarray(sentinel | ~(np.abs(values) <= fastest))


def _zero_dropouts(values: FloatArray, bounds: IntArray, least: float) -> BoolArray:
    """Return zeros in two or more velocities at once that begin and end with a jump."""
    found = np.zeros(len(values), dtype=np.bool_)
    if values.shape[1] < 2:
        return found
    size = np.linalg.norm(values, axis=1)
    for start, stop in bounds.tolist():
        part = size[start:stop]
        for a, b in true_runs(part == 0.0):
            inside = a > 0 and b < len(part)
            found[start + a : start + b] = inside and min(part[a - 1], part[b]) > least
    return found


def mask_mocap_dropouts(log: Log) -> Log:
    """Take out poses that motion capture wrote as zeros where it lost the vehicle.

    Parameters
    ----------
    log : Log
        Any log; derive velocities from its position after this.

    Returns
    -------
    log : Log
        Without positions and attitudes that are zero in all components between samples that
        are not.

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
    """Return the poses that are zero between samples that are not."""
    lost = Masks()
    if log.position is not None:
        lost |= dict.fromkeys(POSITION.columns, _zero_pose_dropouts(log.position, log.bounds))
    # A heading alone is averaged to zero where it wraps, too.
    if log.attitude is not None and log.attitude[:, 1:3].any():
        lost[ATTITUDE] = _zero_pose_dropouts(log.attitude[:, 1:], log.bounds)
    return lost


def _zero_pose_dropouts(values: FloatArray, bounds: IntArray) -> BoolArray:
    """Return zeros that are much farther from their neighbours than these mostly are."""
    steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
    return _zero_dropouts(values, bounds, _JUMP_FACTOR * float(np.median(steps)))

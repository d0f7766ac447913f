"""Roll angle from the mixing of fin commands by an autopilot (least squares on the roll angle).

The autopilot rotates the demanded (elevator, rudder) by the roll angle; the angle that minimises
|fins - mixing(roll) demand|² over a short window is the roll (equation 1).
"""

from __future__ import annotations

import dataclasses

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.derivatives import required_blocks
from hydrodamp.data.attitude import euler_from_quaternion, quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, no_such

_MAX_RELATIVE_ERROR = 0.02  # of the demand; larger residuals of equation 1 are invalid
_ROUNDING_RAD = 2e-4  # rad
_MIN_SENSITIVITY = 5e-3  # rad of fin per rad of roll; less does not determine the roll
_MIN_VALID_SHARE = 0.1  # of the samples that must be valid
_SIGN_RATIO = 2.0  # ratio of roll changes from which the sign is wrong
_MAX_ROLL_RAD = np.radians(60.0)  # larger rolls do not occur under way
_INITIAL_ROLLS = np.linspace(-_MAX_ROLL_RAD, _MAX_ROLL_RAD, 25)
_NEWTON_STEPS = 4  # iterations of Newton's method


#: By autopilot, what elevator and rudder demanded count as in the fins of an upright vehicle; all
#: turn the demand alike where it has rolled by 90 degrees. `rotation` turns it by the roll angle.
#: `avl690` is the Virginia Tech 690: elevator (port - starboard) / 2 and rudder (bottom - top) / 2
#: as set, elevator and rudder angle as its loops put them out. Found by regression on its field
#: log of July 2022, where it holds in all samples; a rotation holds in nine of ten only.
MIXINGS = {"rotation": (1.0, 1.0), "avl690": (1.0, -1.0)}


def roll_from_mixing(
    log: Log,
    demanded: tuple[str, str],
    fins: tuple[str, str],
    mixing: str = "rotation",
    *,
    seconds: float = 0.5,
) -> Log:
    """Return a log whose roll is estimated from the mixing of fin commands.

    Parameters
    ----------
    log : Log
        With an attitude, whose roll is replaced.
    demanded : tuple of two str
        Commands: elevator and rudder demanded, in the upright frame [rad].
    fins : tuple of two str
        Commands: elevator and rudder as set, in the body frame [rad].
    mixing : str, optional
        Mixing rule: ``"rotation"`` rotates the demand by the roll angle,
        ``"avl690"`` is the Virginia Tech 690.
    seconds : float, optional
        Length of the estimation window [s].

    Returns
    -------
    log : Log
        With a roll of 60 degrees at most, interpolated where fins were saturated; its notes
        count these samples.

    Raises
    ------
    LogError
        If a command or the attitude is missing, fewer than 10 % of the samples determine the
        roll, or a sign is wrong.

    Examples
    --------
    >>> time = np.arange(0.0, 5.0, 0.1)
    >>> roll, wanted = 0.1 * np.sin(time), 0.2 * np.exp(1j * time)
    >>> fins = wanted * np.exp(1j * roll)
    >>> commands = dict(climb=wanted.real, turn=wanted.imag, elevator=fins.real, rudder=fins.imag)
    >>> log = Log.from_arrays(
    ...     time, {"u": 1 + 0 * time}, attitude=np.zeros((50, 3)), commands=commands
    ... )
    >>> made = roll_from_mixing(log, ("climb", "turn"), ("elevator", "rudder"), seconds=0.1)
    >>> bool(np.abs(euler_from_quaternion(made.attitude)[:, 0] - roll).max() < 1e-9)
    True
    """
    if mixing not in MIXINGS:
        raise LogError(no_such("mixing", mixing, MIXINGS), source=log.source)
    (attitude,) = required_blocks(log, "roll_from_mixing", "attitude")
    wanted, actual = (np.column_stack([*map(log.command, names)]) for names in (demanded, fins))
    good, alone = _valid_rows(wanted, actual, mixing)
    if good.mean() < _MIN_VALID_SHARE:
        fault = (
            f"the fins `{' '.join(fins)}` agree with the demands `{' '.join(demanded)}` and a roll"
            f" in only {100 * good.mean():.0f} % of the samples; check names, signs and mixing"
        )
        raise LogError(fault, source=log.source)
    mirrored = _valid_rows(wanted * (1, -1), actual, mixing)
    if _median_change(good, alone) > _SIGN_RATIO * _median_change(*mirrored):
        fault = f"the roll is smoother with the opposite sign of `{demanded[1]}`; change one sign"
        raise LogError(fault, source=log.source)
    sums = np.where(good[:, np.newaxis], _product_sums(wanted, actual, mixing), 0.0)
    euler = euler_from_quaternion(attitude)
    euler[:, 0] = _roll_angles(log, sums, seconds)
    note = (
        f"derived: roll from the mixing of `{' '.join(fins)}`; interpolated in"
        f" {int((~good).sum())} of {log.n} samples"
    )
    return dataclasses.replace(log, attitude=quaternion_from_euler(euler)).with_notes(note)


def _product_sums(wanted: FloatArray, actual: FloatArray, mixing: str) -> FloatArray:
    """Return the inner products of the squared residual of equation 1, shape (n, 5)."""
    first, second = wanted * MIXINGS[mixing], wanted[:, ::-1] * (-1.0, 1.0)
    pairs = ((actual, first), (actual, second), (first, first), (first, second), (second, second))
    return np.column_stack([np.sum(a * b, axis=1) for a, b in pairs])


def _distance(sums: FloatArray, roll: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the squared residual less |fins|², and half its first and second derivative."""
    c, s = np.cos(roll), np.sin(roll)
    along, across, first, both, second = sums.T
    size = c * c * first + 2 * c * s * both + s * s * second
    slope = c * s * (second - first) + (c * c - s * s) * both + s * along - c * across
    bend = (c * c - s * s) * (second - first) - 4 * c * s * both + c * along + s * across
    return size - 2 * (c * along + s * across), slope, bend


def _valid_rows(
    wanted: FloatArray, actual: FloatArray, mixing: str
) -> tuple[BoolArray, FloatArray]:
    """Return where equation 1 holds and determines the roll, and the roll of each sample."""
    sums = _product_sums(wanted, actual, mixing)
    roll = _minimise_distance(sums)
    distance, _, bend = _distance(sums, roll)
    residual = np.sqrt(np.maximum(distance + np.sum(actual**2, axis=1), 0.0))
    holds = residual <= _MAX_RELATIVE_ERROR * np.sqrt(sums[:, 2]) + _ROUNDING_RAD
    return holds & (bend > _MIN_SENSITIVITY**2), roll


def _minimise_distance(sums: FloatArray) -> FloatArray:
    """Return the angle of least residual, from the best of several initial values."""
    roll = np.zeros(len(sums))
    least = _distance(sums, roll)[0]
    for start in _INITIAL_ROLLS:
        trial = _distance(sums, np.full(len(roll), start))[0]
        better = trial < least
        roll[better], least[better] = start, trial[better]
    for _ in range(_NEWTON_STEPS):
        _, slope, bend = _distance(sums, roll)
        roll -= np.clip(np.divide(slope, bend, out=np.zeros_like(roll), where=bend > 0), -0.2, 0.2)
    return np.asarray(np.clip(roll, -_MAX_ROLL_RAD, _MAX_ROLL_RAD))


def _median_change(good: BoolArray, roll: FloatArray) -> float:
    """Return the median change of an angle between samples [rad]."""
    pairs = good[1:] & good[:-1]
    if pairs.mean() < _MIN_VALID_SHARE:
        return np.inf
    return float(np.median(np.abs(np.diff(roll)[pairs])))


def _roll_angles(log: Log, sums: FloatArray, seconds: float) -> FloatArray:
    """Return the roll of each window, interpolated where it is not determined."""
    roll = np.empty(log.n)
    for start, stop in log.bounds.tolist():
        time = log.time[start:stop]
        total = _windowed_sum(time, sums[start:stop], seconds)
        angle = _minimise_distance(total)
        known = np.flatnonzero(_distance(total, angle)[2] > _MIN_SENSITIVITY**2)
        if len(known) == 0:
            fault = f"no sample determines the roll from {time[0]:g} s to {time[-1]:g} s"
            raise LogError(fault, source=log.source)
        roll[start:stop] = np.interp(time, time[known], np.unwrap(angle[known]))
    return roll


def _windowed_sum(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    """Sum values over a window centred at each sample."""
    slack = 1e-9 * max(1.0, seconds)
    first: IntArray = np.searchsorted(time, time - seconds / 2 - slack)
    last: IntArray = np.searchsorted(time, time + seconds / 2 + slack)
    total = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)))
    return np.asarray(total[last] - total[first])

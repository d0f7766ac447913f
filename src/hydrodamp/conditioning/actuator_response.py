"""Actuator dynamics: dead zone, dead time (pure delay) and first-order lag of a command.

With a command u held from sample to sample, a dead time d gives u(t - d) and a lag with time
constant T solves T x' = u - x; both are averaged exactly over each sampling interval.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

#: Times and values of a segment and a time constant -> the mean response over each step.
_Response = Callable[[FloatArray, FloatArray, float], FloatArray]


def apply_delay(log: Log, seconds: Mapping[str, float]) -> Log:
    """Return a log whose commands are delayed by a dead time.

    Parameters
    ----------
    log : Log
        Any log.
    seconds : mapping of str to float
        Dead time of each command [s]; it need not be a whole number of steps.

    Returns
    -------
    log : Log
        Its notes give the dead times.

    Raises
    ------
    LogError
        If a command does not exist, or a time is negative or not finite.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1, 2, 3], {"u": [1] * 4}, commands={"rudder": [0, 1, 0, 0]})
    >>> apply_delay(log, {"rudder": 0.5}).command("rudder").tolist()
    [0.0, 0.5, 0.5, 0.0]
    """
    return _apply_response(log, seconds, _delay_segment, "delayed")


def apply_first_order_lag(log: Log, seconds: Mapping[str, float]) -> Log:
    """Return a log whose commands pass through a first-order lag.

    Parameters
    ----------
    log : Log
        Any log.
    seconds : mapping of str to float
        Time constant of each command [s].

    Returns
    -------
    log : Log
        Its notes give the time constants.

    Raises
    ------
    LogError
        If a command does not exist, or a time is negative or not finite.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1, 2, 3], {"u": [1] * 4}, commands={"rudder": [0, 1, 1, 1]})
    >>> apply_first_order_lag(log, {"rudder": 1.0}).command("rudder").round(3).tolist()
    [0.0, 0.368, 0.767, 0.914]
    """
    return _apply_response(log, seconds, _lag_segment, "lagged")


def apply_dead_zone(log: Log, zones: Mapping[str, tuple[float, float]]) -> Log:
    """Return a log whose commands are measured from the edges of their dead zones.

    For a thruster of known force, set its dead zone in the vehicle file. Use this function for
    a command of unknown gain, such as a pulse width around 1500 us.

    Parameters
    ----------
    log : Log
        Any log.
    zones : mapping of str to tuple of two floats
        Lowest and highest command without effect, in the unit of the command.

    Returns
    -------
    log : Log
        Zero inside the zone, the signed distance to the nearer limit outside; its notes
        give the zones.

    Raises
    ------
    LogError
        If a command does not exist, or the limits of a zone are not in ascending order.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1, 2], {"u": [1] * 3}, commands={"m1": [1400, 1510, 1600]})
    >>> apply_dead_zone(log, {"m1": (1475, 1525)}).command("m1").tolist()
    [-75.0, 0.0, 75.0]
    """
    changed = {}
    for name, (low, high) in zones.items():
        values = log.command(name)
        if not (np.isfinite((low, high)).all() and low <= high):
            fault = f"the dead zone of `{name}` must be lowest, highest; got {low:g}, {high:g}"
            raise LogError(fault, source=log.source)
        changed[name] = values - np.clip(values, low, high)
    notes = [
        f"command `{name}` counted from its dead zone, {low:g} to {high:g}"
        for name, (low, high) in zones.items()
    ]
    return _with_commands(log, changed).with_notes(*notes)


def _apply_response(log: Log, seconds: Mapping[str, float], response: _Response, done: str) -> Log:
    changed = {}
    for name, time in seconds.items():
        values = log.command(name)
        if not (np.isfinite(time) and time >= 0):
            fault = f"the time of `{name}` must be zero or positive [s]; got {time}"
            raise LogError(fault, source=log.source)
        if time > 0:
            values_by_segment = [response(log.time[a:b], values[a:b], time) for a, b in log.bounds]
            changed[name] = np.concatenate(values_by_segment)
    notes = [f"command `{name}` {done} by {seconds[name]:g} s" for name in changed]
    return _with_commands(log, changed).with_notes(*notes)


def _with_commands(log: Log, changed: Mapping[str, FloatArray]) -> Log:
    commands = log.commands.copy()
    for name, values in changed.items():
        commands[:, log.command_names.index(name)] = values
    return dataclasses.replace(log, commands=commands)


def _sample_ends(time: FloatArray) -> FloatArray:
    """Return the end time of each sample; the last sample lasts a median step."""
    return np.append(time[1:], time[-1] + np.median(np.diff(time)))


def _delay_segment(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    ends = _sample_ends(time)
    knots = np.append(time, ends[-1])
    area = np.concatenate(([0.0], np.cumsum(values * (ends - time))))

    def integral_until(times: FloatArray) -> FloatArray:
        before = np.minimum(times - time[0], 0.0) * values[0]
        return np.asarray(np.interp(times, knots, area) + before)

    return (integral_until(ends - seconds) - integral_until(time - seconds)) / (ends - time)


def _lag_segment(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    from scipy.linalg.lapack import dtbtrs  # takes long to import

    steps = (_sample_ends(time) - time) / seconds
    gain = -np.expm1(-steps)  # share of the step response reached at the end of each step
    # x[k+1] = exp(-h/T) x[k] + (1 - exp(-h/T)) u[k], solved as a bidiagonal system.
    bands = np.stack((np.ones(len(time)), -np.exp(-steps)))
    initial, _ = dtbtrs(bands, np.append(values[0], (gain * values)[:-1]), uplo="L")
    # Mean of the exponential from x[k] towards u[k] over the step.
    return np.asarray(values + (initial - values) * gain / steps)

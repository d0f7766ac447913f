"""What an actuator makes of a command: a dead zone, a dead time, a first-order lag."""

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
    """Return a log whose commands act later.

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
        If there is no such command, or a time is negative or no number.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1, 2, 3], {"u": [1] * 4}, commands={"rudder": [0, 1, 0, 0]})
    >>> apply_delay(log, {"rudder": 0.5}).command("rudder").tolist()
    [0.0, 0.5, 0.5, 0.0]
    """
    return _apply_response(log, seconds, _delay_segment, "delayed")


def apply_first_order_lag(log: Log, seconds: Mapping[str, float]) -> Log:
    """Return a log whose commands act through a first-order lag.

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
        If there is no such command, or a time is negative or no number.

    Examples
    --------
    >>> log = Log.from_arrays([0, 1, 2, 3], {"u": [1] * 4}, commands={"rudder": [0, 1, 1, 1]})
    >>> apply_first_order_lag(log, {"rudder": 1.0}).command("rudder").round(3).tolist()
    [0.0, 0.368, 0.767, 0.914]
    """
    return _apply_response(log, seconds, _lag_segment, "lagged")


def apply_dead_zone(log: Log, zones: Mapping[str, tuple[float, float]]) -> Log:
    """Return a log whose commands are what lies beyond their dead zones.

    A thruster of known newtons has a dead zone of its own in the vehicle file; this is for
    a command whose gain is unknown, such as a pulse width about 1500 us.

    Parameters
    ----------
    log : Log
        Any log.
    zones : mapping of str to tuple of two floats
        Lowest and highest command without effect, in the unit of the command.

    Returns
    -------
    log : Log
        Zero within the zone, the distance to its nearer end beyond, with its sign; its notes
        give the zones.

    Raises
    ------
    LogError
        If there is no such command, or a zone does not run from low to high.

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
    for name, given in seconds.items():
        values = log.command(name)
        if not (np.isfinite(given) and given >= 0):
            fault = f"the time of `{name}` must be zero or positive [s]; got {given}"
            raise LogError(fault, source=log.source)
        if given > 0:
            parts = [response(log.time[a:b], values[a:b], given) for a, b in log.bounds]
            changed[name] = np.concatenate(parts)
    notes = [f"command `{name}` {done} by {seconds[name]:g} s" for name in changed]
    return _with_commands(log, changed).with_notes(*notes)


def _with_commands(log: Log, changed: Mapping[str, FloatArray]) -> Log:
    commands = log.commands.copy()
    for name, values in changed.items():
        commands[:, log.command_names.index(name)] = values
    return dataclasses.replace(log, commands=commands)


def _sample_ends(time: FloatArray) -> FloatArray:
    """Return when each sample ends; the last one lasts a median step."""
    return np.append(time[1:], time[-1] + np.median(np.diff(time)))


def _delay_segment(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    ends = _sample_ends(time)
    knots = np.append(time, ends[-1])
    area = np.concatenate(([0.0], np.cumsum(values * (ends - time))))

    def until(late: FloatArray) -> FloatArray:
        before = np.minimum(late - time[0], 0.0) * values[0]
        return np.asarray(np.interp(late, knots, area) + before)

    return (until(ends - seconds) - until(time - seconds)) / (ends - time)


def _lag_segment(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    from scipy.linalg.lapack import dtbtrs  # takes long to import

    steps = (_sample_ends(time) - time) / seconds
    reached = -np.expm1(-steps)  # of the way to the command, at the end of each step
    # Each response is what is left of the one before, and what it has reached of the command.
    bands = np.stack((np.ones(len(time)), -np.exp(-steps)))
    begun, _ = dtbtrs(bands, np.append(values[0], (reached * values)[:-1]), uplo="L")
    # The mean over the step of the decay from where the response is towards the command.
    return np.asarray(values + (begun - values) * reached / steps)

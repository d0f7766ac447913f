"""What an actuator makes of a command: a dead zone, a dead time, a first-order lag."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

_LONGEST = 200.0  # time constants summed at once: e^200 is far from overflow


class _Response(Protocol):
    def __call__(self, time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
        """Return the mean response of each step."""
        ...


def delayed(log: Log, seconds: Mapping[str, float]) -> Log:
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
    >>> delayed(log, {"rudder": 0.5}).command("rudder").tolist()
    [0.0, 0.5, 0.5, 0.0]
    """
    return _answered(log, seconds, _delayed, "delayed")


def lagged(log: Log, seconds: Mapping[str, float]) -> Log:
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
    >>> lagged(log, {"rudder": 1.0}).command("rudder").round(3).tolist()
    [0.0, 0.368, 0.767, 0.914]
    """
    return _answered(log, seconds, _lagged, "lagged")


def beyond_dead_zone(log: Log, zones: Mapping[str, tuple[float, float]]) -> Log:
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
    >>> beyond_dead_zone(log, {"m1": (1475, 1525)}).command("m1").tolist()
    [-75.0, 0.0, 75.0]
    """
    commands = log.commands.copy()
    for name, (low, high) in zones.items():
        log.command(name)  # refuses names that are not there
        column = log.command_names.index(name)
        if not (np.isfinite((low, high)).all() and low <= high):
            fault = f"the dead zone of `{name}` must be lowest, highest; got {low:g}, {high:g}"
            raise LogError(fault, source=log.source)
        commands[:, column] -= np.clip(commands[:, column], low, high)
    notes = [
        f"command `{name}` counted from its dead zone, {low:g} to {high:g}"
        for name, (low, high) in zones.items()
    ]
    return dataclasses.replace(log, commands=commands).noted(*notes)


def _answered(log: Log, seconds: Mapping[str, float], response: _Response, done: str) -> Log:
    commands = log.commands.copy()
    for name, given in seconds.items():
        log.command(name)  # refuses names that are not there
        column = log.command_names.index(name)
        if not (np.isfinite(given) and given >= 0):
            fault = f"the time of `{name}` must be zero or positive [s]; got {given}"
            raise LogError(fault, source=log.source)
        for start, stop in log.bounds.tolist():
            part = slice(start, stop)
            if given > 0:
                commands[part, column] = response(log.time[part], log.commands[part, column], given)
    notes = [f"command `{name}` {done} by {given:g} s" for name, given in seconds.items() if given]
    return dataclasses.replace(log, commands=commands).noted(*notes)


def _ends(time: FloatArray) -> FloatArray:
    """Return when each sample ends; the last one lasts a median step."""
    return np.append(time[1:], time[-1] + np.median(np.diff(time)))


def _delayed(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    ends = _ends(time)
    knots = np.append(time, ends[-1])
    area = np.concatenate(([0.0], np.cumsum(values * (ends - time))))

    def until(late: FloatArray) -> FloatArray:
        before = np.minimum(late - time[0], 0.0) * values[0]
        return np.asarray(np.interp(late, knots, area) + before)

    return (until(ends - seconds) - until(time - seconds)) / (ends - time)


def _lagged(time: FloatArray, values: FloatArray, seconds: float) -> FloatArray:
    ends = _ends(time)
    steps = (ends - time) / seconds
    start = _filtered(np.diff(time) / seconds, values)
    # The mean over the step of the decay from where the response is towards the command.
    return values + (start - values) * -np.expm1(-steps) / steps


def _filtered(steps: FloatArray, values: FloatArray) -> FloatArray:
    """Return the response at each sample; ``steps`` in time constants."""
    answer = np.empty_like(values)
    answer[0] = values[0]
    elapsed = np.concatenate(([0.0], np.cumsum(steps)))
    first = 0
    while first < len(values) - 1:
        last = int(np.searchsorted(elapsed, elapsed[first] + _LONGEST, side="right")) - 1
        last = min(max(last, first + 1), len(values) - 1)
        grown = np.exp(np.minimum(elapsed[first : last + 1] - elapsed[first], _LONGEST))
        gained = np.cumsum(values[first:last] * np.diff(grown))
        answer[first + 1 : last + 1] = (answer[first] + gained) / grown[1:]
        first = last
    return answer

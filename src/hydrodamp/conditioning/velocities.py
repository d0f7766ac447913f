"""Velocities that were not measured: rates from attitude, u v w from position and attitude."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.conditioning.slopes import Around, relative, slopes
from hydrodamp.data.attitude import down, rotation, turn
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, did_you_mean

_LINEAR, _RATES = VELOCITIES[:3], VELOCITIES[3:]
_LEVEL = 1e-9  # off the vertical; a planar log has no more


def rates_from_attitude(
    log: Log, names: Sequence[str] | None = None, *, seconds: float | None = None
) -> Log:
    """Return a log whose body rates come from its attitude.

    Parameters
    ----------
    log : Log
        With an attitude.
    names : sequence of str, optional
        Which of p q r to derive; those not recorded where not given, of a log that is level
        throughout r alone.
    seconds : float, optional
        Time under each local quadratic [s]; chosen by cross-validation where not given.

    Returns
    -------
    log : Log
        Its notes say which rates are derived, and how. A log that lacks none is returned
        as it is.

    Raises
    ------
    LogError
        If there is no attitude, or a name is no rate.

    Examples
    --------
    >>> time = np.arange(0.0, 5.0, 0.1)
    >>> yaw = np.outer(0.3 * time, (0, 0, 1))
    >>> log = rates_from_attitude(Log.from_arrays(time, {"u": 1 + 0 * time}, attitude=yaw))
    >>> log.velocity_names, log.velocity[:, 5].min().round(9).item()
    (('u', 'r'), 0.3)
    """
    if log.attitude is None:
        raise LogError("there is no attitude to derive rates from", source=log.source)
    level = bool((np.abs(down(log.attitude)[:, :2]) < _LEVEL).all())
    chosen = _chosen(log, names, _RATES, _RATES[2:] if level else _RATES)
    if not chosen:
        return log
    fit, window = slopes(log.time, log.bounds, _turns(log.attitude), seconds)
    rates = fit.slope - np.cross(fit.value, fit.slope) / 2
    columns = {name: rates[:, _RATES.index(name)] for name in chosen}
    note = f"derived: `{' '.join(chosen)}` from attitude, by local quadratics over {window} samples"
    return _with_velocities(log, columns).noted(note)


def velocity_from_position(
    log: Log, names: Sequence[str] | None = None, *, seconds: float | None = None
) -> Log:
    """Return a log whose linear velocities come from its position and attitude.

    Parameters
    ----------
    log : Log
        With a position and an attitude.
    names : sequence of str, optional
        Which of u v w to derive; those not recorded where not given, without w where the
        position never leaves its depth.
    seconds : float, optional
        Time under each local quadratic [s]; chosen by cross-validation where not given.

    Returns
    -------
    log : Log
        Its notes say which velocities are derived: they are over ground, a current is in
        them. A log that lacks none is returned as it is.

    Raises
    ------
    LogError
        If position or attitude is lacking, or a name is no linear velocity.

    Examples
    --------
    >>> time = np.arange(0.0, 5.0, 0.1)
    >>> east = np.full((50, 3), (0, 0, np.pi / 2))
    >>> log = Log.from_arrays(
    ...     time, {"r": 0 * time}, attitude=east, position=np.outer(time, (0, 2, 0))
    ... )
    >>> done = velocity_from_position(log)
    >>> done.velocity_names, done.velocity[:, 0].max().round(9).item()
    (('u', 'v', 'r'), 2.0)
    """
    position, attitude = log.position, log.attitude
    if position is None or attitude is None:
        lacking = "position" if position is None else "attitude"
        fault = f"there is no {lacking}; velocity from position needs both position and attitude"
        raise LogError(fault, source=log.source)
    planar = bool((position[:, 2] == position[0, 2]).all())
    chosen = _chosen(log, names, _LINEAR, _LINEAR[: 2 if planar else 3])
    if not chosen:
        return log
    fit, window = slopes(log.time, log.bounds, relative(position), seconds)
    body = np.einsum("nji,nj->ni", rotation(attitude), fit.slope)  # v = R^T dx/dt
    columns = {name: body[:, _LINEAR.index(name)] for name in chosen}
    note = (
        f"derived: `{' '.join(chosen)}` over ground from position, by local quadratics over"
        f" {window} samples"
    )
    return _with_velocities(log, columns).noted(note)


def _turns(attitude: FloatArray) -> Around:
    """Return attitudes as the rotation vectors that lead there from each sample."""

    def around(at: IntArray, near: IntArray) -> FloatArray:
        first = np.repeat(attitude[at], near.shape[1], axis=0)
        return turn(first, attitude[near.ravel()]).reshape(*near.shape, 3)

    return around


def _chosen(
    log: Log, names: Sequence[str] | None, known: Sequence[str], usual: Sequence[str]
) -> tuple[str, ...]:
    """Return the velocities to derive, in their usual order, or say which cannot be."""
    if names is None:
        return tuple(name for name in usual if name not in log.velocity_names)
    faults = [
        f"'{name}' cannot be derived here; it takes {' '.join(known)}.{did_you_mean(name, known)}"
        for name in names
        if name not in known
    ]
    if faults:
        raise LogError(faults, source=log.source)
    return tuple(name for name in known if name in names)


def _with_velocities(log: Log, columns: dict[str, FloatArray]) -> Log:
    """Return a log with some velocities added or replaced, without accelerations."""
    velocity = log.velocity.copy()
    for name, values in columns.items():
        velocity[:, VELOCITIES.index(name)] = values
    names = tuple(name for name in VELOCITIES if name in (*log.velocity_names, *columns))
    made = dataclasses.replace(log, velocity=velocity, velocity_names=names, acceleration=None)
    if log.acceleration is None:
        return made
    return made.noted(f"left out: recorded accelerations, which `{' '.join(columns)}` lack")

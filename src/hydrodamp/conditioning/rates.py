"""Body rates from attitude alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.conditioning.derived import checked_names, with_velocities
from hydrodamp.conditioning.local_polynomials import (
    Around,
    best_window,
    fitted,
    window_of,
)
from hydrodamp.data.attitude import down, turn
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

RATES = VELOCITIES[3:]
"""Roll, pitch and yaw rate."""

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
    usual = [name for name in (RATES[2:] if level else RATES) if name not in log.velocity_names]
    chosen = checked_names(log, usual if names is None else names, RATES)
    if not chosen:
        return log
    around = _turns(log.attitude)
    window = (
        best_window(log.time, log.bounds, around)
        if seconds is None
        else window_of(log.time, log.bounds, seconds)
    )
    fit = fitted(log.time, log.bounds, around, window)
    rates = fit.slope - np.cross(fit.value, fit.slope) / 2
    columns = {name: rates[:, RATES.index(name)] for name in chosen}
    note = f"derived: `{' '.join(chosen)}` from attitude, by local quadratics over {window} samples"
    return with_velocities(log, columns).noted(note)


def rate_slopes(log: Log, seconds: float | None = None) -> tuple[FloatArray, int]:
    """Return the time derivative of the recorded body rates."""
    rates = log.velocity[:, 3:]

    def around(at: IntArray, near: IntArray) -> FloatArray:
        difference: FloatArray = rates[near] - rates[at][:, np.newaxis]
        return difference

    window = (
        best_window(log.time, log.bounds, around)
        if seconds is None
        else window_of(log.time, log.bounds, seconds)
    )
    return fitted(log.time, log.bounds, around, window).slope, window


def _turns(attitude: FloatArray) -> Around:
    def around(at: IntArray, near: IntArray) -> FloatArray:
        first = np.repeat(attitude[at], near.shape[1], axis=0)
        return turn(first, attitude[near.ravel()]).reshape(*near.shape, 3)

    return around

"""Velocity from position: v = Rᵀ dx/dt, with the slope of local quadratics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.conditioning.derived import checked_names, with_velocities
from hydrodamp.conditioning.local_polynomials import best_window, fitted, window_of
from hydrodamp.data.attitude import rotation
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

LINEAR = VELOCITIES[:3]
"""Surge, sway and heave."""


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
    usual = [name for name in LINEAR[: 2 if planar else 3] if name not in log.velocity_names]
    chosen = checked_names(log, usual if names is None else names, LINEAR)
    if not chosen:
        return log

    def around(at: IntArray, near: IntArray) -> FloatArray:
        way: FloatArray = position[near] - position[at][:, np.newaxis]
        return way

    window = (
        best_window(log.time, log.bounds, around)
        if seconds is None
        else window_of(log.time, log.bounds, seconds)
    )
    slope = fitted(log.time, log.bounds, around, window).slope
    body = np.einsum("nji,nj->ni", rotation(attitude), slope)
    columns = {name: body[:, LINEAR.index(name)] for name in chosen}
    note = (
        f"derived: `{' '.join(chosen)}` over ground from position, by local quadratics over"
        f" {window} samples"
    )
    return with_velocities(log, columns).noted(note)

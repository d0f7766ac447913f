"""Accelerations from an accelerometer, moved to the reference point."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.conditioning.slopes import relative, slopes
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

#: Standard gravity [m/s^2].
GRAVITY = 9.80665


def acceleration_from_accelerometer(
    log: Log,
    lever_arm: npt.ArrayLike = (0.0, 0.0, 0.0),
    *,
    gravity: float = GRAVITY,
    seconds: float | None = None,
) -> Log:
    """Return a log whose accelerations come from its specific force.

    Parameters
    ----------
    log : Log
        With a specific force and an attitude.
    lever_arm : array_like, shape (3,), optional
        From the reference point to the accelerometer, body frame [m].
    gravity : float, optional
        [m/s^2].
    seconds : float, optional
        Time under the local quadratics of the rates [s]; chosen by cross-validation where
        not given.

    Returns
    -------
    log : Log
        With ``acceleration`` for every velocity recorded; its notes say so.

    Raises
    ------
    LogError
        If specific force or attitude is lacking, or the lever arm is not three numbers.

    Examples
    --------
    >>> level = np.zeros((9, 3))
    >>> still = Log.from_arrays(
    ...     np.arange(9.0), np.zeros((9, 6)), attitude=level,
    ...     specific_force=np.full((9, 3), (0.5, 0, -9.80665)),
    ... )
    >>> acceleration_from_accelerometer(still).acceleration[4, :3].round(9).tolist()
    [0.5, 0.0, 0.0]
    """
    if log.specific_force is None or log.attitude is None:
        lacking = "specific force" if log.specific_force is None else "attitude"
        fault = f"there is no {lacking}; accelerations need both specific force and attitude"
        raise LogError(fault, source=log.source)
    arm = _three(lever_arm, log.source)
    rates = log.velocity[:, 3:]
    fit, window = slopes(log.time, log.bounds, relative(rates), seconds)
    linear = moved(log.specific_force + gravity * log.down, rates, fit.slope, arm)
    linear -= np.cross(rates, log.velocity[:, :3])
    both = np.column_stack((linear, fit.slope))
    absent = [k for k, name in enumerate(VELOCITIES) if name not in log.velocity_names]
    both[:, absent] = 0.0
    place = ", ".join(f"{part:g}" for part in arm)
    note = (
        f"derived: accelerations from an accelerometer at ({place}) m and from rates by local"
        f" quadratics over {window} samples"
    )
    return dataclasses.replace(log, acceleration=both).noted(note)


def moved(
    acceleration: FloatArray, rates: FloatArray, slopes: FloatArray, arm: FloatArray
) -> FloatArray:
    """Return the acceleration of the reference point from that of a point beside it."""
    return acceleration - np.cross(slopes, arm) - np.cross(rates, np.cross(rates, arm))


def _three(lever_arm: npt.ArrayLike, source: str) -> FloatArray:
    try:
        arm: FloatArray = np.asarray(lever_arm, dtype=np.float64)
    except (TypeError, ValueError):
        arm = np.empty(0)
    if arm.shape != (3,) or not np.isfinite(arm).all():
        fault = f"`lever_arm` must be three numbers x y z [m]; got {lever_arm!r}"
        raise LogError(fault, source=source)
    return arm

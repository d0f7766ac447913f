"""Velocities through the water: what they are over ground, less the current."""

from __future__ import annotations

import dataclasses

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.conditioning.current import Current, estimate_current
from hydrodamp.data.attitude import rotation
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError


def without_current(log: Log, current: Current | None = None) -> Log:
    """Return a log whose velocities are through the water.

    Parameters
    ----------
    log : Log
        With velocities over ground and an attitude.
    current : Current, optional
        Estimated from the log where not given, see :func:`estimate_current`.

    Returns
    -------
    log : Log
        Recorded accelerations follow; the position stays as it was. Its notes tell the
        current.

    Raises
    ------
    LogError
        If the attitude is lacking, or the log does not determine its current.

    Examples
    --------
    >>> east = np.full((2, 3), (0, 0, np.pi / 2))
    >>> log = Log.from_arrays([0, 1], {"u": [1.5, 1.5], "v": [0, 0]}, attitude=east)
    >>> current = Current([0.0], [[0.0, 0.3]], [[0.0, 0.0]])
    >>> without_current(log, current).velocity[0, :1].round(9).tolist()
    [1.2]
    """
    if log.attitude is None:
        fault = "there is no attitude; a current cannot be turned into the body"
        raise LogError(fault, source=log.source)
    given = estimate_current(log) if current is None else current
    if current is None and not given.determined:
        worst = float(given.standard_error.max())
        fault = (
            f"the headings of the log do not tell its current: they differ by {given.turned:.2g}"
            f" (0 one heading, 1 there and back), a standard error is {worst:.2g} m/s."
            " Give a `current`, or a log with courses on several headings"
        )
        raise LogError(fault, source=log.source)
    return _relative(log, given, "estimated" if current is None else "given")


def _relative(log: Log, current: Current, known: str) -> Log:
    assert log.attitude is not None
    seen = _in_body(log.attitude, current.at(log.elapsed))
    recorded = [name in log.velocity_names for name in VELOCITIES[:3]]
    velocity = log.velocity.copy()
    velocity[:, :3] -= np.where(recorded, seen, 0.0)
    acceleration = log.acceleration
    if acceleration is not None:
        change = _in_body(log.attitude, _slope(log, current)) - np.cross(log.velocity[:, 3:], seen)
        acceleration = acceleration.copy()
        acceleration[:, :3] -= np.where(recorded, change, 0.0)
    low, high = (np.linalg.norm(current.velocity, axis=1).min(), _largest(current))
    note = (
        f"derived: velocities through the water, less a current {known} of {low:.3g} to"
        f" {high:.3g} m/s (standard error up to {current.standard_error.max():.2g} m/s)"
    )
    return dataclasses.replace(log, velocity=velocity, acceleration=acceleration).noted(note)


def _largest(current: Current) -> float:
    return float(np.linalg.norm(current.velocity, axis=1).max())


def _in_body(attitude: FloatArray, horizontal: FloatArray) -> FloatArray:
    """Return world vectors without a vertical part in body components."""
    return np.asarray(np.einsum("nij,ni->nj", rotation(attitude)[:, :2], horizontal))


def _slope(log: Log, current: Current) -> FloatArray:
    """Return the rate of change of the current at each sample [m/s^2]."""
    if len(current.time) == 1:
        return np.zeros((log.n, 2))
    slopes = np.diff(current.velocity, axis=0) / np.diff(current.time)[:, np.newaxis]
    piece = np.searchsorted(current.time, log.elapsed, side="right") - 1
    inside = (piece >= 0) & (piece < len(slopes))
    return np.where(inside[:, np.newaxis], slopes[np.clip(piece, 0, len(slopes) - 1)], 0.0)

"""Velocities and accelerations from position, attitude and accelerometer, by local quadratics.

Savitzky-Golay smoothing on an uneven clock: a quadratic is fitted to each window by least squares;
its slope at the sample is the derivative. Leave-one-out cross-validation selects the window.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.attitude import euler_from_quaternion, rotate_to_body, rotation_vectors
from hydrodamp.data.channels import EULER
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError, did_you_mean

#: Window lengths to select from [samples].
WINDOW_LENGTHS = (5, 7, 9, 13, 17, 25, 35)

_CHUNK_ROWS = 8192
_UNIFORM_TOLERANCE = 1e-9  # of a window; smaller deviations count as uniform sampling
_MAX_CV_SAMPLES = 20000  # samples at which windows are compared


class LocalFit(NamedTuple):
    """Local polynomials at m samples."""

    value: FloatArray
    slope: FloatArray
    leverage: FloatArray


#: Samples (m,) and the samples of their windows (m, w) -> values, shape (m, w, k).
WindowValues = Callable[[IntArray, IntArray], FloatArray]


def fit_slopes(log: Log, around: WindowValues, seconds: float | None) -> tuple[LocalFit, int]:
    """Fit local quadratics over a given time, or over the best window; return fit and window."""
    if seconds is None:
        window = select_window(log.time, log.bounds, around)
    else:
        window = max(5, 2 * round(seconds / float(np.median(log.steps)) / 2) + 1)
    return fit_local_polynomials(log.time, log.bounds, around, window), window


def differences_from_centre(values: FloatArray) -> WindowValues:
    """Return the values in a window as differences from its sample."""

    def differences(at: IntArray, neighbours: IntArray) -> FloatArray:
        return np.asarray(values[neighbours] - values[at][:, np.newaxis])

    return differences


def local_polynomials(span: FloatArray, values: FloatArray, degree: int = 2) -> LocalFit:
    """Fit a polynomial to each window and evaluate it at the sample."""
    if np.ptp(span, axis=0).max() <= _UNIFORM_TOLERANCE * np.abs(span).max():
        span = span[:1]  # uniform sampling: one set of weights
    size = np.abs(span).max(axis=1)
    scale = np.where(size > 0, size, 1.0)[:, np.newaxis]
    powers = np.stack([(span / scale) ** k for k in range(min(degree + 1, span.shape[1]))], axis=1)
    inverse = np.linalg.inv(powers @ powers.transpose(0, 2, 1))
    coefficients = (inverse @ powers) @ values
    slope = coefficients[:, 1] / scale if coefficients.shape[1] > 1 else 0.0 * coefficients[:, 0]
    return LocalFit(coefficients[:, 0], slope, np.broadcast_to(inverse[:, 0, 0], len(values)))


def fit_local_polynomials(
    time: FloatArray,
    bounds: IntArray,
    around: WindowValues,
    window: int,
    rows: IntArray | None = None,
    degree: int = 2,
) -> LocalFit:
    """Return local polynomials at samples of a log."""
    samples = np.arange(len(time)) if rows is None else rows
    fits = []
    for start, stop in bounds.tolist():
        first, last = np.searchsorted(samples, (start, stop)).tolist()
        width = min(window, stop - start)
        for low in range(first, last, _CHUNK_ROWS):
            at = samples[low : min(low + _CHUNK_ROWS, last)]
            begin = np.clip(at - width // 2, start, stop - width)
            neighbours = begin[:, np.newaxis] + np.arange(width)
            span = time[neighbours] - time[at, np.newaxis]
            fits.append(local_polynomials(span, around(at, neighbours), degree))
    return LocalFit(*(np.concatenate(column) for column in zip(*fits, strict=True)))


def select_window(time: FloatArray, bounds: IntArray, around: WindowValues) -> int:
    """Return the window of least leave-one-out prediction error."""
    rows = np.arange(0, len(time), -(-len(time) // _MAX_CV_SAMPLES))
    longest = int(np.max(bounds[:, 1] - bounds[:, 0]))
    usable = [window for window in WINDOW_LENGTHS if window < longest] or [WINDOW_LENGTHS[0]]
    errors = []
    for window in usable:
        fit = fit_local_polynomials(time, bounds, around, window, rows)
        free = np.maximum(1.0 - fit.leverage, 1e-6)[:, np.newaxis]
        errors.append(float(np.mean((fit.value / free) ** 2)))
    return usable[int(np.argmin(errors))]


def required_blocks(log: Log, step: str, *names: str) -> list[FloatArray]:
    """Return the blocks that a step needs; raise LogError if one is missing."""
    blocks = {name: getattr(log, name) for name in names}
    if lacking := [name.replace("_", " ") for name, block in blocks.items() if block is None]:
        fault = f"there is no {' and no '.join(lacking)}, which `{step}` needs"
        raise LogError(fault, source=log.source)
    return [*blocks.values()]


_LINEAR, _RATES = VELOCITIES[:3], VELOCITIES[3:]
_MAX_DEVIATION = 1e-9  # rad; a constant angle deviates less
_CONSTANT_SHARE = 0.99  # of the samples; steps interpolate the others


def derivable_rates(attitude: FloatArray) -> tuple[str, ...]:
    """Return those of p q r that an attitude determines: not p of a constant roll, q of a pitch.

    An angle that no sensor measured is constant; what turns of the other angles add to its rate
    is no measurement.
    """
    tilts = euler_from_quaternion(attitude)[:, :2]
    deviations = np.abs(tilts - np.median(tilts, axis=0))
    varies = np.quantile(deviations, _CONSTANT_SHARE, axis=0) > _MAX_DEVIATION
    return tuple(name for name, known in zip(_RATES, (*varies, True), strict=True) if known)


def constant_angles(log: Log, rates: Collection[str]) -> Iterator[str]:
    """Yield a message for each of these rates whose angle is constant in the attitude of a log."""
    known = _RATES if log.attitude is None else derivable_rates(log.attitude)
    for angle, name, axis in zip(EULER, _RATES, AXES[3:], strict=True):
        if name in rates and name not in known:
            yield (
                f"{angle} is constant, so it was not measured and {name} cannot be derived from "
                f"the attitude: record {name}, or leave {axis} out of the vehicle's `axes`."
            )


def rates_from_attitude(
    log: Log, names: Sequence[str] | None = None, *, seconds: float | None = None
) -> Log:
    """Return a log whose body rates come from its attitude.

    Parameters
    ----------
    log : Log
        With an attitude.
    names : sequence of str, optional
        Which of p q r to derive; default: those not recorded that the attitude determines
        (not p of a constant roll, which was not measured, nor q of a constant pitch).
    seconds : float, optional
        Length of the local quadratics [s]; default: selected by cross-validation.

    Returns
    -------
    log : Log
        Its notes state the derived rates and the window. A log that has all rates is
        returned unchanged.

    Raises
    ------
    LogError
        If the attitude is missing, or a name is not a rate.

    Examples
    --------
    >>> time = np.arange(0.0, 5.0, 0.1)
    >>> yaw = np.outer(0.3 * time, (0, 0, 1))
    >>> log = rates_from_attitude(Log.from_arrays(time, {"u": 1 + 0 * time}, attitude=yaw))
    >>> log.velocity_names, log.velocity[:, 5].min().round(9).item()
    (('u', 'r'), 0.3)
    """
    (attitude,) = required_blocks(log, "rates_from_attitude", "attitude")
    chosen = _names_to_derive(log, names, _RATES, derivable_rates(attitude))
    if not chosen:
        return log
    fit, window = fit_slopes(log, _relative_rotations(attitude), seconds)
    rates = fit.slope - np.cross(fit.value, fit.slope) / 2
    return _with_velocities(log, chosen, rates, "from attitude", window)


def velocity_from_position(
    log: Log, names: Sequence[str] | None = None, *, seconds: float | None = None
) -> Log:
    """Return a log whose linear velocities come from its position and attitude.

    Parameters
    ----------
    log : Log
        With a position and an attitude.
    names : sequence of str, optional
        Which of u v w to derive; default: those not recorded (no w at constant depth, only w
        if the position is a depth only).
    seconds : float, optional
        Length of the local quadratics [s]; default: selected by cross-validation.

    Returns
    -------
    log : Log
        Its notes state the derived velocities. They are over ground and contain a current.
        A log that has all velocities is returned unchanged.

    Raises
    ------
    LogError
        If position or attitude is missing, or a name is not a linear velocity.

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
    position, attitude = required_blocks(log, "velocity_from_position", "position", "attitude")
    moves = (position != position[0]).any(axis=0)
    known = (_LINEAR[:2] if moves[:2].any() else ()) + (_LINEAR[2:] if moves[2] else ())
    chosen = _names_to_derive(log, names, _LINEAR, known)
    if not chosen:
        return log
    fit, window = fit_slopes(log, differences_from_centre(position), seconds)
    body = rotate_to_body(attitude, fit.slope)  # v = R^T dx/dt
    return _with_velocities(log, chosen, body, "over ground from position", window)


def _relative_rotations(attitude: FloatArray) -> WindowValues:
    """Return the attitudes in a window as rotation vectors from its sample."""

    def rotations(at: IntArray, neighbours: IntArray) -> FloatArray:
        first = np.repeat(attitude[at], neighbours.shape[1], axis=0)
        return rotation_vectors(first, attitude[neighbours.ravel()]).reshape(*neighbours.shape, 3)

    return rotations


def _names_to_derive(
    log: Log, names: Sequence[str] | None, known: Sequence[str], usual: Sequence[str]
) -> tuple[str, ...]:
    """Return the velocities to derive, in canonical order; raise LogError for invalid names."""
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


def _with_velocities(
    log: Log, chosen: Sequence[str], derived: FloatArray, origin: str, window: int
) -> Log:
    """Return a log with derived velocities and without accelerations."""
    velocity, listed = log.velocity.copy(), " ".join(chosen)
    for axis in map(VELOCITIES.index, chosen):
        velocity[:, axis] = derived[:, axis % 3]
    names = tuple(name for name in VELOCITIES if name in (*log.velocity_names, *chosen))
    notes = [f"derived: `{listed}` {origin}, by local quadratics over {window} samples"]
    if log.acceleration is not None:
        notes.insert(0, f"left out: recorded accelerations, which `{listed}` lack")
    result = dataclasses.replace(log, velocity=velocity, velocity_names=names, acceleration=None)
    return result.with_notes(*notes)


#: Standard gravity [m/s^2].
GRAVITY = 9.80665


def acceleration_from_accelerometer(
    log: Log, lever_arm: npt.ArrayLike = (0.0, 0.0, 0.0), *, seconds: float | None = None
) -> Log:
    """Return a log whose accelerations come from its specific force.

    Parameters
    ----------
    log : Log
        With a specific force and an attitude.
    lever_arm : array_like, shape (3,), optional
        From the reference point to the accelerometer, body frame [m].
    seconds : float, optional
        Length of the local quadratics of the rates [s]; default: selected by
        cross-validation.

    Returns
    -------
    log : Log
        With ``acceleration`` for every recorded velocity; its notes say so.

    Raises
    ------
    LogError
        If specific force or attitude is missing, or the lever arm is not three numbers.

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
    step = "acceleration_from_accelerometer"
    force, _ = required_blocks(log, step, "specific_force", "attitude")
    lever = frozen(lever_arm, (3,), "lever_arm", LogError)
    rates = log.velocity[:, 3:]
    fit, window = fit_slopes(log, differences_from_centre(rates), seconds)
    linear = force + GRAVITY * log.down - np.cross(rates, log.velocity[:, :3])
    linear -= np.cross(fit.slope, lever) + np.cross(rates, np.cross(rates, lever))  # of the arm
    acceleration = np.column_stack((linear, fit.slope))
    absent = [k for k, name in enumerate(VELOCITIES) if name not in log.velocity_names]
    acceleration[:, absent] = 0.0
    position = ", ".join(f"{component:g}" for component in lever)
    note = (
        f"derived: accelerations from an accelerometer at ({position}) m and from rates by local"
        f" quadratics over {window} samples"
    )
    return dataclasses.replace(log, acceleration=acceleration).with_notes(note)

"""The current, estimated from a log alone, and velocities through the water without it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

from hydrodamp.arrays import FloatArray, IntArray, freeze, mad_std
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.conditioning.derivatives import required_blocks
from hydrodamp.data.attitude import euler_from_quaternion, rotate_to_body, rotation_matrices
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

#: What the drift of a current is counted over [s].
DRIFT_PERIOD_S = 600.0

_MIN_SURGE_SHARE = 0.5  # of the median surge
_CURRENT_STD = 1.0  # m/s, a priori standard deviation of the current
_SIDESLIP_STD_SHARE = 0.03  # of the median surge, a priori standard deviation of the steady drift
_MAX_FIT_SAMPLES = 40000  # samples; more are thinned out
_MIN_SAMPLES = 10  # samples
_MAX_CHECK_SAMPLES = 60_000  # samples, beyond which a current is not looked for unasked
_MIN_CHECK_DURATION = 300.0  # s, below which a current is not looked for unasked
_MIN_CURRENT = 0.05  # m/s, less is the tether or the tank


def current_warning(log: Log) -> str:
    """Return a sentence where velocities are over ground and a current is in them."""
    if log.n > _MAX_CHECK_SAMPLES or log.duration < _MIN_CHECK_DURATION:
        return ""
    try:
        current = estimate_current(log)
    except LogError:
        return ""
    sizes = np.linalg.norm(current.velocity, axis=1)
    doubt = np.linalg.norm(current.standard_error, axis=1)
    if not current.determined or float(np.median(sizes - 3 * doubt)) <= _MIN_CURRENT:
        return ""
    return (
        "velocities are over ground, in a current of "
        f"{sizes.min():.2g} to {sizes.max():.2g} m/s: the step `subtract_current` takes it out."
    )


def _rows_under_way(log: Log) -> IntArray:
    """Return the samples at which the vehicle makes way."""
    usual = float(np.median(log.velocity[:, 0]))
    rows = np.flatnonzero(log.velocity[:, 0] > _MIN_SURGE_SHARE * usual)
    if usual < _VELOCITY_RESOLUTION or len(rows) < _MIN_SAMPLES:
        fault = f"the vehicle is not under way: its median surge is {usual:.3g} m/s"
        raise LogError(fault, source=log.source)
    return rows[:: -(-len(rows) // _MAX_FIT_SAMPLES)]


def _knot_times(log: Log, spacing: float) -> FloatArray:
    """Return the times between which the current is linear."""
    if not np.isfinite(spacing):
        return np.zeros(1)
    count = max(1, round(log.elapsed[-1] / spacing))
    place = log.elapsed * (count / log.elapsed[-1])
    near = np.union1d(np.floor(place), np.minimum(np.ceil(place), count))
    return np.asarray(near * (log.elapsed[-1] / count))


def _prior_information(
    n_way: int, sideslip: int, knots: FloatArray, surge: float, drift: float
) -> FloatArray:
    """Return what is known before the log is read, as information."""
    k = len(knots)
    information = np.zeros((n_way + 2 * k,) * 2)
    information[:n_way, :n_way] = np.eye(n_way) / surge**2
    information[sideslip, sideslip] = (_SIDESLIP_STD_SHARE * surge) ** -2
    walk = np.zeros((k, k))
    walk[0, 0] = _CURRENT_STD**-2
    if k > 1:
        step = np.diff(np.eye(k), axis=0)
        walk += step.T @ (step / (drift**2 * np.diff(knots) / DRIFT_PERIOD_S)[:, np.newaxis])
    for first in (n_way, n_way + k):
        information[first : first + k, first : first + k] = walk
    return information


def _water_velocity_regressors(
    log: Log, rows: IntArray, commands: Sequence[str] | None
) -> tuple[FloatArray, FloatArray]:
    """Return what surge and drift through the water may depend on, as columns."""
    names = log.command_names if commands is None else commands
    surge, drift = [np.ones(len(rows))], [np.ones(len(rows))]
    for values in (log.command(name)[rows] for name in names):
        if np.ptp(values) > 0:
            scaled = (values - values.mean()) / values.std()
            surge += [scaled, scaled**2]
            drift += [scaled]
    turning = log.velocity[rows, 5]
    if turning.any():
        scaled = turning / np.abs(turning).max()
        surge.append(scaled**2)
        drift.append(scaled)
    return np.column_stack(surge), np.column_stack(drift)


def _current_regressors(log: Log, rows: IntArray, knots: FloatArray) -> sparse.sparray:
    """Return the current of each knot as surge and sway see it."""
    assert log.attitude is not None
    world = rotation_matrices(log.attitude[rows])  # world = R body
    elapsed = log.elapsed[rows]
    shares = [np.interp(elapsed, knots, one) for one in np.eye(len(knots))]
    share = sparse.csr_array(np.column_stack(shares))
    blocks: Any = [
        [share * world[:, towards, axis][:, np.newaxis] for towards in (0, 1)] for axis in (0, 1)
    ]
    return sparse.block_array(blocks, format="csr")


_MAX_STANDARD_ERROR = 0.1  # m/s, a standard error beyond which a current is not determined
_MIN_HEADING_DIVERSITY = 0.05  # headings that differ less lie within some 20 degrees
_HUBER_CONSTANT = 1.345  # robust standard deviations; 95 % efficient under normal noise
_IRLS_ITERATIONS = 15
_VELOCITY_RESOLUTION = 1e-4  # m/s; no Doppler log is better
_BLOCK_LENGTHS = (7.5, 15.0, 30.0, 60.0, 120.0, 240.0)  # s; one of them longer than correlations
_MIN_BLOCKS = 10


@dataclasses.dataclass(frozen=True, eq=False)
class Current:
    """The horizontal velocity of the water over ground, linear between knots.

    Attributes
    ----------
    time : ndarray, shape (k,)
        The knots, counted as :attr:`Log.elapsed <hydrodamp.data.log.Log.elapsed>` [s].
    velocity : ndarray, shape (k, 2)
        Towards north and east [m/s].
    standard_error : ndarray, shape (k, 2)
        Of each number [m/s].
    turned : float
        How far headings differ: one less the length of the mean of their unit vectors. Zero
        is one heading, 0.3 two at right angles, 1 there and back.

    Examples
    --------
    >>> tide = Current([0.0, 100.0], [[0.0, 0.1], [0.0, 0.3]], np.zeros((2, 2)))
    >>> tide.at([50.0]).round(3).tolist()
    [[0.0, 0.2]]
    """

    time: FloatArray
    velocity: FloatArray
    standard_error: FloatArray
    heading_diversity: float = 1.0

    def __post_init__(self) -> None:
        """Copy the arrays at the door."""
        n = len(self.time)
        freeze(self, time=(n,), velocity=(n, 2), standard_error=(n, 2))

    @property
    def determined(self) -> bool:
        """Whether headings differ enough and no standard error is too large."""
        small = bool(self.standard_error.max() <= _MAX_STANDARD_ERROR)
        return small and self.heading_diversity >= _MIN_HEADING_DIVERSITY

    def at(self, elapsed: npt.ArrayLike) -> FloatArray:
        """Return the current at some times.

        Parameters
        ----------
        elapsed : array_like, shape (n,)
            Counted as the knots [s].

        Returns
        -------
        velocity : ndarray, shape (n, 2)
            Towards north and east [m/s]; constant before the first knot and after the last.
        """
        times: FloatArray = np.asarray(elapsed, dtype=np.float64)
        return np.column_stack([np.interp(times, self.time, part) for part in self.velocity.T])


def estimate_current(
    log: Log,
    *,
    commands: Sequence[str] | None = None,
    spacing: float = DRIFT_PERIOD_S,
    drift: float = 0.05,
) -> Current:
    """Estimate the current of a log from the way its vehicle makes over ground.

    Parameters
    ----------
    log : Log
        With u and v over ground, an attitude, and courses on several headings.
    commands : sequence of str, optional
        Those that speed and drift may depend on; all that vary where not given.
    spacing : float, optional
        Time from knot to knot, about [s].
    drift : float, optional
        How much the current is likely to change in ten minutes [m/s]; zero for a constant
        current.

    Returns
    -------
    current : Current
        Look at its standard errors: along a single heading a current cannot be
        distinguished from a faster vehicle.

    Raises
    ------
    LogError
        If a channel is lacking, the vehicle never gets under way, or a setting cannot be.

    Examples
    --------
    >>> time = np.arange(0.0, 400.0)
    >>> yaw = np.where(time < 200, 0.0, np.pi / 2)
    >>> log = Log.from_arrays(
    ...     time, {"u": 1.5 + 0.2 * np.cos(yaw), "v": -0.2 * np.sin(yaw)},
    ...     attitude=np.outer(yaw, (0, 0, 1)),
    ... )
    >>> estimate_current(log, drift=0).velocity[:, 0].round(3).tolist()
    [0.2]
    """
    _check_inputs(log, spacing, drift)
    assert log.attitude is not None
    rows = _rows_under_way(log)
    knots = _knot_times(log, spacing if drift > 0 else np.inf)
    surge, sway = _water_velocity_regressors(log, rows, commands)
    n_way = surge.shape[1] + sway.shape[1]
    columns: Any = [sparse.block_diag([surge, sway]), _current_regressors(log, rows, knots)]
    matrix = sparse.csr_array(sparse.hstack(columns))
    usual = float(np.median(log.velocity[rows, 0]))
    prior = _prior_information(n_way, surge.shape[1], knots, usual, drift)
    measured = log.velocity[rows, :2].T
    elapsed = log.elapsed[rows]
    weight = np.full(
        measured.shape, 1.0 / np.maximum(np.var(measured, axis=1), _VELOCITY_RESOLUTION**2)[:, None]
    )
    for _ in range(_IRLS_ITERATIONS):
        weighted = matrix.multiply(weight.reshape(-1, 1))
        information = (matrix.T @ weighted).toarray() + prior
        estimate = np.linalg.solve(information, weighted.T @ measured.ravel())
        rest = measured - (matrix @ estimate).reshape(2, -1)
        weight = np.array([_robust_weights(one, elapsed) for one in rest])
    covariance = np.linalg.inv(information)
    errors = np.sqrt(covariance.diagonal()[n_way:]).reshape(2, -1).T
    found = estimate[n_way:].reshape(2, -1).T
    yaw = euler_from_quaternion(log.attitude[rows])[:, 2]
    return Current(knots, found, errors, float(1.0 - np.abs(np.exp(1j * yaw).mean())))


def subtract_current(log: Log, current: Current | None = None) -> Log:
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
        Recorded accelerations follow; the position stays as it was. Its notes give the
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
    >>> subtract_current(log, current).velocity[0, :1].round(9).tolist()
    [1.2]
    """
    (attitude,) = required_blocks(log, "subtract_current", "attitude")
    given = estimate_current(log) if current is None else current
    if current is None and not given.determined:
        worst = float(given.standard_error.max())
        fault = (
            f"the headings of the log do not determine its current: they differ by"
            f" {given.heading_diversity:.2g} (0 one heading, 1 there and back), a standard error is"
            f" {worst:.2g} m/s."
            " Give a `current`, or a log with courses on several headings"
        )
        raise LogError(fault, source=log.source)
    seen = rotate_to_body(attitude, given.at(log.elapsed))
    recorded = [name in log.velocity_names for name in VELOCITIES[:3]]
    velocity = log.velocity.copy()
    velocity[:, :3] -= np.where(recorded, seen, 0.0)
    acceleration = log.acceleration
    if acceleration is not None:
        change = rotate_to_body(attitude, _current_rate(log, given)) - np.cross(
            log.velocity[:, 3:], seen
        )
        acceleration = acceleration.copy()
        acceleration[:, :3] -= np.where(recorded, change, 0.0)
    sizes, known = np.linalg.norm(given.velocity, axis=1), "given" if current else "estimated"
    note = (
        f"derived: velocities through the water, less a current {known} of {sizes.min():.3g} to"
        f" {sizes.max():.3g} m/s (standard error up to {given.standard_error.max():.2g} m/s)"
    )
    return dataclasses.replace(log, velocity=velocity, acceleration=acceleration).with_notes(note)


def _current_rate(log: Log, current: Current) -> FloatArray:
    """Return the rate of change of the current at each sample [m/s^2]."""
    slopes = np.diff(current.velocity, axis=0) / np.diff(current.time)[:, np.newaxis]
    outside = np.zeros((1, 2))
    slopes = np.concatenate((outside, slopes, outside))
    return np.asarray(slopes[np.searchsorted(current.time, log.elapsed, side="right")])


def _check_inputs(log: Log, spacing: float, drift: float) -> None:
    lacking = [f"velocity `{name}`" for name in ("u", "v") if name not in log.velocity_names]
    lacking += [] if log.attitude is not None else ["attitude"]
    why = "a current is estimated from u and v on several headings"
    faults = [f"there is no {what}; {why}" for what in lacking]
    if not (spacing > 0 and np.isfinite(drift) and drift >= 0):
        faults.append(
            f"`spacing` must be positive [s] and `drift` zero or positive [m/s]; got {spacing:g}"
            f" and {drift:g}"
        )
    if faults:
        raise LogError(faults, source=log.source)


def _robust_weights(rest: FloatArray, elapsed: FloatArray) -> FloatArray:
    """Return Huber's weights over the variance that residuals as long as these have."""
    spread = max(float(mad_std(rest)), _VELOCITY_RESOLUTION)
    huber = np.minimum(
        1.0, _HUBER_CONSTANT * spread / np.maximum(np.abs(rest), _VELOCITY_RESOLUTION)
    )
    length = (
        max(_block_variance(huber * rest, elapsed, block) for block in _BLOCK_LENGTHS) / spread**2
    )
    return np.asarray(huber / (spread**2 * max(length, 1.0)))


def _block_variance(rest: FloatArray, elapsed: FloatArray, block: float) -> float:
    """Return the variance that independent residuals would have whose sums vary as these."""
    _, number, count = np.unique(elapsed // block, return_inverse=True, return_counts=True)
    if len(count) < _MIN_BLOCKS:
        return 0.0
    return float(np.mean(np.bincount(number, weights=rest) ** 2) / np.mean(count))

"""Ocean current estimated from a log, and velocities through the water.

Robust Bayesian regression by iteratively reweighted least squares with Huber weights: velocity over
ground = velocity through the water (polynomial in commands and yaw rate) + Rᵀ c(t), with c
piecewise linear (random-walk prior). Block sums account for the autocorrelation of the residuals.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import sparse

from hydrodamp.arrays import FloatArray, IntArray, freeze, mad_std
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.consistency import Fix, QualityIssue
from hydrodamp.conditioning.derivatives import required_blocks
from hydrodamp.data.attitude import euler_from_quaternion, rotate_to_body, rotation_matrices
from hydrodamp.data.log import Log
from hydrodamp.errors import LogError

#: Period over which `drift` states the change of the current [s].
DRIFT_PERIOD_S = 600.0

_MIN_SURGE_SHARE = 0.5  # of the median surge
_CURRENT_STD = 1.0  # m/s, a priori standard deviation of the current
_SIDESLIP_STD_SHARE = 0.03  # of the median surge, a priori standard deviation of the steady drift
_MAX_FIT_SAMPLES = 40000  # samples; a longer log is decimated
_MIN_SAMPLES = 10  # samples
_MAX_CHECK_SAMPLES = 60_000  # samples; longer logs are not checked for a current
_MIN_CHECK_DURATION = 300.0  # s; shorter logs are not checked for a current
_MIN_CURRENT = 0.05  # m/s; less is attributed to tether or tank


def current_warning(log: Log) -> str:
    """Return a warning if velocities are over ground and contain a current."""
    return "".join(f"{each.evidence}: {each.remedy}." for each in find_current(log))


def find_current(log: Log) -> Iterator[QualityIssue]:
    """Yield the current that the velocities contain, if one is determined."""
    if evidence := _describe_current(log):
        step = "subtract_current"
        names = " ".join(name for name in VELOCITIES[:3] if name in log.velocity_names)
        yield QualityIssue(
            names,
            "contains a current",
            evidence,
            remedy=f"subtract it by the step `{step}`",
            is_minor=True,
            fix=Fix("option", step),
        )


def _describe_current(log: Log) -> str:
    """Return how large a current the velocities contain, empty if none is determined."""
    if log.n > _MAX_CHECK_SAMPLES or log.duration < _MIN_CHECK_DURATION:
        return ""
    try:
        current = estimate_current(log)
    except LogError:
        return ""
    speeds = np.linalg.norm(current.velocity, axis=1)
    standard_errors = np.linalg.norm(current.standard_error, axis=1)
    if not current.determined or float(np.median(speeds - 3 * standard_errors)) <= _MIN_CURRENT:
        return ""
    return (
        "the velocities are over ground and contain a current of "
        f"{speeds.min():.2g} to {speeds.max():.2g} m/s"
    )


def _rows_under_way(log: Log) -> IntArray:
    """Return the samples at which surge exceeds half its median."""
    median_surge = float(np.median(log.velocity[:, 0]))
    rows = np.flatnonzero(log.velocity[:, 0] > _MIN_SURGE_SHARE * median_surge)
    if median_surge < _VELOCITY_RESOLUTION or len(rows) < _MIN_SAMPLES:
        fault = f"the vehicle is not under way: its median surge is {median_surge:.3g} m/s"
        raise LogError(fault, source=log.source)
    return rows[:: -(-len(rows) // _MAX_FIT_SAMPLES)]


def _knot_times(log: Log, spacing: float) -> FloatArray:
    """Return the knots of the piecewise linear current."""
    if not np.isfinite(spacing):
        return np.zeros(1)
    count = max(1, round(log.elapsed[-1] / spacing))
    position = log.elapsed * (count / log.elapsed[-1])
    occupied = np.union1d(np.floor(position), np.minimum(np.ceil(position), count))
    return np.asarray(occupied * (log.elapsed[-1] / count))


def _prior_information(
    n_water: int, sideslip: int, knots: FloatArray, surge: float, drift: float
) -> FloatArray:
    """Return the prior information matrix."""
    k = len(knots)
    information = np.zeros((n_water + 2 * k,) * 2)
    information[:n_water, :n_water] = np.eye(n_water) / surge**2
    information[sideslip, sideslip] = (_SIDESLIP_STD_SHARE * surge) ** -2
    walk = np.zeros((k, k))
    walk[0, 0] = _CURRENT_STD**-2
    if k > 1:
        step = np.diff(np.eye(k), axis=0)
        walk += step.T @ (step / (drift**2 * np.diff(knots) / DRIFT_PERIOD_S)[:, np.newaxis])
    for first in (n_water, n_water + k):
        information[first : first + k, first : first + k] = walk
    return information


def _water_velocity_regressors(
    log: Log, rows: IntArray, commands: Sequence[str] | None
) -> tuple[FloatArray, FloatArray]:
    """Return the regressors of surge and sway through the water."""
    surge, drift = [np.ones(len(rows))], [np.ones(len(rows))]
    for name in log.command_names if commands is None else commands:
        values = log.command(name)[rows]
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
    """Return the components of the current at each knot along surge and sway."""
    assert log.attitude is not None
    world = rotation_matrices(log.attitude[rows])  # world = R body
    shares = [np.interp(log.elapsed[rows], knots, unit) for unit in np.eye(len(knots))]
    share = sparse.csr_array(np.column_stack(shares))
    blocks: Any = [
        [share * world[:, direction, axis, np.newaxis] for direction in (0, 1)] for axis in (0, 1)
    ]
    return sparse.block_array(blocks, format="csr")


_MAX_STANDARD_ERROR = 0.1  # m/s; a larger standard error: not determined
_MIN_HEADING_DIVERSITY = 0.05  # less: all headings within about 20 degrees
_HUBER_CONSTANT = 1.345  # robust standard deviations; 95 % efficient under normal noise
_IRLS_ITERATIONS = 15
_VELOCITY_RESOLUTION = 1e-4  # m/s; no Doppler log is more accurate
_BLOCK_LENGTHS = (7.5, 15.0, 30.0, 60.0, 120.0, 240.0)  # s; beyond the correlation time
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
    heading_diversity : float
        Circular variance of the headings: 0 for one heading, 0.3 for two at right angles, 1 for
        opposite headings.

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
        """Whether headings are diverse enough and all standard errors small enough."""
        small = bool(self.standard_error.max() <= _MAX_STANDARD_ERROR)
        return small and self.heading_diversity >= _MIN_HEADING_DIVERSITY

    def at(self, elapsed: npt.ArrayLike) -> FloatArray:
        """Return the current at given times.

        Parameters
        ----------
        elapsed : array_like, shape (n,)
            Elapsed time [s].

        Returns
        -------
        velocity : ndarray, shape (n, 2)
            Towards north and east [m/s]; constant before the first knot and after the last.
        """
        times: FloatArray = np.asarray(elapsed, dtype=np.float64)
        return np.column_stack([np.interp(times, self.time, values) for values in self.velocity.T])


def estimate_current(
    log: Log,
    *,
    commands: Sequence[str] | None = None,
    spacing: float = DRIFT_PERIOD_S,
    drift: float = 0.05,
) -> Current:
    """Estimate the current from velocities over ground on several headings.

    Parameters
    ----------
    log : Log
        With u and v over ground, an attitude and several headings.
    commands : sequence of str, optional
        Commands that surge and sway may depend on; default: all that vary.
    spacing : float, optional
        Approximate distance of knots [s].
    drift : float, optional
        Prior standard deviation of the change in ten minutes [m/s]; zero for a constant
        current.

    Returns
    -------
    current : Current
        Check its standard errors: on a single heading a current cannot be distinguished
        from a faster vehicle.

    Raises
    ------
    LogError
        If a channel is missing, the vehicle is never under way, or a setting is invalid.

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
    n_water = surge.shape[1] + sway.shape[1]
    columns: Any = [sparse.block_diag([surge, sway]), _current_regressors(log, rows, knots)]
    matrix = sparse.csr_array(sparse.hstack(columns))
    median_surge = float(np.median(log.velocity[rows, 0]))
    prior = _prior_information(n_water, surge.shape[1], knots, median_surge, drift)
    measured = log.velocity[rows, :2].T
    elapsed = log.elapsed[rows]
    weight = np.full(
        measured.shape, 1.0 / np.maximum(np.var(measured, axis=1), _VELOCITY_RESOLUTION**2)[:, None]
    )
    for _ in range(_IRLS_ITERATIONS):
        weighted = matrix.multiply(weight.reshape(-1, 1))
        information = (matrix.T @ weighted).toarray() + prior
        estimate = np.linalg.solve(information, weighted.T @ measured.ravel())
        residuals = measured - (matrix @ estimate).reshape(2, -1)
        weight = np.array([_robust_weights(residual, elapsed) for residual in residuals])
    covariance = np.linalg.inv(information)
    errors = np.sqrt(covariance.diagonal()[n_water:]).reshape(2, -1).T
    velocity = estimate[n_water:].reshape(2, -1).T
    yaw = euler_from_quaternion(log.attitude[rows])[:, 2]
    return Current(knots, velocity, errors, float(1.0 - np.abs(np.exp(1j * yaw).mean())))


def subtract_current(log: Log, current: Current | None = None) -> Log:
    """Return a log whose velocities are through the water.

    Parameters
    ----------
    log : Log
        With velocities over ground and an attitude.
    current : Current, optional
        Default: estimated from the log by :func:`estimate_current`.

    Returns
    -------
    log : Log
        Recorded accelerations are corrected; the position is unchanged. Its notes give the
        current.

    Raises
    ------
    LogError
        If the attitude is missing, or the log does not determine the current.

    Examples
    --------
    >>> east = np.full((2, 3), (0, 0, np.pi / 2))
    >>> log = Log.from_arrays([0, 1], {"u": [1.5, 1.5], "v": [0, 0]}, attitude=east)
    >>> current = Current([0.0], [[0.0, 0.3]], [[0.0, 0.0]])
    >>> subtract_current(log, current).velocity[0, :1].round(9).tolist()
    [1.2]
    """
    (attitude,) = required_blocks(log, "subtract_current", "attitude")
    estimate = estimate_current(log) if current is None else current
    if current is None and not estimate.determined:
        worst = float(estimate.standard_error.max())
        fault = (
            f"the headings of the log do not determine its current: their circular variance is"
            f" {estimate.heading_diversity:.2g} (0 one heading, 1 opposite headings), the largest"
            f" standard error {worst:.2g} m/s."
            " Give a `current`, or record several headings"
        )
        raise LogError(fault, source=log.source)
    body_current = rotate_to_body(attitude, estimate.at(log.elapsed))
    recorded = [name in log.velocity_names for name in VELOCITIES[:3]]
    velocity = log.velocity.copy()
    velocity[:, :3] -= np.where(recorded, body_current, 0.0)
    acceleration = log.acceleration
    if acceleration is not None:
        change = rotate_to_body(attitude, _current_rate(log, estimate)) - np.cross(
            log.velocity[:, 3:], body_current
        )
        acceleration = acceleration.copy()
        acceleration[:, :3] -= np.where(recorded, change, 0.0)
    speeds, origin = np.linalg.norm(estimate.velocity, axis=1), "given" if current else "estimated"
    note = (
        f"derived: velocities through the water, less a current {origin} of {speeds.min():.3g} to"
        f" {speeds.max():.3g} m/s (standard error up to {estimate.standard_error.max():.2g} m/s)"
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
    reason = "a current is estimated from u and v on several headings"
    faults = [f"there is no {channel}; {reason}" for channel in lacking]
    if not (spacing > 0 and np.isfinite(drift) and drift >= 0):
        rule = "`spacing` must be positive [s] and `drift` zero or positive [m/s]"
        faults.append(f"{rule}; got {spacing:g} and {drift:g}")
    if faults:
        raise LogError(faults, source=log.source)


def _robust_weights(residuals: FloatArray, elapsed: FloatArray) -> FloatArray:
    """Return Huber weights over the long-run variance of the residuals."""
    scale = max(float(mad_std(residuals)), _VELOCITY_RESOLUTION)
    sizes = np.maximum(np.abs(residuals), _VELOCITY_RESOLUTION)
    huber = np.minimum(1.0, _HUBER_CONSTANT * scale / sizes)
    variances = [_block_variance(huber * residuals, elapsed, block) for block in _BLOCK_LENGTHS]
    return np.asarray(huber / (scale**2 * max(max(variances) / scale**2, 1.0)))


def _block_variance(residuals: FloatArray, elapsed: FloatArray, block: float) -> float:
    """Return the variance of sums over blocks, per sample."""
    _, number, count = np.unique(elapsed // block, return_inverse=True, return_counts=True)
    if len(count) < _MIN_BLOCKS:
        return 0.0
    return float(np.mean(np.bincount(number, weights=residuals) ** 2) / np.mean(count))

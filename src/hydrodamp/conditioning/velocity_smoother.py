"""Body velocities from measurements of poses and velocities at their own times, by smoothing.

With velocities v(t) of three axes and coordinates x(t), where dx/dt = A(t) v, it minimises

    |(y - C x - D v) / σ|² + |v''|² / q + |v / V|²

over the samples of a segment. A is the rotation matrix for positions, and the matrix of Euler rates
for angles; q maximises the marginal likelihood, V is a weak prior.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, mad_std
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.log import Log
from hydrodamp.data.measurement import Measurement

#: Standard deviation of the kinematic constraint over that of the coordinates.
CONSTRAINT_SHARE = 0.03

#: Smallest standard deviation of the constraint over the length of a run: rounding is below it.
MIN_RELATIVE_SLACK = 1e-6

#: Weak prior of a velocity over the scale of the motion, and of a coordinate over its length.
PRIOR_FACTOR = 10.0

#: Samples whose posterior variance is computed.
VARIANCE_SAMPLES = 32

#: Smallest cosine of the pitch angle in the matrix of Euler rates.
MIN_COSINE = 0.1


class Interpolation(NamedTuple):
    """Rows of the log before and after each measurement, and the share of the second."""

    lower: IntArray
    share: FloatArray
    inside: BoolArray

    @property
    def upper(self) -> IntArray:
        """Rows after the measurements; the same row where one coincides with a sample."""
        return self.lower + (self.share > 0.0)


def interpolate_series(
    series: FloatArray, lower: IntArray, upper: IntArray, share: FloatArray
) -> FloatArray:
    """Return a series (n, ...) between two rows each, with the share of the second."""
    share = share.reshape(-1, *(1,) * (series.ndim - 1))
    if not share.any():
        return np.asarray(series[lower])
    return np.asarray((1.0 - share) * series[lower] + share * series[upper])


def interpolate_rows(log: Log, measurement: Measurement) -> Interpolation:
    """Return where the measurements lie between the samples of a log."""
    moment = measurement.time - measurement.delay
    lower = np.zeros(measurement.n, dtype=np.int64)
    share, inside = np.zeros(measurement.n), np.zeros(measurement.n, dtype=bool)
    for number, (start, stop) in enumerate(log.bounds.tolist()):
        rows = np.flatnonzero(measurement.segment == number)
        time = log.time[start:stop]
        below = np.clip(np.searchsorted(time, moment[rows], side="right") - 1, 0, len(time) - 2)
        lower[rows] = start + below
        share[rows] = (moment[rows] - time[below]) / (time[below + 1] - time[below])
        inside[rows] = (share[rows] >= -1e-9) & (share[rows] <= 1.0 + 1e-9)
    return Interpolation(lower, np.clip(share, 0.0, 1.0), inside)


def angle_rate_matrices(euler: FloatArray) -> FloatArray:
    """Return the matrices from p q r to the rates of roll, pitch and yaw, shape (n, 3, 3)."""
    (sine, sine_pitch, _), (cosine, cosine_pitch, _) = np.sin(euler.T), np.cos(euler.T)
    safe = np.where(np.abs(cosine_pitch) < MIN_COSINE, np.copysign(MIN_COSINE, cosine_pitch), 0.0)
    safe = np.where(safe == 0.0, cosine_pitch, safe)
    zero, unit = np.zeros(len(euler)), np.ones(len(euler))
    rows = (
        (unit, sine * sine_pitch / safe, cosine * sine_pitch / safe),
        (zero, cosine, -sine),
        (zero, sine / safe, cosine / safe),
    )
    return np.moveaxis(np.array(rows), -1, 0)


def unwrapped_euler(log: Log) -> FloatArray:
    """Return roll, pitch and yaw of a log without jumps within segments, zeros if unknown."""
    if log.attitude is None:
        return np.zeros((log.n, 3))
    euler = euler_from_quaternion(log.attitude)
    for start, stop in log.bounds.tolist():
        euler[start:stop] = np.unwrap(euler[start:stop], axis=0)
    return euler


@dataclass(frozen=True, eq=False)
class Observation:
    """Linear observations of one component: y = C x + D v at interpolated rows.

    ``coordinate`` (3,) selects the coordinates, ``velocity`` (3,) the velocities.
    """

    rows: Interpolation
    values: FloatArray
    std: float
    coordinate: FloatArray
    velocity: FloatArray


def white_noise_std(values: FloatArray, segment: IntArray) -> float:
    """Return the standard deviation of white noise of a series from its third differences."""
    pieces = [np.diff(values[segment == number], 3) for number in np.unique(segment)]
    third = np.concatenate(pieces) if pieces else np.empty(0)
    std = float(mad_std(third)) / np.sqrt(20.0) if len(third) else 0.0
    resolution = np.diff(np.unique(values))
    floor = float(resolution.min()) / np.sqrt(12.0) if len(resolution) else 0.0
    return max(std, floor) or 1.0


class SmootherResult(NamedTuple):
    """Velocities (n, 3) and coordinates (n, 3).

    ``velocity_std`` and ``acceleration_std`` (3,) are RMS posterior standard deviations.
    """

    velocity: FloatArray
    coordinates: FloatArray
    velocity_std: FloatArray
    acceleration_std: FloatArray


def smooth_velocities(
    log: Log, matrices: FloatArray, observations: Sequence[Observation], scale: float
) -> SmootherResult:
    """Return the velocities of three axes from linear observations of them or their integrals.

    ``matrices`` (n, 3, 3) are A(t), ``scale`` is the size of the velocities, for their prior.
    """
    system = _System.of(log, matrices, observations, scale)
    factor = system.factor(system.best_roughness())
    solution = system.solve(factor).reshape(-1, 6)
    return SmootherResult(solution[:, :3], solution[:, 3:], *system.posterior_std(factor))


@dataclass(frozen=True, eq=False)
class _System:
    """Normal equations in unknowns (n, 6), velocities and coordinates, banded."""

    log: Log
    data: FloatArray  # upper band (18, 6 n) of observations, constraint and weak prior
    rough: FloatArray  # upper band of the roughness at q = 1
    rhs: FloatArray
    square: float
    n_rough: int
    log_intervals: float
    reference: float

    @classmethod
    def of(
        cls, log: Log, matrices: FloatArray, observations: Sequence[Observation], scale: float
    ) -> _System:
        n = log.n
        data, rough = np.zeros((18, 6 * n)), np.zeros((18, 6 * n))
        rhs, square = np.zeros(6 * n), 0.0
        position = [each.std for each in observations if each.coordinate.any()]
        length = scale * max(log.time[stop - 1] - log.time[start] for start, stop in log.bounds)
        slack = max(CONSTRAINT_SHARE * min(position, default=scale), MIN_RELATIVE_SLACK * length)
        n_rough, log_intervals = 0, 0.0
        observed_axes = [k for k in range(3) if any(each.coordinate[k] for each in observations)]
        for start, stop in log.bounds.tolist():
            step = np.diff(log.time[start:stop])
            first = np.arange(start, stop - 1)
            for axis in observed_axes:
                columns = [6 * first + 3 + axis, 6 * (first + 1) + 3 + axis]
                weights = [-np.ones(len(first)), np.ones(len(first))]
                for k in range(3):
                    columns += [6 * first + k, 6 * (first + 1) + k]
                    weights += [
                        -0.5 * step * matrices[first, axis, k],
                        -0.5 * step * matrices[first + 1, axis, k],
                    ]
                _add(data, np.array(columns), np.array(weights) / slack)
            for axis in range(3):
                middle = first[1:]
                before, after = step[:-1], step[1:]
                between = 0.5 * (before + after)
                ends = [6 * (middle - 1) + axis, 6 * middle + axis, 6 * (middle + 1) + axis]
                curve = np.array([1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after])
                _add(rough, np.array(ends), curve / np.sqrt(between))
                n_rough += len(middle)
                log_intervals += float(np.sum(np.log(between)))
        for axis in range(3):
            data[17, 3 + axis :: 6] += (PRIOR_FACTOR * length) ** -2.0
            data[17, axis::6] += (PRIOR_FACTOR * scale) ** -2.0
        for each in observations:
            observed, shares = _observation_entries(each)
            values = each.values[each.rows.inside] / each.std
            _add(data, observed, shares / each.std, rhs, values)
            square += float(values @ values)
        times = [np.median(np.diff(each.rows.lower + each.rows.share)) for each in observations]
        samples = max(float(np.median(times)) if times else 1.0, 1.0)
        interval: float = float(np.median(log.steps)) * samples
        return cls(log, data, rough, rhs, square, n_rough, log_intervals, scale**2 / interval**3)

    def best_roughness(self) -> float:
        """Return the roughness q of the largest marginal likelihood."""
        from scipy.optimize import minimize_scalar  # takes long to import

        result = minimize_scalar(
            self._deviance, bounds=(-16.0, 8.0), method="bounded", options={"xatol": 0.2}
        )
        return float(self.reference * np.exp(result.x))

    def _deviance(self, exponent: float) -> float:
        q = self.reference * np.exp(exponent)
        factor = self.factor(q)
        fitted = float(self.rhs @ self.solve(factor))
        logdet = 2.0 * float(np.sum(np.log(factor[-1])))
        volume = self.n_rough * float(np.log(q)) + self.log_intervals
        return self.square - fitted + logdet + volume

    def factor(self, roughness: float) -> FloatArray:
        """Return the banded Cholesky factor at a roughness q."""
        from scipy.linalg import cholesky_banded

        return np.asarray(cholesky_banded(self.data + self.rough / roughness, check_finite=False))

    def solve(self, factor: FloatArray) -> FloatArray:
        """Return the unknowns (6 n,)."""
        from scipy.linalg import cho_solve_banded

        return np.asarray(cho_solve_banded((factor, False), self.rhs))

    def posterior_std(self, factor: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the RMS posterior standard deviations of velocities and accelerations."""
        from scipy.linalg import cho_solve_banded

        first = np.concatenate([np.arange(a, b - 1) for a, b in self.log.bounds.tolist()])
        chosen = first[
            np.linspace(0, len(first) - 1, min(VARIANCE_SAMPLES, len(first))).astype(int)
        ]
        step = (self.log.time[chosen + 1] - self.log.time[chosen])[:, None]
        before, after = (6 * (chosen + k)[:, None] + np.arange(3) for k in (0, 1))
        columns = np.arange(before.size).reshape(before.shape)
        levels, slopes = np.zeros((2, 6 * self.log.n, before.size))
        levels[before, columns] = 1.0
        slopes[after, columns], slopes[before, columns] = 1.0 / step, -1.0 / step
        variances = [
            np.sum(units * cho_solve_banded((factor, False), units), axis=0)
            for units in (levels, slopes)
        ]
        velocity, acceleration = np.sqrt(np.reshape(variances, (2, -1, 3)).mean(axis=1))
        return velocity, acceleration


def _observation_entries(each: Observation) -> tuple[IntArray, FloatArray]:
    lower, share, inside = each.rows
    lower, share = lower[inside], share[inside]
    columns, weights = [], []
    for index, weight in enumerate([*each.velocity, *each.coordinate]):
        if weight:
            columns += [6 * lower + index, 6 * (lower + 1) + index]
            weights += [weight * (1.0 - share), weight * share]
    return np.array(columns), np.array(weights)


def _add(
    band: FloatArray,
    columns: IntArray,
    weights: FloatArray,
    rhs: FloatArray | None = None,
    values: FloatArray | None = None,
) -> None:
    """Add the normal matrix of rows with given columns and weights (k, n_rows) to a band."""
    for i in range(len(columns)):
        for j in range(len(columns)):
            upper = columns[j] >= columns[i]
            rows = 17 + columns[i][upper] - columns[j][upper]
            np.add.at(band, (rows, columns[j][upper]), (weights[i] * weights[j])[upper])
        if rhs is not None and values is not None:
            np.add.at(rhs, columns[i], weights[i] * values)

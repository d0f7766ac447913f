"""Output equations of sensors along a simulation, with their derivatives.

With the simulated velocity ν(t) from the start t₀ of a window, rotation matrix R(t), matrix of
Euler rates T(t), lever arm r, current c and bias b, the outputs are, with [a] for the matrix of
the cross product by a::

    velocity           v + [ω] r + b
    ground velocity    v + [ω] r + Rᵀ c + b
    rates              ω + b
    position           x₀ + ∫ R v dt + (t − t₀) c + R r + b
    attitude           Θ₀ + ∫ T ω dt + b
    specific force     v̇ + [ω] v + [ω̇] r + [ω] [ω] r − Rᵀ g + b

R and T are those of the recorded attitude. Integrals are trapezoidal sums over the samples of the
log; outputs are interpolated linearly between samples.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.derivatives import GRAVITY
from hydrodamp.conditioning.sensor_log import ANGULAR_KINDS
from hydrodamp.conditioning.velocity_smoother import Interpolation, interpolate_series
from hydrodamp.vehicle.mass import cross_matrix

#: First index among the offsets of a window of the pose of each kind.
POSE_OFFSETS = {"position": 0, "attitude": 3}


@dataclass(frozen=True, eq=False)
class Output:
    """One sensor: components (k, 3), values, rows, noise; indices of its parameters in θ."""

    name: str
    kind: str
    components: FloatArray
    rows: Interpolation
    values: FloatArray
    valid: BoolArray
    std: FloatArray
    lever_arm: FloatArray
    parameters: dict[str, IntArray]

    @property
    def offset(self) -> int | None:
        """The first index of its pose among the offsets of a window, None without."""
        return POSE_OFFSETS.get(self.kind)

    @property
    def freedom(self) -> IntArray:
        """The degree of freedom that each component observes, 0 to 5."""
        first = 3 if self.kind in ANGULAR_KINDS else 0
        return np.asarray(np.argmax(self.components, axis=1) + first)

    def value_of(self, name: str, theta: FloatArray, size: int) -> FloatArray:
        """Return the parameters of a name in θ, zeros if they are not estimated."""
        return theta[self.parameters[name]] if name in self.parameters else np.zeros(size)


@dataclass(frozen=True, eq=False)
class WindowMotion:
    """Simulated velocities (n, 6) of windows with their Jacobian, and the recorded attitude.

    ``time`` (n,) [s], ``rotations`` and ``angle_rates`` (n, 3, 3), ``poses`` (n, 6) at the start of
    each window, ``spans`` as of the windows.
    """

    time: FloatArray
    spans: IntArray
    velocity: FloatArray
    jacobian: FloatArray | None
    rotations: FloatArray
    angle_rates: FloatArray
    poses: FloatArray

    @property
    def elapsed(self) -> FloatArray:
        """Time since the start of the window [s]."""
        spans = self.spans
        return self.time - np.repeat(self.time[spans[:, 0]], np.diff(spans, axis=1).ravel())

    def series(self, output: Output, theta: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return an output (n, k) at the samples, without bias, and its slopes (n, k, p + 6)."""
        select, jacobian = output.components, self.jacobian
        arm = output.lever_arm + output.value_of("lever_arm", theta, 3)
        if output.kind == "position":
            series, slopes = self._integral(select @ self.rotations, 0, select)
            current = output.value_of("current", theta, 3)
            drift = np.multiply.outer(self.elapsed, current) + self.rotations @ arm
            return series + drift @ select.T, slopes
        if output.kind == "attitude":
            return self._integral(select @ self.angle_rates, 3, select)
        if output.kind == "specific_force":
            force, slopes = self._specific_force(arm)
            return force @ select.T, None if slopes is None else np.asarray(select @ slopes)
        lever = [select, -select @ cross_matrix(arm)]
        rates = [np.zeros_like(select), select]
        matrix = np.hstack(rates if output.kind == "rates" else lever)
        series = self.velocity @ matrix.T
        if output.kind == "ground_velocity":
            current = output.value_of("current", theta, 3)
            series = series + (current @ self.rotations) @ select.T
        return series, None if jacobian is None else np.asarray(np.matmul(matrix, jacobian))

    def _integral(
        self, matrices: FloatArray, first: int, select: FloatArray
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return poses at the samples: the integral of matrices times three velocities."""
        spans, axes = self.spans, slice(first, first + 3)
        rates = np.einsum("nkj,nj->nk", matrices, self.velocity[:, axes])
        series = integrate(rates, self.time, spans) + self.poses[:, axes] @ select.T
        if self.jacobian is None:
            return series, None
        return series, integrate(matrices @ self.jacobian[:, axes], self.time, spans)

    def _specific_force(self, arm: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        spans, time, jacobian = self.spans, self.time, self.jacobian
        rate = differentiate(self.velocity, time, spans)
        linear, angular = self.velocity[:, :3], self.velocity[:, 3:]
        total = linear + np.cross(angular, arm)
        force = rate[:, :3] + np.cross(angular, total) + np.cross(rate[:, 3:], arm)
        force = force - GRAVITY * self.rotations[:, 2, :]
        if jacobian is None:
            return force, None
        slope = differentiate(jacobian, time, spans)
        a, w, v = map(cross_matrix, (arm, angular, total))
        slopes = slope[:, :3] - a @ slope[:, 3:] + w @ jacobian[:, :3]
        return force, np.asarray(slopes - (v + w @ a) @ jacobian[:, 3:])

    def predict(
        self, output: Output, rows: WindowRows, theta: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return an output (m, k) at its times, and its slopes on κ, ν₀ and θ (m, k, p + 6 + g).

        Without a Jacobian of the simulation the slopes are empty.
        """
        series, slopes = self.series(output, theta)
        delay = float(output.value_of("delay", theta, 1)[0])
        rate = self._rate(series, rows)
        predicted = self._at(series, rows, delay) + output.value_of("bias", theta, 1)
        if slopes is None:
            return predicted, np.empty(0)
        width = slopes.shape[2]
        extended = np.zeros((*predicted.shape, width + len(theta)))
        extended[:, :, :width] = self._at(slopes, rows, delay)
        for name, index in output.parameters.items():
            slope = -rate[:, :, None]
            if name != "delay":
                slope = self._parameter_slopes(name, output, rows, delay)
            extended[:, :, width + index] = slope
        return predicted, extended

    def _rate(self, series: FloatArray, rows: WindowRows) -> FloatArray:
        """Return the rate of a series at the measurements."""
        upper = np.minimum(rows.lower + 1, self.spans[rows.window, 1] - 1)
        step = (self.time[upper] - self.time[upper - 1]).reshape(-1, *(1,) * (series.ndim - 1))
        return np.asarray((series[upper] - series[upper - 1]) / step)

    def _at(self, series: FloatArray, rows: WindowRows, delay: float) -> FloatArray:
        """Return a series at the measurements, to first order in their delay."""
        values = interpolate_series(series, rows.lower, rows.upper, rows.share)
        return values - delay * self._rate(series, rows) if delay else values

    def _parameter_slopes(
        self, name: str, output: Output, rows: WindowRows, delay: float
    ) -> FloatArray:
        """Return the slopes of an output on its bias, current or lever arm."""
        select = output.components
        if name == "bias":
            return np.eye(len(select))
        is_position = output.kind == "position"
        if name == "current" and is_position:
            return np.multiply.outer(self._at(self.elapsed, rows, delay), select)
        if name == "current":
            transposed = np.swapaxes(self.rotations, 1, 2)
            return np.asarray(select @ self._at(transposed, rows, delay))
        angular, spans = self.velocity[:, 3:], self.spans
        matrices = self.rotations if is_position else cross_matrix(angular)
        if output.kind == "specific_force":
            rate = differentiate(angular, self.time, spans)
            matrices = cross_matrix(rate) + matrices @ matrices
        return np.asarray(select @ self._at(matrices, rows, delay))


class WindowRows(NamedTuple):
    """Measurements of a sensor in windows: rows of the windows, their window, and index."""

    lower: IntArray
    upper: IntArray
    share: FloatArray
    window: IntArray
    number: IntArray


def rows_in_windows(bounds: IntArray, spans: IntArray, rows: Interpolation) -> WindowRows:
    """Return the measurements of a sensor in each window."""
    lower, share, last = rows.lower, rows.share, rows.upper
    first = np.searchsorted(lower, bounds[:, 0])
    stop = np.maximum(np.searchsorted(last, bounds[:, 1]), first)
    counts = stop - first
    window = np.repeat(np.arange(len(counts)), counts)
    begin = np.repeat(first - np.concatenate([[0], np.cumsum(counts)[:-1]]), counts)
    index = np.arange(counts.sum()) + begin
    shift = (spans[:, 0] - bounds[:, 0])[window]
    return WindowRows(lower[index] + shift, last[index] + shift, share[index], window, index)


def fill_gaps(simulated: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return simulated velocities with zeros after a divergence, and where that is."""
    diverged = ~np.all(np.isfinite(simulated), axis=1)
    return np.where(diverged[:, None], 0.0, simulated), diverged


def integrate(rates: FloatArray, time: FloatArray, spans: IntArray) -> FloatArray:
    """Return trapezoidal integrals (n, ...) from the start of each window."""
    step = np.diff(time).reshape(-1, *(1,) * (rates.ndim - 1))
    increments = np.zeros_like(rates)
    increments[1:] = 0.5 * step * (rates[1:] + rates[:-1])
    increments[spans[:, 0]] = 0.0
    total = np.cumsum(increments, axis=0)
    sizes = np.diff(spans, axis=1).ravel()
    return np.asarray(total - np.repeat(total[spans[:, 0]], sizes, axis=0))


def differentiate(series: FloatArray, time: FloatArray, spans: IntArray) -> FloatArray:
    """Return central differences (n, ...) in each window, one-sided at its ends."""
    n = len(series)
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[spans[:, 0]] = spans[:, 0]
    after[spans[:, 1] - 1] = spans[:, 1] - 1
    step = (time[after] - time[before]).reshape(-1, *(1,) * (series.ndim - 1))
    return np.asarray((series[after] - series[before]) / np.where(step > 0.0, step, 1.0))


def average_rows(
    columns: FloatArray, window: IntArray, n_averages: int
) -> tuple[FloatArray, IntArray]:
    """Return about n averages of successive rows of windows, times the root of their number."""
    block = len(columns) // n_averages
    if block <= 1:
        return columns, window
    starts = np.flatnonzero(np.diff(window, prepend=-1))
    position = np.arange(len(window)) - np.repeat(starts, np.diff(np.append(starts, len(window))))
    first = np.flatnonzero(position % block == 0)
    size = np.diff(np.append(first, len(window)))
    return np.add.reduceat(columns, first, axis=0) / np.sqrt(size)[:, None], window[first]

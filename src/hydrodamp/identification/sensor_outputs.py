"""Residuals of sensors at their own times over windows, in place of those of velocities.

The outputs are those of :mod:`hydrodamp.identification.output_equations`. The pose at the start of
a window is estimated like its initial velocity; biases, delays, lever arms and a current are
parameters θ of all windows. Each degree of freedom has the same total weight, as measured
velocities have.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.sensor_log import SensorLog, component_matrix
from hydrodamp.conditioning.velocity_smoother import Interpolation, angle_rate_matrices
from hydrodamp.data.attitude import rotation_matrices
from hydrodamp.data.log import Log
from hydrodamp.data.measurement import KINDS
from hydrodamp.identification.multiple_shooting import (
    AVERAGES_PER_WINDOW,
    DIVERGENCE_FACTOR,
    SAMPLES_PER_RESIDUAL,
    KnownPlant,
    LinearisedResiduals,
    ResidualSeries,
    Windows,
)
from hydrodamp.identification.output_equations import (
    Output,
    WindowMotion,
    average_rows,
    fill_gaps,
    rows_in_windows,
)
from hydrodamp.identification.parameters import Parameter, assign_parameters

#: Prior standard deviation of the pose at the start of a window over the noise of its sensor.
OFFSET_FACTOR = 30.0

#: Name of the velocities recorded at the samples of a log.
RECORDED = "recorded"


@dataclass(frozen=True, eq=False)
class SensorOutputs(KnownPlant):
    """The outputs of all sensors of a problem.

    ``rotations`` and ``angle_rates`` (n, 3, 3) belong to the samples; ``coordinates`` (n, 6) are
    the prior means of the poses at the start of a window; ``interval`` [s] is that of the slowest
    sensor.
    """

    outputs: tuple[Output, ...]
    parameters: tuple[Parameter, ...]
    rotations: FloatArray
    angle_rates: FloatArray
    coordinates: FloatArray
    offset_std: FloatArray
    interval: float = 0.0
    samples_per_residual: float = SAMPLES_PER_RESIDUAL

    @classmethod
    def of(cls, sensor_log: SensorLog, free: Sequence[str]) -> SensorOutputs:
        """Build the outputs of the sensors of a log and of its recorded velocities."""
        log, sensors = sensor_log.log, sensor_log.sensors
        parameters, indices = assign_parameters(sensor_log)
        offset_std = np.zeros(6)
        outputs = [*_recorded_outputs(log, [name for name in free if name not in sensor_log.names])]
        for sensor, index in zip(sensors, indices, strict=True):
            measurement = sensor.measurement
            output = Output(
                measurement.name, sensor.kind, component_matrix(sensor), sensor.rows,
                measurement.values, sensor.valid, sensor.std, measurement.lever_arm, index,
            )  # fmt: skip
            if output.offset is not None:
                np.maximum.at(offset_std, output.freedom, OFFSET_FACTOR * sensor.std)
            outputs.append(output)
        fallback = float(offset_std[offset_std > 0.0].min(initial=1.0))
        attitude = (
            np.tile([1.0, 0.0, 0.0, 0.0], (log.n, 1)) if log.attitude is None else log.attitude
        )
        rates = [sensor.measurement.rate for sensor in sensors]
        return cls(
            tuple(outputs),
            parameters,
            rotation_matrices(attitude),
            angle_rate_matrices(sensor_log.coordinates[:, 3:]),
            sensor_log.coordinates,
            np.where(offset_std > 0.0, offset_std, fallback),
            max((1.0 / rate for rate in rates if np.isfinite(rate)), default=0.0),
        )

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Name of each output."""
        return tuple(
            f"{output.name} {KINDS[output.kind][int(np.argmax(unit))]}"
            for output in self.outputs
            for unit in output.components
        )

    def noise_std(self, velocity_std: FloatArray, free: BoolArray) -> FloatArray:
        """Return the noise of each output, with that (f,) of recorded velocities."""
        rank = np.cumsum(free) - 1
        stds = [
            velocity_std[rank[output.freedom]] if output.name == RECORDED else output.std
            for output in self.outputs
        ]
        return np.concatenate(stds)

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return weights of the residuals: each degree of freedom has the same sum."""
        freedom = np.concatenate([output.freedom for output in self.outputs])
        total = np.bincount(freedom, counts, minlength=6)
        return np.asarray(counts.sum() / np.count_nonzero(total) / total[freedom])

    @cached_property
    def counts(self) -> FloatArray:
        """Number of values of each output, at least one."""
        numbers = np.concatenate([output.valid.sum(axis=0) for output in self.outputs])
        return np.maximum(numbers.astype(np.float64), 1.0)

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""
        length = int(np.median(np.diff(windows.bounds, axis=1)))
        return 4 * 6 * length * (len(windows.entries[0]) + 6)

    def select(self, samples: IntArray) -> SensorOutputs:
        """Return the outputs of some samples, in successive runs."""
        rank = np.full(len(self.rotations), -2)
        rank[samples] = np.arange(len(samples))
        outputs = []
        for output in self.outputs:
            lower, share, _ = output.rows
            first, second = rank[lower], rank[np.minimum(lower + 1, len(rank) - 1)]
            is_sample = (share == 0.0) & (first >= 0)
            rows = np.flatnonzero(((first >= 0) & (second == first + 1)) | is_sample)
            rows = rows[np.argsort(first[rows] + share[rows], kind="stable")]
            inside = np.ones(len(rows), dtype=bool)
            selected = Interpolation(first[rows], share[rows], inside)
            values, valid = output.values[rows], output.valid[rows]
            outputs.append(replace(output, rows=selected, values=values, valid=valid))
        return replace(
            self,
            outputs=tuple(outputs),
            rotations=self.rotations[samples],
            angle_rates=self.angle_rates[samples],
            coordinates=self.coordinates[samples],
        )

    def _motion(
        self, windows: Windows, velocity: FloatArray, jacobian: FloatArray | None
    ) -> WindowMotion:
        samples, spans = windows.samples, windows.spans
        start = np.repeat(samples[spans[:, 0]], np.diff(spans, axis=1).ravel())
        attitude = self.rotations[samples], self.angle_rates[samples]
        times = windows.inputs.time, spans
        return WindowMotion(*times, velocity, jacobian, *attitude, self.coordinates[start])

    def _residuals(
        self, windows: Windows, parameters: FloatArray
    ) -> Iterator[tuple[Output, BoolArray, ResidualSeries]]:
        """Yield each sensor, which of its values are valid, and residuals, NaN once diverged."""
        velocity, diverged = fill_gaps(windows.simulate(parameters))
        motion, theta = self._motion(windows, velocity, None), parameters[len(windows.entries[0]) :]
        for output in self.outputs:
            rows = rows_in_windows(windows.bounds, windows.spans, output.rows)
            residuals = output.values[rows.number] - motion.predict(output, rows, theta)[0]
            residuals[diverged[rows.lower]] = np.nan
            moments = (1.0 - rows.share) * motion.time[rows.lower]
            moments = moments + rows.share * motion.time[rows.upper]
            yield output, output.valid[rows.number], ResidualSeries(rows.window, moments, residuals)

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield measured minus simulated outputs, a large value after a divergence."""
        for output, is_valid, (window, time, residuals) in self._residuals(windows, parameters):
            filled = np.where(np.isnan(residuals), divergence_residual(output), residuals)
            for column, valid in enumerate(is_valid.T):
                series = filled[valid, column : column + 1]
                yield ResidualSeries(window[valid], time[valid], series)

    def averages(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> FloatArray:
        """Return the averages of a linearisation without slopes, NaN after a divergence."""
        n_averages = len(windows.spans) * AVERAGES_PER_WINDOW
        blocks: list[tuple[FloatArray, IntArray]] = []
        for _, is_valid, (window, _, residuals) in self._residuals(windows, parameters):
            for column, valid in enumerate(is_valid.T):
                series, std = residuals[valid, column : column + 1], residual_std[len(blocks)]
                averaged, number = average_rows(series, window[valid], n_averages)
                blocks.append((averaged[:, 0] / std, number))
        stacked, numbers = (np.concatenate(each) for each in zip(*blocks, strict=True))
        return np.asarray(stacked[np.argsort(numbers, kind="stable")])

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals; diverged and too sensitive windows become zero."""
        n_windows, n = len(windows.spans), len(residual_std)
        raw, jacobian = windows.linearise_simulation(parameters, 1)
        velocity, diverged = fill_gaps(raw)
        ends = windows.spans[:, 1] - 1
        deviation = windows.problem.inputs.velocity[windows.samples[ends]] - raw[ends]
        regular = np.ones(n_windows, dtype=bool)
        regular[windows.irregular(parameters, deviation, jacobian[ends])] = False
        jacobian[diverged] = 0.0
        motion, theta = (
            self._motion(windows, velocity, jacobian),
            parameters[len(windows.entries[0]) :],
        )
        n_averages = n_windows * AVERAGES_PER_WINDOW
        blocks: list[tuple[FloatArray, IntArray, IntArray]] = []
        square, number, first = np.zeros(n), np.zeros(n), 0
        for output in self.outputs:
            rows = rows_in_windows(windows.bounds, windows.spans, output.rows)
            prediction = motion.predict(output, rows, theta)
            columns = _columns(output, rows.number, prediction, windows, theta)
            late, valid = diverged[rows.lower], output.valid[rows.number]
            residuals = np.where(late[:, None], divergence_residual(output), columns[:, :, -1])
            for column in range(len(output.components)):
                index, used = first + column, valid[:, column]
                square[index] = float(np.sum(residuals[used, column] ** 2))
                number[index] = np.count_nonzero(used)
                chosen = np.flatnonzero(used)
                averaged, window = average_rows(
                    columns[chosen, column], rows.window[chosen], n_averages
                )
                averaged = averaged * regular[window, None]
                label = np.full(len(window), index)
                blocks.append((averaged / residual_std[index], window, label))
            first += len(output.components)
        stacked, window, label = (np.concatenate(each) for each in zip(*blocks, strict=True))
        order = np.argsort(window, kind="stable")
        edges = np.searchsorted(window[order], np.arange(n_windows + 1))
        return LinearisedResiduals(stacked[order], edges, label[order], square, number)


def _columns(
    output: Output,
    number: IntArray,
    prediction: tuple[FloatArray, FloatArray],
    windows: Windows,
    theta: FloatArray,
) -> FloatArray:
    """Return the columns [B A ε] (m, k, f + q + 1) of the values of one sensor.

    A has the coefficients, the parameters of the sensors, then those of the plant.
    """
    predicted, slopes = prediction
    n, free = len(windows.entries[0]), windows.free
    f, width = len(windows.initial_state_std), slopes.shape[2]
    p = width - 6 - len(theta)
    order = [*range(n), *range(p + 6, width), *range(n, p)]
    columns = np.zeros((*predicted.shape, f + p + len(theta) + 1))
    columns[:, :, : len(free)] = slopes[:, :, p + free]
    columns[:, :, f:-1] = slopes[:, :, order]
    if output.offset is not None:
        start = len(free) + output.offset
        columns[:, :, start : start + 3] = output.components
    columns[:, :, -1] = output.values[number] - predicted
    return columns


def divergence_residual(output: Output) -> FloatArray:
    """Return the residual of each component of a diverged simulation, (k,)."""
    values = np.where(output.valid, output.values, np.nan)
    spread = [np.nanstd(column) if np.isfinite(column).any() else 1.0 for column in values.T]
    return DIVERGENCE_FACTOR * np.array(spread)


def _recorded_outputs(log: Log, names: Sequence[str]) -> Iterator[Output]:
    """Yield the velocities recorded at the samples of the log, as sensors."""
    rows = Interpolation(np.arange(log.n), np.zeros(log.n), np.ones(log.n, dtype=bool))
    for kind in ("velocity", "rates"):
        chosen = [name for name in KINDS[kind] if name in names]
        if chosen:
            values = log.velocity[:, [VELOCITIES.index(name) for name in chosen]]
            components = np.eye(3)[[KINDS[kind].index(name) for name in chosen]]
            valid, std = np.ones(values.shape, dtype=bool), np.ones(len(chosen))
            yield Output(RECORDED, kind, components, rows, values, valid, std, np.zeros(3), {})

"""Residuals of the velocities of windows: sensor errors, white or coloured.

With the measured velocity y and the simulated ν, r = y − ν. Where the errors of successive samples
have the correlation a, the residuals are innovations::

    e_t = r_t − a r_(t−1),    e_0 = sqrt(1 − a²) r_0
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.multiple_shooting import (
    AVERAGES_PER_WINDOW,
    DIVERGENCE_FACTOR,
    LinearisedResiduals,
    Outputs,
    ResidualSeries,
    Windows,
)
from hydrodamp.identification.parameters import Parameter


@dataclass(frozen=True)
class VelocityOutputs:
    """The velocities of the free axes at the samples of the log, with the correlations a (f,)."""

    interval: float = 0.0
    parameters: tuple[Parameter, ...] = ()
    correlation: tuple[float, ...] = ()

    def with_base(self, base: Outputs) -> Outputs:
        """Return other outputs."""
        return base

    def apply_plant(self, windows: Windows, parameters: FloatArray) -> tuple[Windows, FloatArray]:
        """Return windows and parameters: these are not of plant and inputs."""
        return windows, parameters

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""
        length = float(np.median(np.diff(windows.bounds, axis=1)))
        rows = length if self.correlation else min(2 * AVERAGES_PER_WINDOW, length)
        return 6 * int(rows) * (len(windows.entries[0]) + 6)

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return ones: the velocities have the same number of residuals."""
        return np.ones(len(counts))

    def select(self, samples: IntArray) -> VelocityOutputs:
        """Return the outputs of some samples."""
        return self

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield measured minus simulated velocity (n, f), a large value after a divergence."""
        window = np.repeat(np.arange(len(windows.spans)), np.diff(windows.spans, axis=1).ravel())
        residuals = self._residuals(windows, windows.simulate(parameters))
        yield ResidualSeries(window, windows.time, self._innovations(residuals, windows.spans))

    def _innovations(self, series: FloatArray, spans: IntArray) -> FloatArray:
        """Turn series (n, f, ...) of concatenated windows into innovations, in place."""
        if self.correlation:
            a = np.reshape(self.correlation, (-1,) + (1,) * (series.ndim - 2))
            initial = np.sqrt(1.0 - a**2) * series[spans[:, 0]]
            series[1:] -= a * series[:-1]
            series[spans[:, 0]] = initial
        return series

    def _residuals(self, windows: Windows, simulated: FloatArray) -> FloatArray:
        measured = windows.problem.inputs.velocity[:, windows.free]
        residuals = measured[windows.samples] - simulated[:, windows.free]
        largest = np.abs(measured).max(axis=0)
        return np.where(np.isnan(residuals), DIVERGENCE_FACTOR * largest, residuals)

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals; diverged and too sensitive windows become zero."""
        p, free, block = len(parameters), windows.free, self._block(windows)
        f = len(free)
        simulated, jacobian = windows.linearise_simulation(parameters, block)
        residuals, first = self._average(windows, simulated)
        edges = np.searchsorted(first, np.append(windows.spans[:, 0], len(simulated)))
        end = edges[1:] - 1  # what grows in a window is largest at its end
        ends = residuals[end] / np.sqrt(block), jacobian[end] / np.sqrt(block)
        if f < 6:
            residuals, jacobian = residuals[:, free], jacobian[:, free]
        columns, weight = np.empty((len(first), f, f + p + 1)), 1.0 / residual_std
        np.multiply(jacobian[:, :, p + free], weight[:, None], out=columns[:, :, :f])
        np.multiply(jacobian[:, :, :p], weight[:, None], out=columns[:, :, f:-1])
        np.multiply(residuals, weight, out=columns[:, :, -1])
        for window in windows.irregular(parameters, *ends):
            columns[edges[window] : edges[window + 1]] = 0.0
        rows = self._innovations(columns, windows.spans).reshape(-1, columns.shape[2])
        innovations = self._innovations(self._residuals(windows, simulated), windows.spans)
        square, n_samples = np.sum(innovations**2, axis=0), np.full(f, float(len(simulated)))
        output = np.tile(np.arange(f), len(first))
        return LinearisedResiduals(rows, f * edges, output, square, n_samples)

    def averages(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> FloatArray:
        """Return the averages of a linearisation without slopes, NaN after a divergence."""
        averages, _ = self._average(windows, windows.simulate(parameters))
        innovations = self._innovations(averages[:, windows.free], windows.spans)
        return np.asarray(innovations / residual_std).ravel()

    def _block(self, windows: Windows) -> int:
        """Return the samples of an average."""
        size = int(np.median(np.diff(windows.bounds, axis=1)))
        return 1 if self.correlation else max(size // AVERAGES_PER_WINDOW, 1)

    def _average(self, windows: Windows, simulated: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return sums of residuals over the root of their number (m, 6), and their first rows."""
        block = self._block(windows)
        first = np.concatenate([np.arange(start, stop, block) for start, stop in windows.spans])
        count = np.sqrt(np.diff(np.append(first, len(simulated))))[:, None]
        residuals = windows.problem.inputs.velocity[windows.samples] - simulated
        return np.asarray(np.add.reduceat(residuals, first, axis=0) / count), first


def velocity_residuals(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Return measured minus simulated velocity (n, f), a large value after a divergence."""
    (series,) = VelocityOutputs().residuals(windows, parameters)
    return series.residuals

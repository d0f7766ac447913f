"""Multiple shooting without matching constraints: simulation errors of independent windows.

With residuals ε (measured minus simulated velocity) and their Jacobians A on the coefficients and
B on the initial state, all over the residual standard deviations, a window contributes ``|ε − A Δκ
− B δ|² + |P^(−1/2) δ|²`` with the prior covariance P of its initial state. The initial state of
each window is estimated; its correction δ is eliminated by a Schur complement.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.parameters import Parameter
from hydrodamp.identification.regression import update_factor
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Inputs, PlantSlopes
from hydrodamp.simulation.problem import Problem

#: Longest Runge-Kutta step over the time scale of the motion.
MAX_RELATIVE_STEP = 1.0 / 16.0

#: Averages of the residuals in each window, from which the normal equations are built.
AVERAGES_PER_WINDOW = 10

#: Samples per independent residual [1]: the weight of an initial state against the residuals.
SAMPLES_PER_RESIDUAL = 16.0

#: Entries of the Jacobian in memory at once: 32 MB.
MAX_JACOBIAN_ENTRIES = 4_000_000

#: Residual of a diverged window, and bound of a sensitive one, over the largest measured velocity.
DIVERGENCE_FACTOR = 5.0

#: Relative change of a coefficient [1] that must not move a window beyond that bound.
COEFFICIENT_CHANGE = 1e-4


@factorisation("normal matrix of initial states")
def initial_state_gains(cross: FloatArray, initial_state_std: FloatArray) -> FloatArray:
    """Return the gains (BᵀB + P⁻¹)⁻¹BᵀC (m, f, q) of m windows from Bᵀ[B C] (m, f, f + q)."""
    f = len(initial_state_std)
    normal = cross[:, :, :f] + np.diag(initial_state_std**-2.0)
    return np.asarray(np.linalg.solve(normal, cross[:, :, f:]), dtype=np.float64)


class LinearisedResiduals(NamedTuple):
    """Weighted averages of residuals of some windows, with their Jacobians.

    ``columns`` (m, f + q + 1) are [B A ε], ``edges`` the first rows of the windows and the end,
    ``output`` (m,) the output of each row; ``square`` and ``number`` (n_outputs,) are sums of
    squares and numbers of the residuals before averaging and weighting.
    """

    columns: FloatArray
    edges: IntArray
    output: IntArray
    square: FloatArray
    number: FloatArray


class ResidualSeries(NamedTuple):
    """Residuals (n, k) of outputs that share their times [s] and windows, (n,) each."""

    window: IntArray
    time: FloatArray
    residuals: FloatArray


class Outputs(Protocol):
    """What the simulation of windows is compared with."""

    @property
    def interval(self) -> float:
        """Sampling interval of the slowest sensor [s], zero for the samples of the log."""

    @property
    def parameters(self) -> Sequence[Parameter]:
        """Parameters that all windows share."""

    @property
    def samples_per_residual(self) -> float:
        """Samples per independent residual."""

    def with_base(self, base: Outputs) -> Outputs:
        """Return other outputs, with the same parameters of plant and inputs."""

    def apply_plant(self, windows: Windows, parameters: FloatArray) -> tuple[Windows, FloatArray]:
        """Return windows with plant and inputs at their parameters, and the other parameters."""

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return weights of the residuals of each output, with a mean of one."""

    def select(self, samples: IntArray) -> Outputs:
        """Return the outputs of some samples, in successive runs."""

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals; diverged and too sensitive windows become zero."""

    def averages(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> FloatArray:
        """Return the averages (m,) of a linearisation without slopes, NaN after a divergence."""

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield measured minus simulated outputs, a large value after a divergence."""


class EliminatedWindows(NamedTuple):
    """Rows [A ε] of m windows with their edges, BᵀC (m, f, q), and gains of the initial states."""

    rows: FloatArray
    edges: IntArray
    cross: FloatArray
    gains: FloatArray

    def normal(self, first: int, stop: int) -> FloatArray:
        """Return the sum of the Schur complements of successive windows, (q, q)."""
        rows, windows = self.rows[self.edges[first] : self.edges[stop]], slice(first, stop)
        correction = np.tensordot(self.cross[windows], self.gains[windows], ((0, 1), (0, 1)))
        return np.asarray(rows.T @ rows - correction, dtype=np.float64)

    def residuals(self, linearised: LinearisedResiduals) -> FloatArray:
        """Return the averages of the residuals of a chunk at the optimal initial states."""
        columns, shift = linearised.columns, self.gains[:, :, -1]
        each = np.repeat(shift, np.diff(linearised.edges), axis=0)
        return np.asarray(columns[:, -1] - np.sum(columns[:, : each.shape[1]] * each, axis=1))


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of a log: rows (first, one past the last) of ``bounds``, initial states (n, 6).

    ``length`` and ``max_step``, the longest Runge-Kutta step, are times [s];
    ``initial_state_std`` (f,) is the prior standard deviation of the free axes, then of the
    offsets that the outputs add.
    """

    length: float
    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    bounds: IntArray
    initial_states: FloatArray
    initial_state_std: FloatArray
    max_step: float
    outputs: Outputs
    slopes: PlantSlopes | None = None  # at each sample of the problem

    @cached_property
    def spans(self) -> IntArray:
        """First row of each window and one past its last, windows concatenated."""
        return concatenate_bounds(self.bounds)

    @cached_property
    def samples(self) -> IntArray:
        """Sample of the log of each row."""
        return sample_indices(self.bounds)

    @cached_property
    def chunks(self) -> tuple[Windows, ...]:
        """The windows in chunks that are linearised at once."""
        size = max(MAX_JACOBIAN_ENTRIES // self.outputs.jacobian_entries(self), 1)
        firsts = range(0, len(self.bounds), size)
        return tuple(self.select(slice(first, first + size)) for first in firsts)

    @cached_property
    def inputs(self) -> Inputs:
        """Inputs of the simulation of all windows."""
        velocity = self.problem.inputs.velocity[self.samples]
        velocity[self.spans[:, 0]] = self.initial_states
        return self.problem.inputs.select(self.samples, velocity)

    @property
    def plant_slopes(self) -> PlantSlopes | None:
        """Slopes of plant and inputs on further parameters, of the simulation of all windows."""
        return None if self.slopes is None else self.slopes.select(self.samples)

    @cached_property
    def free(self) -> IntArray:
        """Indices of the free axes."""
        return np.flatnonzero(self.problem.vehicle.free)

    def select(self, index: slice | IntArray) -> Windows:
        """Return some of the windows."""
        return replace(self, bounds=self.bounds[index], initial_states=self.initial_states[index])

    def simulate(self, parameters: FloatArray) -> FloatArray:
        """Return the simulated velocities (n, 6)."""
        equations = self.problem.equations
        matrix = equations.with_unknown(self.entries, parameters[: len(self.entries[0])])
        arguments = equations.plant, matrix, self.inputs, self.spans
        return core.replay(*arguments, max_step=self.max_step)[0]

    def linearise_simulation(
        self, parameters: FloatArray, block: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return simulated velocities (n, 6) and their Jacobian, averaged over blocks."""
        equations = self.problem.equations
        matrix = equations.with_unknown(self.entries, parameters[: len(self.entries[0])])
        arguments = equations.plant, matrix, self.inputs, self.spans, self.entries
        simulated, _, jacobian = core.replay(
            *arguments, max_step=self.max_step, block=block, slopes=self.plant_slopes
        )
        return simulated, jacobian

    def block_normal_matrices(
        self, coefficients: FloatArray, residual_std: FloatArray, block_of_window: IntArray
    ) -> FloatArray:
        """Return the normal matrices of [A ε] of successive blocks, (n_blocks, p + 1, p + 1)."""
        p, first = len(coefficients), 0
        normals = np.zeros((block_of_window[-1] + 1, p + 1, p + 1))
        for _, eliminated in self._eliminate(coefficients, residual_std):
            block = block_of_window[first : first + len(eliminated.gains)]
            for number in np.unique(block):
                run = np.flatnonzero(block == number)
                normals[number] += eliminated.normal(run[0], run[-1] + 1)
            first += len(block)
        return normals

    def linearise(
        self, coefficients: FloatArray, residual_std: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return normal matrix of [A ε], mean square residuals, and state correction.

        Initial states are optimal. The mean squares are over the residuals of each output, the
        matrix (q + 1, q + 1) and the squared correction δᵀP⁻¹δ over all residuals.
        """
        q, n = len(coefficients), len(residual_std)
        normal, correction = np.zeros((q + 1, q + 1)), 0.0
        square, count = np.zeros(n), np.zeros(n)
        for linearised, eliminated in self._eliminate(coefficients, residual_std):
            normal += eliminated.normal(0, len(eliminated.gains))
            change = linearised.columns[:, -1] ** 2 - eliminated.residuals(linearised) ** 2
            reduction = np.bincount(linearised.output, change, n)
            square += linearised.square - reduction * residual_std**2
            count += linearised.number
            shift = eliminated.gains[:, :, q]
            correction += float(np.sum((shift / self.initial_state_std) ** 2))
        total = count.sum()
        return normal / total, square / np.maximum(count, 1.0), correction / total

    def optimal_residuals(
        self, coefficients: FloatArray, residual_std: FloatArray
    ) -> Iterator[tuple[LinearisedResiduals, FloatArray]]:
        """Yield each chunk with its averages of residuals at optimal initial states."""
        for linearised, eliminated in self._eliminate(coefficients, residual_std):
            yield linearised, eliminated.residuals(linearised)

    def _eliminate(
        self, coefficients: FloatArray, residual_std: FloatArray
    ) -> Iterator[tuple[LinearisedResiduals, EliminatedWindows]]:
        """Linearise each chunk and eliminate the initial states of its windows."""
        f = len(self.initial_state_std)
        for windows in self.chunks:
            linearised = windows.outputs.linearise(windows, coefficients, residual_std)
            columns, edges = linearised.columns, linearised.edges
            cross = np.array([columns[a:b, :f].T @ columns[a:b] for a, b in pairwise(edges)])
            gains = initial_state_gains(cross, self.initial_state_std)
            yield linearised, EliminatedWindows(columns[:, f:], edges, cross[:, :, f:], gains)

    def qr_factor(self, coefficients: FloatArray, residual_std: FloatArray) -> FloatArray:
        """Return the R factor of [A ε] with fixed initial states; it keeps more digits."""
        q, f = len(coefficients), len(self.initial_state_std)
        factor: FloatArray = np.zeros((q + 1, q + 1))
        for windows in self.chunks:
            linearised = windows.outputs.linearise(windows, coefficients, residual_std)
            factor = update_factor(factor, linearised.columns[:, f:])
        return factor

    def irregular(
        self, coefficients: FloatArray, deviation: FloatArray, slopes: FloatArray
    ) -> IntArray:
        """Return the windows that diverge or whose end is too sensitive.

        ``deviation`` (m, 6) and ``slopes`` (m, 6, p + 6) are those of the velocity at the ends.
        """
        p, free = slopes.shape[2] - 6, self.free
        bound = DIVERGENCE_FACTOR * np.abs(self.problem.inputs.velocity).max(axis=0)
        change = np.zeros(p + 6)
        n = len(self.entries[0])
        change[:n] = np.abs(COEFFICIENT_CHANGE * coefficients[:n])
        change[p + free] = self.initial_state_std[: len(free)]
        sensitivity = np.max(np.abs(slopes) * change, axis=2)
        regular = np.maximum(np.abs(deviation), sensitivity) <= bound  # False for NaN
        return np.flatnonzero(~np.all(regular[:, free], axis=1))


def concatenate_bounds(bounds: IntArray) -> IntArray:
    """Return the bounds of intervals of a log after they are concatenated."""
    ends = np.cumsum(np.diff(bounds, axis=1).ravel())
    return np.column_stack([np.append(0, ends[:-1]), ends])


def sample_indices(bounds: IntArray) -> IntArray:
    """Return the samples of intervals of a log, concatenated."""
    return np.concatenate([np.arange(start, stop) for start, stop in bounds.tolist()])


class KnownPlant:
    """Outputs whose parameters are not of plant and inputs."""

    def with_base(self, base: Outputs) -> Outputs:
        """Return other outputs."""
        return base

    def apply_plant(self, windows: Windows, parameters: FloatArray) -> tuple[Windows, FloatArray]:
        """Return windows and parameters: these are not of plant and inputs."""
        return windows, parameters


@dataclass(frozen=True)
class VelocityOutputs(KnownPlant):
    """The velocities of the free axes at the samples of the log."""

    interval: float = 0.0
    parameters: tuple[Parameter, ...] = ()
    samples_per_residual: float = SAMPLES_PER_RESIDUAL

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""
        length = float(np.median(np.diff(windows.bounds, axis=1)))
        rows = int(min(2 * AVERAGES_PER_WINDOW, length))
        return 6 * rows * (len(windows.entries[0]) + 6)

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return ones: the velocities have the same number of residuals."""
        return np.ones(len(counts))

    def select(self, samples: IntArray) -> VelocityOutputs:
        """Return the outputs of some samples."""
        return self

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield measured minus simulated velocity (n, f), a large value after a divergence."""
        spans, time = windows.spans, windows.inputs.time
        window = np.repeat(np.arange(len(spans)), np.diff(spans, axis=1).ravel())
        yield ResidualSeries(window, time, self._residuals(windows, windows.simulate(parameters)))

    def _residuals(self, windows: Windows, simulated: FloatArray) -> FloatArray:
        measured = windows.problem.inputs.velocity[:, windows.free]
        residuals = measured[windows.samples] - simulated[:, windows.free]
        largest = np.abs(measured).max(axis=0)
        return np.where(np.isnan(residuals), DIVERGENCE_FACTOR * largest, residuals)

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals; diverged and too sensitive windows become zero."""
        free, block = windows.free, self._block(windows)
        simulated, jacobian = windows.linearise_simulation(parameters, block)
        f, p = len(free), jacobian.shape[2] - 6
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
        rows = columns.reshape(-1, columns.shape[2])
        square = np.sum(self._residuals(windows, simulated) ** 2, axis=0)
        n_samples = np.full(f, float(len(simulated)))
        output = np.tile(np.arange(f), len(first))
        return LinearisedResiduals(rows, f * edges, output, square, n_samples)

    def averages(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> FloatArray:
        """Return the averages of a linearisation without slopes, NaN after a divergence."""
        averages, _ = self._average(windows, windows.simulate(parameters))
        return np.asarray(averages[:, windows.free] / residual_std).ravel()

    def _block(self, windows: Windows) -> int:
        """Return the samples of an average."""
        size = int(np.median(np.diff(windows.bounds, axis=1)))
        return max(size // AVERAGES_PER_WINDOW, 1)

    def _average(self, windows: Windows, simulated: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return sums of residuals over the root of their number (m, 6), and their first rows."""
        block = self._block(windows)
        first = np.concatenate([np.arange(start, stop, block) for start, stop in windows.spans])
        count = np.sqrt(np.diff(np.append(first, len(simulated))))[:, None]
        residuals = windows.problem.inputs.velocity[windows.samples] - simulated
        return np.asarray(np.add.reduceat(residuals, first, axis=0) / count), first

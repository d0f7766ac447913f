"""Multiple shooting without matching constraints: simulation errors of independent windows.

With residuals ε (measured minus simulated velocity) and their Jacobians A on the coefficients and
B on the initial state, all over the residual standard deviations, a window contributes ``|ε − A Δκ
− B δ|² + |P^(−1/2) δ|²`` with the prior covariance P of its initial state. The initial state of
each window is estimated; its correction δ is eliminated by a Schur complement.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.regression import update_factor
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Inputs
from hydrodamp.simulation.problem import Problem

#: Longest Runge-Kutta step over the time scale of the motion.
MAX_RELATIVE_STEP = 1.0 / 16.0

#: Shortest window [sampling steps].
MIN_WINDOW_STEPS = 4

#: Averages of the residuals in each window, from which the normal equations are built.
AVERAGES_PER_WINDOW = 10

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


def eliminate_initial_states(normal: FloatArray, initial_state_std: FloatArray) -> FloatArray:
    """Return the Schur complements CᵀC − CᵀB·gain (m, q, q) from [B C]ᵀ[B C] of m windows."""
    f = len(initial_state_std)
    gains = initial_state_gains(normal[:, :f], initial_state_std)
    return np.asarray(normal[:, f:, f:] - normal[:, f:, :f] @ gains, dtype=np.float64)


class LinearisedResiduals(NamedTuple):
    """Weighted averages of residuals (m,) and Jacobian [A B] (m, p + 6) of some windows.

    ``edges`` are the first rows of the windows and the end; ``simulated`` is their simulation.
    """

    jacobian: FloatArray
    residuals: FloatArray
    edges: IntArray
    simulated: FloatArray


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


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows of a log: rows (first, one past the last) of ``bounds``, initial states (n, 6).

    ``length`` and ``max_step``, the longest Runge-Kutta step, are times [s];
    ``initial_state_std`` (f,) is the prior standard deviation of the free axes.
    """

    length: float
    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    bounds: IntArray
    initial_states: FloatArray
    initial_state_std: FloatArray
    max_step: float

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
        entries_per_window = 6 * 2 * AVERAGES_PER_WINDOW * (len(self.entries[0]) + 6)
        size = max(MAX_JACOBIAN_ENTRIES // entries_per_window, 1)
        firsts = range(0, len(self.bounds), size)
        return tuple(self.select(slice(first, first + size)) for first in firsts)

    @cached_property
    def inputs(self) -> Inputs:
        """Inputs of the simulation of all windows."""
        velocity = self.problem.inputs.velocity[self.samples]
        velocity[self.spans[:, 0]] = self.initial_states
        return self.problem.inputs.select(self.samples, velocity)

    @cached_property
    def free(self) -> IntArray:
        """Indices of the free axes."""
        return np.flatnonzero(self.problem.vehicle.free)

    def select(self, index: slice | IntArray) -> Windows:
        """Return some of the windows."""
        return replace(self, bounds=self.bounds[index], initial_states=self.initial_states[index])

    def residuals(self, coefficients: FloatArray) -> FloatArray:
        """Return measured minus simulated velocity (n, f), a large value after a divergence."""
        equations = self.problem.equations
        matrix = equations.with_unknown(self.entries, coefficients)
        arguments = equations.plant, matrix, self.inputs, self.spans
        return self._residuals(core.replay(*arguments, max_step=self.max_step)[0])

    def _residuals(self, simulated: FloatArray) -> FloatArray:
        measured = self.problem.inputs.velocity[:, self.free]
        residuals = measured[self.samples] - simulated[:, self.free]
        largest = np.abs(measured).max(axis=0)
        return np.where(np.isnan(residuals), DIVERGENCE_FACTOR * largest, residuals)

    def block_normal_matrices(
        self, coefficients: FloatArray, residual_std: FloatArray, block_of_window: IntArray
    ) -> FloatArray:
        """Return the normal matrices of [A ε] of successive blocks, (n_blocks, p + 1, p + 1)."""
        p, first = len(coefficients), 0
        normals = np.zeros((block_of_window[-1] + 1, p + 1, p + 1))
        for windows in self.chunks:
            eliminated = windows._eliminate(windows._linearise_chunk(coefficients, residual_std))
            block = block_of_window[first : first + len(eliminated.gains)]
            for number in np.unique(block):
                run = np.flatnonzero(block == number)
                normals[number] += eliminated.normal(run[0], run[-1] + 1)
            first += len(block)
        return normals

    def linearise(
        self, coefficients: FloatArray, residual_std: FloatArray
    ) -> tuple[FloatArray, FloatArray, float]:
        """Return normal matrix of [A ε], mean square residuals (f,), and state correction.

        Initial states are optimal. Means over samples; the matrix (p + 1, p + 1) and the squared
        correction δᵀP⁻¹δ are means over velocities, too.
        """
        p, free = len(coefficients), self.free
        normal, square, correction = np.zeros((p + 1, p + 1)), np.zeros(len(free)), 0.0
        for windows in self.chunks:
            linearised = windows._linearise_chunk(coefficients, residual_std)
            jacobian, residuals, edges, simulated = linearised
            eliminated = windows._eliminate(linearised)
            normal += eliminated.normal(0, len(eliminated.gains))
            shift = eliminated.gains[:, :, p]
            change = jacobian[:, p + free] * np.repeat(shift, np.diff(edges), axis=0)
            corrected = residuals - np.sum(change, axis=1)
            reduction = (residuals**2 - corrected**2).reshape(-1, 6).sum(axis=0)[free]
            square += np.sum(windows._residuals(simulated) ** 2, axis=0)
            square -= reduction * residual_std**2
            correction += float(np.sum((shift / self.initial_state_std) ** 2))
        n = len(self.samples)
        return normal / n / len(free), square / n, correction / n / len(free)

    def _eliminate(self, linearised: LinearisedResiduals) -> EliminatedWindows:
        """Eliminate the initial states of the windows of a chunk."""
        jacobian, residuals, edges, _ = linearised
        p, f = jacobian.shape[1] - 6, len(self.free)
        columns = np.column_stack([jacobian[:, p + self.free], jacobian[:, :p], residuals])
        bounds = pairwise(edges)
        cross = np.array([columns[a:b, :f].T @ columns[a:b] for a, b in bounds])
        gains = initial_state_gains(cross, self.initial_state_std)
        return EliminatedWindows(columns[:, f:], edges, cross[:, :, f:], gains)

    def qr_factor(self, coefficients: FloatArray, residual_std: FloatArray) -> FloatArray:
        """Return the R factor of [A ε] with fixed initial states; it keeps more digits."""
        p = len(coefficients)
        factor: FloatArray = np.zeros((p + 1, p + 1))
        for windows in self.chunks:
            jacobian, residuals, *_ = windows._linearise_chunk(coefficients, residual_std)
            factor = update_factor(factor, np.column_stack([jacobian[:, :p], residuals]))
        return factor

    def _linearise_chunk(
        self, coefficients: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise averages of the residuals; diverged and too sensitive windows become zero."""
        equations, p, free = self.problem.equations, len(coefficients), self.free
        block = max(int(np.median(np.diff(self.bounds, axis=1))) // AVERAGES_PER_WINDOW, 1)
        matrix = equations.with_unknown(self.entries, coefficients)
        arguments = equations.plant, matrix, self.inputs, self.spans, self.entries
        simulated, _, jacobian = core.replay(*arguments, max_step=self.max_step, block=block)
        first = np.concatenate([np.arange(start, stop, block) for start, stop in self.spans])
        edges = np.searchsorted(first, np.append(self.spans[:, 0], len(simulated)))
        count = np.diff(np.append(first, len(simulated)))
        residuals = self.problem.inputs.velocity[self.samples] - simulated
        residuals = np.add.reduceat(residuals, first, axis=0) / np.sqrt(count)[:, None]
        weight = np.zeros(6)
        weight[free] = 1.0 / residual_std
        jacobian *= weight[:, None]
        residuals *= weight
        largest = np.abs(self.problem.inputs.velocity).max(axis=0)
        bound = DIVERGENCE_FACTOR * largest * weight * np.sqrt(block)
        change = np.zeros(p + 6)
        change[:p] = np.abs(COEFFICIENT_CHANGE * coefficients)
        change[p + free] = self.initial_state_std
        end = edges[1:] - 1  # what grows in a window is largest at its end
        sensitivity = np.max(np.abs(jacobian[end]) * change, axis=2)
        regular = np.maximum(np.abs(residuals[end]), sensitivity) <= bound  # False for NaN
        for window in np.flatnonzero(~np.all(regular, axis=1)):
            rows = slice(edges[window], edges[window + 1])
            residuals[rows] = jacobian[rows] = 0.0
        jacobian = jacobian.reshape(-1, p + 6)
        return LinearisedResiduals(jacobian, residuals.ravel(), 6 * edges, simulated)


def split_windows(problem: Problem, length: float) -> IntArray:
    """Return the bounds of windows of a length [s] that cover every segment with least overlap."""
    windows, length = [], max(length, MIN_WINDOW_STEPS * median_step(problem))
    for start, stop in problem.segments.tolist():
        time = problem.inputs.time[start:stop]
        room = time[-1] - time[0] - length
        if not room > 0.0:
            windows.append((start, stop))
            continue
        begin = time[0] + np.linspace(0.0, room, int(np.ceil(room / length - 1e-6)) + 1)
        rounding = 1e-6 * length  # of the clock
        first = start + np.searchsorted(time, begin - rounding)
        last = start + np.searchsorted(time, begin + length + rounding, side="right")
        windows += zip(first, last, strict=True)
    bounds = np.array(windows, dtype=np.int64).reshape(-1, 2)
    return bounds[bounds[:, 0] < bounds[:, 1]]  # a window without samples lies in a gap


def concatenate_bounds(bounds: IntArray) -> IntArray:
    """Return the bounds of intervals of a log after they are concatenated."""
    ends = np.cumsum(np.diff(bounds, axis=1).ravel())
    return np.column_stack([np.append(0, ends[:-1]), ends])


def sample_indices(bounds: IntArray) -> IntArray:
    """Return the samples of intervals of a log, concatenated."""
    return np.concatenate([np.arange(start, stop) for start, stop in bounds.tolist()])

"""Windows of a log, each replayed from near its smoothed first velocity: simulation error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.qr_factor import update_factor
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Inputs
from hydrodamp.simulation.problem import Problem

#: Longest Runge-Kutta step [s]: twice a replay's, at half the work; on the modes of a vehicle (10
#: 1/s and slower) it is off by a thousandth at most.
MAX_STEP = 0.1

#: Steps that a window must have.
_LEAST = 4

#: Parts of a window within which errors are averaged before a direction is found, and numbers of a
#: Jacobian held at once: 32 MB.
_MEANS, _ENTRIES = 10, 4_000_000

#: Errors of a window whose replay has no end count as this many times the largest velocity
#: recorded. A window that this share of a coefficient, or the doubt of a first velocity, would move
#: as far tells no direction either.
_LOST, _LITTLE = 5.0, 1e-4


class Linear(NamedTuple):
    """Errors linearised: normal matrix (p + 1, p + 1), squares (f,), and what starts moved by.

    The mean of each over samples; of the first and the last over velocities, too.
    """

    normal: FloatArray
    square: FloatArray
    moved: float


@dataclass(frozen=True, eq=False)
class Windows:
    """Stretches of a log of a length [s], rows (first, one past the last), behind each other.

    ``doubt`` is what the first velocities ``starts`` are held to, each as by a standard deviation.
    """

    length: float
    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    bounds: IntArray
    starts: FloatArray
    doubt: FloatArray

    @cached_property
    def spans(self) -> IntArray:
        """First row of each window and one past its last, among those of all windows."""
        return concatenate_bounds(self.bounds)

    @cached_property
    def samples(self) -> IntArray:
        """Sample of the log that each row is."""
        return sample_indices(self.bounds)

    @cached_property
    def chunks(self) -> tuple[Windows, ...]:
        """Some windows after others, as many as are linearised at once."""
        at_once = max(_ENTRIES // (6 * 2 * _MEANS * (len(self.entries[0]) + 6)), 1)
        n = len(self.bounds)
        return tuple(self.select(slice(one, one + at_once)) for one in range(0, n, at_once))

    @cached_property
    def inputs(self) -> Inputs:
        """What drives the windows, each from its own first velocity."""
        velocity = self.problem.inputs.velocity[self.samples]
        velocity[self.spans[:, 0]] = self.starts
        return self.problem.inputs.select(self.samples, velocity)

    @cached_property
    def free(self) -> IntArray:
        """Numbers of the free axes."""
        return np.flatnonzero(self.problem.vehicle.free)

    def select(self, chosen: slice | IntArray) -> Windows:
        """Return some of the windows."""
        return replace(self, bounds=self.bounds[chosen], starts=self.starts[chosen])

    def errors(self, coefficients: FloatArray) -> FloatArray:
        """Return measured minus simulated velocity (n, f) of every row.

        A window that runs away is wrong by more than any velocity recorded from there on.
        """
        table = self.problem.equations
        matrix = table.with_unknown(self.entries, coefficients)
        simulated, *_ = core.replay(table.plant, matrix, self.inputs, self.spans, max_step=MAX_STEP)
        return self._missed(simulated)

    def _missed(self, simulated: FloatArray) -> FloatArray:
        recorded = self.problem.inputs.velocity[:, self.free]
        errors = recorded[self.samples] - simulated[:, self.free]
        return np.where(np.isnan(errors), _LOST * np.abs(recorded).max(axis=0), errors)

    def normals(self, coefficients: FloatArray, spread: FloatArray, parts: int) -> FloatArray:
        """Return normal matrices of errors linearised in the coefficients, a part each.

        With slopes A and errors e, over ``spread``, [A e]ᵀ[A e], shape (parts, p + 1, p + 1). Both
        are averaged over a tenth of a window. Windows that run away tell no direction.
        """
        p, n, first = len(coefficients), len(self.bounds), 0
        found = np.zeros((parts, p + 1, p + 1))
        for slopes, errors, edges, part, _ in self._linearised(coefficients, spread):
            number = (first + np.arange(len(part.bounds))) * parts // n
            for one in np.unique(number):
                own = edges[
                    np.flatnonzero(number == one)[0] : np.flatnonzero(number == one)[-1] + 2
                ]
                rows = slice(own[0], own[-1])
                found[one] += self._eliminate_initial_states(
                    slopes[rows], errors[rows], np.array(own) - own[0]
                )[0]
            first += len(part.bounds)
        return found

    def linear(self, coefficients: FloatArray, spread: FloatArray) -> Linear:
        """Linearise the errors in the coefficients, first velocities where they fit best."""
        p, free = len(coefficients), self.free
        normal, square, moved = np.zeros((p + 1, p + 1)), np.zeros(len(free)), 0.0
        for slopes, errors, edges, part, simulated in self._linearised(coefficients, spread):
            own, starts = self._eliminate_initial_states(slopes, errors, edges)
            normal += own
            change = slopes[:, p + free] * np.repeat(starts, np.diff(edges), axis=0)
            left = errors - np.sum(change, axis=1)
            gone = (errors**2 - left**2).reshape(-1, 6).sum(axis=0)[free]
            square += np.sum(part._missed(simulated) ** 2, axis=0) - gone * spread**2
            moved += float(np.sum((starts / self.doubt) ** 2))
        n = len(self.samples)
        return Linear(normal / n / len(free), square / n, moved / n / len(free))

    @factorisation("normal matrix of initial states")
    def _eliminate_initial_states(
        self, slopes: FloatArray, errors: FloatArray, edges: IntArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return the normal matrix that first velocities leave, and what each window's moves by.

        With slopes B in first velocities, δ = (BᵀB + doubt⁻²)⁻¹Bᵀe takes Bδ off the errors of a
        window, and the rest of [A e]ᵀ[A e] is Schur's complement.
        """
        p = slopes.shape[1] - 6
        first, windows = slopes[:, p + self.free], [slice(*edge) for edge in pairwise(edges)]
        shared = np.array([first[one].T @ slopes[one] for one in windows])
        missed = np.array([errors[one] @ first[one] for one in windows])[:, :, None]
        inner = shared[:, :, p + self.free] + np.diag(self.doubt**-2.0)
        shared = np.concatenate([shared[:, :, :p], missed], axis=2)
        gain = np.linalg.solve(inner, shared)
        normal = -np.tensordot(shared, gain, ((0, 1), (0, 1)))
        slope = errors @ slopes
        normal[:p, :p] += (slopes.T @ slopes)[:p, :p]
        normal[:p, p] += slope[:p]
        normal[p, :p] += slope[:p]
        normal[p, p] += errors @ errors
        return normal, gain[:, :, p]

    def triangle(self, coefficients: FloatArray, spread: FloatArray) -> FloatArray:
        """Return the root of the normal matrix, first velocities fixed; it keeps more digits."""
        p = len(coefficients)
        total: FloatArray = np.zeros((p + 1, p + 1))
        for slopes, errors, *_ in self._linearised(coefficients, spread):
            total = update_factor(total, np.column_stack([slopes[:, :p], errors]))
        return total

    def _linearised(
        self, coefficients: FloatArray, spread: FloatArray
    ) -> Iterator[tuple[FloatArray, FloatArray, IntArray, Windows, FloatArray]]:
        """Yield slopes [A B] and errors of some windows after others, edges, windows, replay."""
        for part in self.chunks:
            slopes, errors, edges, simulated = part._means(coefficients, spread)
            rows = slopes.reshape(-1, slopes.shape[2]), errors.ravel()
            yield *rows, 6 * edges, part, simulated

    def _means(
        self, coefficients: FloatArray, spread: FloatArray
    ) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """Return slopes (m, 6, p + 6), errors (m, 6), edges of windows, and the replay."""
        table, p, free = self.problem.equations, len(coefficients), self.free
        block = max(int(np.median(np.diff(self.bounds, axis=1))) // _MEANS, 1)
        simulated, _, slopes = core.replay(
            table.plant,
            table.with_unknown(self.entries, coefficients),
            self.inputs,
            self.spans,
            self.entries,
            max_step=MAX_STEP,
            block=block,
        )
        first = np.concatenate([np.arange(start, stop, block) for start, stop in self.spans])
        edges = np.searchsorted(first, np.append(self.spans[:, 0], len(simulated)))
        count = np.diff(np.append(first, len(simulated)))
        errors = self.problem.inputs.velocity[self.samples] - simulated
        errors = np.add.reduceat(errors, first, axis=0) / np.sqrt(count)[:, None]
        weight = np.zeros(6)
        weight[free] = 1.0 / spread
        slopes *= weight[:, None]
        errors *= weight
        # what grows in a window has grown most at its end
        far = _LOST * np.abs(self.problem.inputs.velocity).max(axis=0) * weight * np.sqrt(block)
        little = np.zeros(p + 6)
        little[:p], little[p + free] = np.abs(_LITTLE * coefficients), self.doubt
        last = edges[1:] - 1
        moved = np.maximum(np.abs(errors[last]), np.max(np.abs(slopes[last]) * little, axis=2))
        for lost in np.flatnonzero(~np.all(moved <= far, axis=1)):  # NaN is not within
            errors[edges[lost] : edges[lost + 1]] = slopes[edges[lost] : edges[lost + 1]] = 0.0
        return slopes, errors, edges, simulated


def split_windows(problem: Problem, length: float) -> IntArray:
    """Return windows of a length [s] that hold every sample, none across a join.

    They overlap as little as the length of each segment lets them.
    """
    windows, length = [], max(length, _LEAST * median_step(problem))
    for start, stop in problem.segments.tolist():
        time = problem.inputs.time[start:stop]
        room = time[-1] - time[0] - length
        if not room > 0.0:
            windows.append((start, stop))
            continue
        begins = time[0] + np.linspace(0.0, room, int(np.ceil(room / length - 1e-6)) + 1)
        slack = 1e-6 * length  # clocks round
        first = start + np.searchsorted(time, begins - slack)
        last = start + np.searchsorted(time, begins + length + slack, side="right")
        windows += zip(first, last, strict=True)
    bounds = np.array(windows, dtype=np.int64).reshape(-1, 2)
    return bounds[bounds[:, 0] < bounds[:, 1]]  # a window may lie in a hole


def concatenate_bounds(bounds: IntArray) -> IntArray:
    """Return where stretches of a log lie once they are put behind each other."""
    ends = np.cumsum(np.diff(bounds, axis=1).ravel())
    return np.column_stack([np.append(0, ends[:-1]), ends])


def sample_indices(bounds: IntArray) -> IntArray:
    """Return the samples of stretches of a log, one stretch behind the other."""
    return np.concatenate([np.arange(start, stop) for start, stop in bounds.tolist()])

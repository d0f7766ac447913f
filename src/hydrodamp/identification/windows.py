"""Windows of a log, each replayed from near its smoothed first velocity: simulation error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.differences import median_step
from hydrodamp.identification.triangle import folded_rows
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
    """Errors linearised: normal matrix (p + 1, p + 1), squares (f,), and what starts moved by."""

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
        return laid(self.bounds)

    @cached_property
    def samples(self) -> IntArray:
        """Sample of the log that each row is."""
        return covered(self.bounds)

    @cached_property
    def inputs(self) -> Inputs:
        """What drives the windows, each from its own first velocity."""
        velocity = self.problem.inputs.velocity[self.samples]
        velocity[self.spans[:, 0]] = self.starts
        return self.problem.inputs.part(self.samples, velocity)

    @cached_property
    def free(self) -> IntArray:
        """Numbers of the free axes."""
        return np.flatnonzero(self.problem.vehicle.free)

    def some(self, chosen: slice | IntArray) -> Windows:
        """Return some of the windows."""
        return replace(self, bounds=self.bounds[chosen], starts=self.starts[chosen])

    def errors(self, coefficients: FloatArray) -> FloatArray:
        """Return measured minus simulated velocity (n, f) of every row.

        A window that runs away is wrong by more than any velocity recorded from there on.
        """
        table = self.problem.columns
        matrix = table.with_unknown(self.entries, coefficients)
        simulated, *_ = kernels.replay(
            table.plant, matrix, self.inputs, self.spans, max_step=MAX_STEP
        )
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
        n = len(self.bounds)
        ends = np.arange(parts + 1) * n // parts
        return np.array(
            [self.some(slice(a, b)).linear(coefficients, spread).normal for a, b in pairwise(ends)]
        )

    def linear(self, coefficients: FloatArray, spread: FloatArray) -> Linear:
        """Linearise the errors in the coefficients, first velocities where they fit best.

        With slopes B in first velocities, δ = (BᵀB + doubt⁻²)⁻¹Bᵀe takes Bδ off the errors, and
        ``normal`` is what that leaves of [A e]ᵀ[A e] (Schur's complement).
        """
        p = len(coefficients)
        normal, square, moved = np.zeros((p + 1, p + 1)), np.zeros(len(self.free)), 0.0
        for rows, simulated, part in self._linearised(coefficients, spread):
            own, first = rows[..., : p + 1], rows[..., p + 1 :]
            shared = first.transpose(0, 2, 1) @ own
            inner = first.transpose(0, 2, 1) @ first + np.diag(self.doubt**-2.0)
            gain = np.linalg.solve(inner, shared)
            flat = own.reshape(-1, p + 1)
            normal += flat.T @ flat - np.tensordot(shared, gain, ((0, 1), (0, 1)))
            errors = own[..., p]
            left = errors - (first @ gain[..., p:])[..., 0]
            gone = (errors**2 - left**2).reshape(-1, len(self.free)).sum(axis=0)
            square += np.sum(part._missed(simulated) ** 2, axis=0) - gone * spread**2
            moved += float(np.sum((gain[..., p] / self.doubt) ** 2))
        return Linear(normal, square, moved)

    def triangle(self, coefficients: FloatArray, spread: FloatArray) -> FloatArray:
        """Return the root of the normal matrix, first velocities fixed; it keeps more digits."""
        size = len(coefficients) + 1
        total: FloatArray = np.zeros((size, size))
        for rows, *_ in self._linearised(coefficients, spread):
            total = folded_rows(total, rows[..., :size].reshape(-1, size))
        return total

    def _linearised(
        self, coefficients: FloatArray, spread: FloatArray
    ) -> Iterator[tuple[FloatArray, FloatArray, Windows]]:
        """Yield rows [A e B] of some windows after others, their replay, and the windows."""
        at_once = max(_ENTRIES // (6 * 2 * _MEANS * (len(coefficients) + 6)), 1)
        for first in range(0, len(self.bounds), at_once):
            part = self.some(slice(first, first + at_once))
            yield *part._rows(coefficients, spread), part

    def _rows(self, coefficients: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the rows of each window, zero behind its last, and the replay."""
        table, p = self.problem.columns, len(coefficients)
        block = max(int(np.median(np.diff(self.bounds, axis=1))) // _MEANS, 1)
        simulated, _, slopes = kernels.replay(
            table.plant,
            table.with_unknown(self.entries, coefficients),
            self.inputs,
            self.spans,
            self.entries,
            max_step=MAX_STEP,
            block=block,
        )
        first = np.concatenate([np.arange(start, stop, block) for start, stop in self.spans])
        count = np.diff(np.append(first, len(simulated)))
        errors = self.problem.inputs.velocity[self.samples] - simulated
        errors = np.add.reduceat(errors, first, axis=0) / np.sqrt(count)[:, None]
        window = np.searchsorted(self.spans[:, 1], first, side="right")
        place = np.arange(len(window)) - np.searchsorted(window, window)
        f = len(self.free)
        rows = np.zeros((len(self.bounds), int(place.max()) + 1, f, p + 1 + f))
        for number, axis in enumerate(self.free):
            here = rows[:, :, number]
            here[window, place, :p] = slopes[:, axis, :p]
            here[window, place, p] = errors[:, axis]
            here[window, place, p + 1 :] = slopes[:, axis, p + self.free]
            here /= spread[number]
        far = _LOST * np.abs(self.problem.inputs.velocity[:, self.free]).max(axis=0) / spread
        little = np.concatenate([np.abs(_LITTLE * coefficients), [1.0], self.doubt])
        moved = (np.maximum(rows.max(axis=1), -rows.min(axis=1)) * little).max(axis=2)
        lost = ~np.all(moved <= far * np.sqrt(block), axis=1)  # NaN is not within
        rows[lost] = 0.0
        return rows.reshape(len(rows), -1, p + 1 + f), simulated


def cut(problem: Problem, length: float) -> IntArray:
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
    return np.array(windows, dtype=np.int64).reshape(-1, 2)


def laid(bounds: IntArray) -> IntArray:
    """Return where stretches of a log lie once they are put behind each other."""
    ends = np.cumsum(np.diff(bounds, axis=1).ravel())
    return np.column_stack([np.append(0, ends[:-1]), ends])


def covered(bounds: IntArray) -> IntArray:
    """Return the samples of stretches of a log, one stretch behind the other."""
    return np.concatenate([np.arange(start, stop) for start, stop in bounds.tolist()])

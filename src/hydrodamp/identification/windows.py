"""Windows of a log, each replayed from its smoothed first velocity: truncated simulation error."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

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
#: recorded. A window that this share of a coefficient would move as far tells no direction either.
_LOST, _LITTLE = 5.0, 1e-4


@dataclass(frozen=True, eq=False)
class Windows:
    """Stretches of a log of a length [s], rows (first, one past the last), behind each other."""

    length: float
    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    bounds: IntArray
    starts: FloatArray

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
            [self.some(slice(a, b)).normal(coefficients, spread) for a, b in pairwise(ends)]
        )

    def normal(self, coefficients: FloatArray, spread: FloatArray) -> FloatArray:
        """Return the normal matrix of all windows."""
        total: FloatArray = np.zeros((len(coefficients) + 1,) * 2)
        for rows in self._linearised(coefficients, spread):
            total += rows.T @ rows
        return total

    def triangle(self, coefficients: FloatArray, spread: FloatArray) -> FloatArray:
        """Return the root of the normal matrix of all windows, which keeps more digits."""
        total: FloatArray = np.zeros((len(coefficients) + 1,) * 2)
        for rows in self._linearised(coefficients, spread):
            total = folded_rows(total, rows)
        return total

    def _linearised(self, coefficients: FloatArray, spread: FloatArray) -> Iterator[FloatArray]:
        """Yield the rows [A e] of some windows after others."""
        at_once = max(_ENTRIES // (6 * 2 * _MEANS * (len(coefficients) + 6)), 1)
        for first in range(0, len(self.bounds), at_once):
            yield self.some(slice(first, first + at_once))._rows(coefficients, spread)

    def _rows(self, coefficients: FloatArray, spread: FloatArray) -> FloatArray:
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
        whole = np.concatenate([slopes[:, :, :p], errors[:, :, None]], axis=2)[:, self.free]
        whole /= spread[:, None]
        far = _LOST * np.abs(self.problem.inputs.velocity[:, self.free]).max(axis=0) / spread
        moved = np.abs(whole * np.append(_LITTLE * coefficients, 1.0)).max(axis=2)
        lost = ~(np.all(moved <= far * np.sqrt(block), axis=1))  # NaN is not within
        if lost.any():
            window = np.searchsorted(self.spans[:, 1], first, side="right")
            whole[np.isin(window, window[lost])] = 0.0
        return whole.reshape(-1, p + 1)


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

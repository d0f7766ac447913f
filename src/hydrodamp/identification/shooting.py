"""Multiple shooting: a log cut into windows, each replayed from a state of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IndexArray, IntArray
from hydrodamp.identification.triangle import folded_rows
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.simulation.problem import Problem

#: Longest Runge-Kutta step [s]: twice a replay's, at half the work; on the modes of a vehicle (10
#: 1/s and slower) it is off by a thousandth at most.
MAX_STEP = 0.1

#: Samples a window must have.
_LEAST = 4

#: Numbers of a Jacobian held at once: 64 MB.
_ENTRIES = 8_000_000


@dataclass(frozen=True, eq=False)
class Guess:
    """Where the search stands."""

    coefficients: FloatArray
    starts: FloatArray


@dataclass(frozen=True, eq=False)
class Linearised:
    """The problem around a guess, first states eliminated."""

    triangle: FloatArray
    cost: float
    back: tuple[tuple[FloatArray, FloatArray, FloatArray], ...]

    def starts_moved(self, change: FloatArray) -> FloatArray:
        """Return how far each first state moves with a change of the coefficients."""
        return np.array([np.linalg.solve(r, c - b @ change) for r, c, b in self.back])


@dataclass(frozen=True, eq=False)
class Shooting:
    """A problem, the coefficients sought, and the windows."""

    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    windows: IntArray
    noise: FloatArray

    @property
    def free(self) -> IntArray:
        """Numbers of the free axes."""
        return np.flatnonzero(self.problem.vehicle.free)

    def measured_starts(self) -> FloatArray:
        """Return the first velocities as measured, shape (n_windows, 6)."""
        return self.problem.inputs.velocity[self.windows[:, 0]]

    def errors(self, guess: Guess) -> FloatArray:
        """Return measured minus simulated velocity of all samples in windows."""
        parts = []
        for inputs, windows, place in self._batches(guess, 6):
            simulated, _ = kernels.replay(
                self.problem.columns.plant,
                self._matrix(guess),
                inputs,
                windows,
                max_step=MAX_STEP,
            )
            first, last = place
            parts.append(self.problem.inputs.velocity[first:last] - simulated)
        return np.concatenate(parts)[:, self.free]

    def cost(self, guess: Guess, spread: FloatArray) -> float:
        """Return the sum of squares of all weighted errors; infinite if one diverged."""
        errors = self.errors(guess) / spread
        off = (self.measured_starts() - guess.starts)[:, self.free] / self.noise
        total = float(np.sum(errors**2) + np.sum(off**2))
        return total if np.isfinite(total) else np.inf

    def linearised(self, guess: Guess, spread: FloatArray) -> Linearised | None:
        """Return the problem around a guess; None if a window diverges there."""
        width = len(guess.coefficients) + 1
        triangle: FloatArray = np.zeros((width, width))
        back: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        cost = 0.0
        for inputs, windows, (first, last) in self._batches(guess, 6 * (width + 5)):
            errors, slopes = self._slopes(guess, inputs, windows, slice(first, last))
            if not (np.all(np.isfinite(errors)) and np.all(np.isfinite(slopes))):
                return None
            for start, stop in windows.tolist():
                measured = self.problem.inputs.velocity[first + start]
                off = (measured - guess.starts[len(back)])[self.free] / self.noise
                part, kept = self._eliminated(
                    errors[start:stop] / spread, slopes[start:stop] / spread[:, None], off
                )
                triangle = folded_rows(triangle, part)
                back.append(kept)
                cost += float(np.sum((errors[start:stop] / spread) ** 2) + off @ off)
        return Linearised(triangle, cost, tuple(back))

    def scores(
        self, guess: Guess, spread: FloatArray, errors: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return what each sample contributes to the coefficients' equations."""
        p, n_free = len(guess.coefficients), len(self.free)
        scores: FloatArray = np.empty((len(errors), p))
        triangle: FloatArray = np.zeros((p, p))
        for inputs, windows, (first, last) in self._batches(guess, 6 * (p + 6)):
            _, slopes = self._slopes(guess, inputs, windows, slice(first, last))
            for start, stop in windows.tolist():
                zero = np.zeros((stop - start, n_free))
                part, _ = self._eliminated(zero, slopes[start:stop] / spread[:, None], zero[0])
                triangle = folded_rows(triangle, part[:, :p])
                by_sample = part[: (stop - start) * n_free, :p].reshape(stop - start, n_free, p)
                here = slice(first + start, first + stop)
                scores[here] = np.einsum("tfp,tf->tp", by_sample, errors[here] / spread)
        return scores, triangle

    def _eliminated(
        self, error: FloatArray, slope: FloatArray, off: FloatArray
    ) -> tuple[FloatArray, tuple[FloatArray, FloatArray, FloatArray]]:
        """Take the first state out of one window's weighted rows."""
        n_free = len(self.free)
        p = slope.shape[2] - n_free
        rows = slope.reshape(-1, p + n_free)
        right = np.concatenate([error.ravel(), off])
        by_start = np.vstack([rows[:, p:], np.diag(1.0 / self.noise)])
        by_coefficient = np.vstack([rows[:, :p], np.zeros((n_free, p))])
        q, r = np.linalg.qr(by_start)
        c, b = q.T @ right, q.T @ by_coefficient
        left = np.column_stack([by_coefficient - q @ b, right - q @ c])
        return left, (r, c, b)

    def _slopes(
        self, guess: Guess, inputs: Inputs, windows: IntArray, part: slice
    ) -> tuple[FloatArray, FloatArray]:
        """Return errors (n, f) and their negative slopes (n, f, p + f), free axes only."""
        parameters: IndexArray = np.column_stack(self.entries).astype(np.int32)
        simulated, jacobian, _ = kernels.sensitivities(
            self.problem.columns.plant,
            self._matrix(guess),
            parameters,
            inputs,
            windows,
            max_step=MAX_STEP,
        )
        free = self.free
        columns = np.concatenate([np.arange(len(parameters)), len(parameters) + free])
        errors = (self.problem.inputs.velocity[part] - simulated)[:, free]
        if len(free) == 6:
            return errors, jacobian
        return errors, jacobian[:, free][:, :, columns]

    def _matrix(self, guess: Guess) -> FloatArray:
        return self.problem.columns.with_unknown(self.entries, guess.coefficients)

    def _batches(
        self, guess: Guess, width: int
    ) -> Iterator[tuple[Inputs, IntArray, tuple[int, int]]]:
        """Yield inputs that start at the guessed states, their windows, and their place."""
        most = max(_ENTRIES // width, 1)
        edge = 0
        while edge < len(self.windows):
            first = int(self.windows[edge, 0])
            stop = edge + 1
            while stop < len(self.windows) and self.windows[stop, 1] - first <= most:
                stop += 1
            last = int(self.windows[stop - 1, 1])
            windows = self.windows[edge:stop] - first
            velocity = self.problem.inputs.velocity[first:last].copy()
            velocity[windows[:, 0]] = guess.starts[edge:stop]
            yield self.problem.inputs.part(slice(first, last), velocity), windows, (first, last)
            edge = stop


def cut(problem: Problem, length: float) -> IntArray:
    """Cut the segments of a log into windows of about equal length."""
    windows: list[tuple[int, int]] = []
    for start, stop in problem.segments.tolist():
        duration = float(problem.inputs.time[stop - 1] - problem.inputs.time[start])
        pieces = min(max(round(duration / length), 1), max((stop - start) // _LEAST, 1))
        goals = problem.inputs.time[start] + duration * np.arange(1, pieces) / pieces
        inner = start + np.searchsorted(problem.inputs.time[start:stop], goals)
        edges = [start, *inner.tolist(), stop]
        windows += pairwise(edges)
    return np.array(windows, dtype=np.int64).reshape(-1, 2)


#: Commands, recorded wrench and first velocities are multiplied by these.
SHARES = (0.9, 1.0)

#: A velocity beyond this many times the largest recorded of its kind, linear or angular, has run
#: away.
BEYOND = 5.0


def runaways(problem: Problem, matrix: FloatArray) -> int:
    """Count the replays that run away beside the log."""
    recorded = np.abs(problem.inputs.velocity)
    largest = BEYOND * np.repeat([recorded[:, :3].max(), recorded[:, 3:].max()], 3)
    return sum(_count(problem, matrix, share, largest) for share in SHARES)


def _count(problem: Problem, matrix: FloatArray, share: float, largest: FloatArray) -> int:
    inputs = problem.inputs
    driven = replace(
        inputs,
        velocity=share * inputs.velocity,
        wrench=share**2 * inputs.wrench,
        channels=share * inputs.channels,
        propulsion=share * inputs.propulsion,
    )
    velocity, _ = kernels.replay(problem.columns.plant, matrix, driven, problem.segments)
    left = ~np.all(np.abs(velocity) <= largest, axis=1)
    return sum(bool(left[start:stop].any()) for start, stop in problem.segments.tolist())

"""One stage of output error: damped Gauss-Newton steps on windows of one length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.replays.shooting import Guess, Linearised, Shooting, cut
from hydrodamp.identification.rows.velocity_noise import mean_square, median_step, noise_variance
from hydrodamp.identification.uncertainty.long_run import correlation_time
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

REST = 1e-3
"""A step that lowers the cost by less than this share has come to rest."""

_TRIALS = 8
"""How often a step is shortened before the search rests."""

_FLOOR = 1e-6
"""Least noise of a velocity, for records without any [m/s, rad/s]."""

_PRIOR = (1e-6, 1e6)
"""Bounds of the prior's strength."""

LIKE_NOISE = 0.1
"""Errors are not weighted as if they were smaller than this share of the noise."""


@dataclass(frozen=True, eq=False)
class Search:
    """What stays the same from stage to stage."""

    problem: Problem
    entries: tuple[np.ndarray, np.ndarray]
    noise: FloatArray
    unit: FloatArray

    @property
    def axes(self) -> IntArray:
        """Number of each coefficient's axis."""
        return self.entries[1]

    def shooting(self, length: float) -> Shooting:
        """Return the problem cut into windows of a length [s]."""
        return Shooting(self.problem, self.entries, cut(self.problem, length), self.noise)

    def spread(self, errors: FloatArray) -> FloatArray:
        """Return what to divide the errors of each velocity by."""
        square = np.mean(errors**2, axis=0) + (LIKE_NOISE * self.noise) ** 2
        spread: FloatArray = np.sqrt(square * self._alike(errors))
        return spread

    def _alike(self, errors: FloatArray) -> float:
        """Return how many samples are alike, the geometric mean over the velocities."""
        segment, time = self.problem.segment_numbers, self.problem.inputs.time
        step = median_step(self.problem)
        times = [correlation_time(one[:, None], segment, time) for one in errors.T]
        return float(np.exp(np.mean(np.log(np.maximum(np.array(times) / step, 1.0)))))


@dataclass(frozen=True, eq=False)
class Place:
    """A place on the way."""

    coefficients: FloatArray
    strength: FloatArray


@dataclass(frozen=True, eq=False)
class Path:
    """The way of one stage."""

    places: tuple[Place, ...]
    settled: bool


def searching(problem: Problem, model: DampingModel) -> Search:
    """Set up the search for a model's coefficients."""
    entries = problem.columns.entries(model)
    rows, axes = entries
    size = np.sqrt(mean_square(problem))[rows - problem.columns.n_known]
    inertia = np.diag(problem.vehicle.mass_matrix)[axes]
    noise = np.sqrt(noise_variance(problem))
    return Search(
        problem,
        entries,
        noise=np.maximum(noise[problem.vehicle.free], _FLOOR),
        unit=inertia / np.where(size > 0.0, size, 1.0),
    )


def refine(search: Search, shooting: Shooting, start: Place, rounds: int) -> Path | None:
    """Take damped Gauss-Newton steps on windows of one length."""
    guess = Guess(start.coefficients, shooting.measured_starts())
    strength, damping = start.strength, 1e-3
    errors = shooting.errors(guess)
    if not np.all(np.isfinite(errors)):
        return None
    spread = search.spread(errors)
    around = shooting.linearised(guess, spread)
    if around is None:
        return None
    places = [start]
    for _ in range(rounds):
        step = _step(search, shooting, guess, around, strength, spread, damping)
        if step is None:
            return Path(tuple(places), settled=True)
        guess, damping, gained = step
        strength = _evidence(search, around, guess, strength)
        places.append(Place(guess.coefficients, strength))
        if gained < REST:
            return Path(tuple(places), settled=True)
        spread = search.spread(shooting.errors(guess))
        moved = shooting.linearised(guess, spread)
        if moved is None:
            break
        around = moved
    return Path(tuple(places), settled=False)


def _step(
    search: Search,
    shooting: Shooting,
    guess: Guess,
    around: Linearised,
    strength: FloatArray,
    spread: FloatArray,
    damping: float,
) -> tuple[Guess, float, float] | None:
    """Return a better guess, the damping to go on with, and the share gained; None at rest."""
    slopes, error = around.triangle[:, :-1] * search.unit, around.triangle[:, -1]
    prior = np.sqrt(strength[search.axes])
    pull = prior * guess.coefficients / search.unit
    before = around.cost + float(pull @ pull)
    norms = np.linalg.norm(slopes, axis=0)
    for _ in range(_TRIALS):
        rows = np.vstack([slopes, np.diag(prior), np.diag(np.sqrt(damping) * norms)])
        right = np.concatenate([error, -pull, np.zeros(len(norms))])
        change = np.linalg.lstsq(rows, right)[0]
        tried = _moved(shooting, guess, around, search.unit * change)
        after = shooting.cost(tried, spread) + float(np.sum((pull + prior * change) ** 2))
        if after < before:
            return tried, max(damping / 8.0, 1e-9), (before - after) / before
        damping *= 8.0
    return None


def _moved(shooting: Shooting, guess: Guess, around: Linearised, change: FloatArray) -> Guess:
    starts = guess.starts.copy()
    starts[:, shooting.free] += around.starts_moved(change)
    return Guess(guess.coefficients + change, starts)


def _evidence(search: Search, around: Linearised, guess: Guess, strength: FloatArray) -> FloatArray:
    """Return the prior strength of each axis that the data speak for (MacKay 1992)."""
    slopes = around.triangle[:, :-1] * search.unit
    prior = strength[search.axes]
    rows = np.vstack([slopes, np.diag(np.sqrt(prior))])
    half = np.linalg.inv(np.linalg.qr(rows, mode="r"))
    determined = 1.0 - prior * np.sum(half**2, axis=1)
    square = (guess.coefficients / search.unit) ** 2
    moved = strength.copy()
    for axis in np.unique(search.axes):
        here = search.axes == axis
        moved[axis] = determined[here].sum() / max(float(square[here].sum()), 1e-9)
    return np.clip(moved, *_PRIOR)

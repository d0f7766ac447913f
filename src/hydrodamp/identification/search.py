"""The search of output error: Gauss-Newton on windows that grow, and the choice on its way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.covariance import correlation_time
from hydrodamp.identification.differences import mean_square, median_step, noise_variance
from hydrodamp.identification.shooting import Guess, Linearised, Shooting, cut, runaways
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Windows shrink down to this where the guess diverges on longer ones [s].
_SHORTEST = 1.0

#: Strength of the prior before the data have set it.
_FIRST = 1e-2


@dataclass(frozen=True, eq=False)
class Climb:
    """Where a search ended."""

    search: Search
    place: Place
    short: FloatArray | None
    settled: bool
    words: str

    @property
    def coefficients(self) -> FloatArray:
        """Of the place chosen, shape (p,)."""
        return self.place.coefficients

    def slopes(self) -> FloatArray:
        """Return the weighted Jacobian's triangle there, on whole segments, shape (p, p)."""
        whole = self.search.shooting(np.inf)
        guess = Guess(self.coefficients, whole.measured_starts())
        errors = whole.errors(guess)
        finite = bool(np.all(np.isfinite(errors)))
        around = whole.linearised(guess, self.search.spread(errors)) if finite else None
        size = len(self.coefficients)
        return np.zeros((size, size)) if around is None else around.triangle[:-1, :-1]


def climb(
    problem: Problem,
    model: DampingModel,
    starts: Sequence[FloatArray],
    lengths: tuple[float, ...],
    rounds: int,
) -> Climb:
    """Search from the best of several starts, through windows of growing length."""
    search = searching(problem, model)
    whole = search.shooting(np.inf)
    ladder = [whole, search.shooting(lengths[0]), search.shooting(_SHORTEST)]
    first = min(starts, key=lambda start: [_replayed(windows, start)[1] for windows in ladder])
    paths, words = _stages(search, Place(first, np.full(6, _FIRST)), lengths, rounds)
    places = [place for path in paths for place in path.places]
    places += [Place(start, np.full(6, _FIRST)) for start in starts]
    end = paths[-1].places[-1] if paths else None
    chosen, why = _chosen(whole, places, end)
    at_rest = chosen is end and paths[-1].settled
    return Climb(
        search=search,
        place=chosen,
        short=paths[0].places[-1].coefficients if paths else None,
        settled=at_rest,
        words=words + why,
    )


def _chosen(whole: Shooting, places: list[Place], end: Place | None) -> tuple[Place, str]:
    """Return the end, or the nearest place where it runs away, and why not the end."""

    def rank(place: Place) -> tuple[bool, int, float]:
        lost, misfit = _replayed(whole, place.coefficients)
        return place is not end or lost > 0, lost, misfit

    columns, entries = whole.problem.columns, whole.entries
    ranked = sorted(places, key=rank)
    for place in ranked:
        if not runaways(whole.problem, columns.with_unknown(entries, place.coefficients)):
            return place, _why(place, end, ranked)
    return ranked[0], " Every place on the way runs away when driven a little softer."


def _why(chosen: Place, end: Place | None, ranked: list[Place]) -> str:
    if chosen is end:
        return ""
    if end is None:
        return " The start is given as it is."
    if any(place is end for place in ranked[: ranked.index(chosen)]):
        return " An earlier place is given: the end runs away when driven a little softer."
    return " An earlier place is given: the end runs away on whole runs."


def _replayed(shooting: Shooting, coefficients: FloatArray) -> tuple[int, float]:
    """Return the samples lost after a divergence, and the errors' log-likelihood per sample."""
    errors = shooting.errors(Guess(coefficients, shooting.measured_starts()))
    lost = int(np.count_nonzero(~np.isfinite(errors).all(axis=1)))
    square = np.mean(errors**2, axis=0) + (LIKE_NOISE * shooting.noise) ** 2
    return lost, float(np.sum(np.log(square))) if np.all(np.isfinite(square)) else np.inf


def _stages(
    search: Search, start: Place, lengths: tuple[float, ...], rounds: int
) -> tuple[list[Path], str]:
    """Climb from the shortest windows to the longest; say how far it went."""
    paths: list[Path] = []
    stuck = ""
    for length in lengths:
        last = paths[-1].places[-1] if paths else start
        reached = _reach(search, last, length, rounds)
        if reached is None and paths:  # the shorter windows led astray: from the start again
            reached = _reach(search, start, length, rounds)
        if reached is None:
            stuck = f" replays of {_seconds(length)} run away from every place."
        else:
            paths.append(reached)
    if stuck:
        return paths, "it got stuck:" + stuck
    rest = "came to rest" if paths[-1].settled else "had not come to rest"
    return paths, f"on windows of {_seconds(lengths[-1])} it {rest}."


def _seconds(length: float) -> str:
    return f"{length:g} s" if np.isfinite(length) else "whole runs"


def _reach(search: Search, start: Place, length: float, rounds: int) -> Path | None:
    """Run a stage; where its start diverges, mend it on shorter windows first."""
    shooting = search.shooting(length)
    path = refine(search, shooting, start, rounds)
    if path is not None:
        return path
    shorter = float(np.diff(search.problem.inputs.time[shooting.windows - [0, 1]]).max()) / 3.0
    if shorter < _SHORTEST:
        return None
    mended = _reach(search, start, shorter, rounds)
    return None if mended is None else refine(search, shooting, mended.places[-1], rounds)


#: A step that lowers the cost by less than this share has come to rest.
REST = 1e-3

#: How often a step is shortened before the search rests.
_TRIALS = 8

#: Least noise of a velocity, for records without any [m/s, rad/s].
_FLOOR = 1e-6

#: Bounds of the prior's strength.
_PRIOR = (1e-6, 1e6)

#: Errors are not weighted as if they were smaller than this share of the noise.
LIKE_NOISE = 0.1


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

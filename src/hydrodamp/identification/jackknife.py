"""How far to trust coefficients that were fitted to a replay: parts of the log left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.covariance import LongRun, long_run
from hydrodamp.identification.intervals import Uncertainty
from hydrodamp.identification.search import Place, Search, refine
from hydrodamp.identification.shooting import Guess, Shooting, cut
from hydrodamp.identification.triangle import spanned
from hydrodamp.simulation.problem import Problem


def replay_uncertainty(search: Search, place: Place, n_parts: int) -> Uncertainty | None:
    """Return how far to trust the coefficients at the end of a search."""
    whole = search.shooting(np.inf)
    settled = _settled(search, whole, place.coefficients)
    if settled is None:
        return None
    guess, errors = settled
    scores = _covariance(search, whole, guess, place, errors)
    without = left_out(search, place, n_parts) if n_parts else None
    if without is None:
        return Uncertainty(
            covariance=scores.covariance,
            degrees_of_freedom=scores.degrees_of_freedom,
            method="the scores of the replay's errors alone, which is too little",
            block=scores.block,
            n_blocks=scores.n_blocks,
        )
    return Uncertainty(
        covariance=without.covariance + scores.covariance,
        degrees_of_freedom=without.n_parts - 1,
        method="searches without one part of the log after another (jackknife)",
        block=without.length,
        n_blocks=without.n_parts,
    )


def _settled(
    search: Search, whole: Shooting, coefficients: FloatArray
) -> tuple[Guess, FloatArray] | None:
    """Return the guess with its best first states, and its errors; None where it diverges."""
    guess = Guess(coefficients, whole.measured_starts())
    errors = whole.errors(guess)
    if not np.all(np.isfinite(errors)):
        return None
    around = whole.linearised(guess, search.spread(errors))
    if around is None:
        return None
    starts = guess.starts.copy()
    starts[:, whole.free] += around.starts_moved(np.zeros(len(coefficients)))
    better = Guess(coefficients, starts)
    errors = whole.errors(better)
    return (better, errors) if np.all(np.isfinite(errors)) else None


def _covariance(
    search: Search, whole: Shooting, guess: Guess, place: Place, errors: FloatArray
) -> LongRun:
    """Return the covariance of the coefficients by the scores of the errors."""
    scores, slopes = whole.scores(guess, search.spread(errors), errors)
    prior = np.diag(np.sqrt(place.strength[search.axes]) / search.unit)
    half = spanned(np.vstack([slopes, prior]), range(len(prior))).coefficients
    segment, time = search.problem.segment_numbers, search.problem.inputs.time
    found = long_run(scores @ half, segment, time)
    return replace(found, covariance=half @ found.covariance @ half.T)


#: Searches that must have an end.
FEWEST = 4

#: Gauss-Newton steps from the end of the whole search: enough to take up what is missing.
_ROUNDS = 4


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Ends of the search without one part of the log after another."""

    coefficients: FloatArray
    length: float

    @property
    def n_parts(self) -> int:
        """How many searches have an end."""
        return len(self.coefficients)

    @property
    def covariance(self) -> FloatArray:
        """Jackknife covariance, shape (p, p), of rank one less than parts."""
        away = self.coefficients - self.coefficients.mean(axis=0)
        covariance: FloatArray = (self.n_parts - 1) / self.n_parts * (away.T @ away)
        return covariance


def left_out(search: Search, place: Place, n_parts: int) -> LeftOut | None:
    """Search again without one part of the log after another."""
    length = search.problem.duration / n_parts
    windows, parts = _parts(search.problem, length, n_parts)
    ends = []
    for part in np.unique(parts):
        rest = replace(search, problem=_of(search.problem, windows[parts != part]))
        path = refine(rest, rest.shooting(np.inf), place, _ROUNDS)
        if path is not None:
            ends.append(path.places[-1].coefficients)
    return LeftOut(np.array(ends), length) if len(ends) >= FEWEST else None


def _parts(problem: Problem, length: float, n_parts: int) -> tuple[IntArray, IntArray]:
    """Cut segments into windows, and number the part of the log that each belongs to."""
    windows = cut(problem, length)
    sizes = np.diff(windows, axis=1).ravel()
    middle = np.cumsum(sizes) - 0.5 * sizes
    return windows, np.floor(n_parts * middle / problem.n_samples).astype(np.int64)


def _of(problem: Problem, windows: IntArray) -> Problem:
    """Return the problem of some windows, a segment each."""
    kept = np.concatenate([np.arange(start, stop) for start, stop in windows.tolist()])
    ends = np.cumsum(np.diff(windows, axis=1).ravel())
    return replace(
        problem,
        inputs=problem.inputs.part(kept),
        segments=np.column_stack([np.append(0, ends[:-1]), ends]),
    )

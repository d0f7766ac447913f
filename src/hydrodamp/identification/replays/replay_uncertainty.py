"""How far to trust coefficients that were fitted to a replay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.replays.left_out import left_out
from hydrodamp.identification.replays.refine import Place, Search
from hydrodamp.identification.replays.shooting import Guess, Shooting
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.identification.uncertainty.intervals import Uncertainty
from hydrodamp.identification.uncertainty.long_run import LongRun, long_run


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

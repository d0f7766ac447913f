"""How far to trust coefficients that were fitted to a replay.

To first order the estimate is a sum over samples of what the output error of each
contributes through the sensitivities. The noise alone among those errors is what the
replay of a wider model leaves over, one with the model's own terms and more; see
:mod:`hydrodamp.identification.covariance`, whose reasons hold here too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.covariance import Uncertainty
from hydrodamp.identification.long_run import LongRun, correlation_time, long_run
from hydrodamp.identification.rank import spanned
from hydrodamp.identification.reference import with_reference
from hydrodamp.identification.refine import Place, Search, refine, searching
from hydrodamp.identification.shooting import Guess, Shooting
from hydrodamp.models.model import DampingModel

_ROUNDS = 4
"""Gauss-Newton steps from the model to the wider one: enough to take the misfit out."""

_MOST = 4.0
"""Most that the variance is raised for what the wider model takes from the noise."""


def replay_uncertainty(search: Search, place: Place, model: DampingModel) -> Uncertainty | None:
    """Return how far to trust the coefficients at the end of a search.

    Parameters
    ----------
    search : Search
        Problem, units and noise.
    place : Place
        Where the search ended.
    model : DampingModel
        Restricted to the free axes.

    Returns
    -------
    uncertainty : Uncertainty or None
        The variance that the wider model takes from its errors is put back by the count
        of independent errors; None where the replay diverges.
    """
    whole = search.shooting(np.inf)
    settled = _settled(search, whole, place.coefficients)
    if settled is None:
        return None
    guess, spread = settled
    own = whole.errors(guess)
    noise, taken = _noise(search, place, model, own)
    found, total = (
        _covariance(search, whole, guess, spread, place, errors) for errors in (noise, own)
    )
    segment, time = _stamps(whole)
    independent = _independent(noise / spread, segment, time)
    share = min(independent / max(independent - taken, independent / _MOST), _MOST)
    return Uncertainty(
        covariance=total.covariance,
        noise=share * found.covariance,
        degrees_of_freedom=total.degrees_of_freedom,
        method="the scores of the replay's errors",
        block=total.block,
        n_blocks=total.n_blocks,
    )


def _settled(
    search: Search, whole: Shooting, coefficients: FloatArray
) -> tuple[Guess, FloatArray] | None:
    """Return the guess with its best first states, and the spread of its errors."""
    guess = Guess(coefficients, whole.measured_starts())
    square = np.mean(whole.errors(guess) ** 2, axis=0)
    if not np.all(np.isfinite(square)):
        return None
    around = whole.linearised(guess, search.spread(square))
    if around is None:
        return None
    starts = guess.starts.copy()
    starts[:, whole.free] += around.starts_moved(np.zeros(len(coefficients)))
    better = Guess(coefficients, starts)
    square = np.mean(whole.errors(better) ** 2, axis=0)
    return (better, search.spread(square)) if np.all(np.isfinite(square)) else None


def _noise(
    search: Search, place: Place, model: DampingModel, own: FloatArray
) -> tuple[FloatArray, int]:
    """Return the errors of a wider model's replay, and how many coefficients it has.

    Where the wider replay diverges the model's own errors count as noise.
    """
    wide = with_reference(search.problem, model)
    reference = wide.models[1]
    wider = searching(wide, reference)
    known = dict(zip(model.labels, place.coefficients.tolist(), strict=True))
    start = np.array([known.get(label, 0.0) for label in reference.labels])
    path = refine(wider, wider.shooting(np.inf), Place(start, place.strength), _ROUNDS)
    if path is None:
        return own, len(place.coefficients)
    settled = _settled(wider, wider.shooting(np.inf), path.places[-1].coefficients)
    if settled is None:
        return own, len(place.coefficients)
    return wider.shooting(np.inf).errors(settled[0]), len(start)


def _covariance(
    search: Search,
    whole: Shooting,
    guess: Guess,
    spread: FloatArray,
    place: Place,
    errors: FloatArray,
) -> LongRun:
    """Return the covariance of the coefficients, given what counts as noise."""
    scores, slopes = whole.scores(guess, spread, errors)
    prior = np.diag(np.sqrt(place.strength[search.axes]) / search.unit)
    half = spanned(np.vstack([slopes, prior]), range(len(prior))).coefficients
    segment, time = _stamps(whole)
    found = long_run(scores @ half, segment, time)
    return replace(found, covariance=half @ found.covariance @ half.T)


def _stamps(whole: Shooting) -> tuple[np.ndarray, FloatArray]:
    lengths = np.diff(whole.windows, axis=1).ravel()
    return np.repeat(np.arange(len(lengths)), lengths), whole.problem.inputs.time


def _independent(errors: FloatArray, segment: np.ndarray, time: FloatArray) -> float:
    """Return how many independent errors there are, over all free axes."""
    steps = np.diff(time)[np.diff(segment) == 0]
    each = [
        steps.sum() / max(correlation_time(column[:, None], segment, time), float(np.median(steps)))
        for column in errors.T
    ]
    return float(sum(each))

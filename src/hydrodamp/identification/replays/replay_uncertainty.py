"""How far to trust coefficients that were fitted to a replay.

To first order the estimate is a sum over samples of what the output error of each
contributes through the sensitivities. The noise alone among those errors is what the
replay of a wider model leaves over, one with the model's own terms and more; see
:mod:`hydrodamp.identification.regression.covariance`, whose reasons hold here too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.replays.refine import Place, Search, refine, searching
from hydrodamp.identification.replays.shooting import Guess, Shooting
from hydrodamp.identification.rows.rank import spanned
from hydrodamp.identification.rows.reference import with_reference
from hydrodamp.identification.uncertainty.intervals import Uncertainty
from hydrodamp.identification.uncertainty.long_run import LongRun, correlation_time, long_run
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

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
    guess, own = settled
    spread = search.spread(own)
    noise, taken = _noise(search, place, model, own)
    found, total = _covariances(search, whole, guess, spread, place, (noise, own))
    independent = _independent(search.problem, noise / spread)
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


def _noise(
    search: Search, place: Place, model: DampingModel, own: FloatArray
) -> tuple[FloatArray, int]:
    """Return the errors of a wider model's replay, and how many coefficients it has.

    Where the wider replay diverges the model's own errors count as noise.
    """
    wide = with_reference(search.problem, model)
    reference = wide.models[1]
    wider = searching(wide, reference)
    whole = wider.shooting(np.inf)
    start = Damping(model, place.coefficients).onto(reference)
    path = refine(wider, whole, Place(start, place.strength), _ROUNDS)
    if path is None:
        return own, len(place.coefficients)
    settled = _settled(wider, whole, path.places[-1].coefficients)
    if settled is None:
        return own, len(place.coefficients)
    return settled[1], len(start)


def _covariances(
    search: Search,
    whole: Shooting,
    guess: Guess,
    spread: FloatArray,
    place: Place,
    errors: tuple[FloatArray, ...],
) -> list[LongRun]:
    """Return the covariance of the coefficients for each view of what counts as noise."""
    scores, slopes = whole.scores(guess, spread, errors)
    prior = np.diag(np.sqrt(place.strength[search.axes]) / search.unit)
    half = spanned(np.vstack([slopes, prior]), range(len(prior))).coefficients
    segment, time = search.problem.segment_numbers, search.problem.inputs.time
    found = [long_run(view @ half, segment, time) for view in scores]
    return [replace(one, covariance=half @ one.covariance @ half.T) for one in found]


def _independent(problem: Problem, errors: FloatArray) -> float:
    """Return how many independent errors there are, over all free axes."""
    segment, time = problem.segment_numbers, problem.inputs.time
    steps = np.diff(time)[np.diff(segment) == 0]
    each = [
        steps.sum() / max(correlation_time(column[:, None], segment, time), float(np.median(steps)))
        for column in errors.T
    ]
    return float(sum(each))

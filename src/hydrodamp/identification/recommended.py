"""The method of those who name none: a search that is judged on what it has not seen."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.gauss_newton import (
    DAMPING,
    REST,
    Iterate,
    ShootingObjective,
    admissible_lengths,
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
    minimise,
)
from hydrodamp.identification.output_error import OutputError, build_fit
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Length of the pieces that a log is cut into, by turns searched and judged on [s].
_PIECE = 100.0


@dataclass(frozen=True)
class Recommended(OutputError):  # noqa: N818 (output error is a method, not an exception)
    """Truncated simulation error that is judged where it was not fitted.

    From the end of the search of :class:`OutputError` a step leads to that of either half of the
    log, cut into pieces that take turns. How well it replays the other half, whole pieces from
    their first sample, is held against the weak form of its half: where that does better by more
    than chance, it is the fit. How far the ends of both halves differ widens the intervals.

    Parameters
    ----------
    windows : tuple of float
        As of :class:`OutputError`.

    Raises
    ------
    MethodError
        If the lengths are not positive and rising.

    Examples
    --------
    >>> Recommended().key
    'recommended'
    """

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "recommended"

    def _searched(self, problem: Problem, model: DampingModel) -> Fit:
        search, lengths = make_objective(problem, model), admissible_lengths(problem, self.windows)
        start = best_initial_iterate(search, initial_candidates(search, model), lengths[0])
        end = continue_over_lengths(search, start, lengths)
        worse, apart = _halves(search, model, end)
        return build_fit(search, model, self, start, start if _certain(worse) else end, apart)


def _certain(worse: FloatArray) -> bool:
    """Say whether a mean over pieces is more than three standard errors above zero.

    Few pieces that are better by half say nothing of the next log.
    """
    return bool(worse.mean() > 3.0 * np.std(worse, ddof=1) / np.sqrt(len(worse)))


def _halves(
    search: ShootingObjective, model: DampingModel, end: Iterate
) -> tuple[FloatArray, FloatArray]:
    """Return how much worse than their starts ends of halves replay the other, and how far apart.

    The first has shape (n_pieces,), of the mean square error of the replay of a whole piece as a
    share of the variance of each velocity, the mean over velocities; no error counts for more than
    saying nothing would. The second is half of what the ends differ by.
    """
    problem = search.problem
    pieces, found, ends = _pieces(problem), [], []
    most = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
    most[most == 0.0] = 1.0
    halves = search.part(pieces[::2]), search.part(pieces[1::2])
    for seen, other in (halves, halves[::-1]):
        judged, missed = other.windows(np.inf), []
        windows = [seen.windows(one.windows.length) for one in end.kinds]
        first = best_initial_iterate(seen, initial_candidates(seen, model), windows[0].length)
        kinds = [old._replace(windows=new) for old, new in zip(end.kinds, windows, strict=True)]
        place = seen.at(end.coefficients, replace(end, kinds=tuple(kinds), damping=DAMPING))
        place = minimise(seen, place, REST, rounds=1)
        for one in (first, place):
            errors = np.clip(judged.errors(one.coefficients) / most, -1.0, 1.0)
            square = np.add.reduceat(np.mean(errors**2, axis=1), judged.spans[:, 0])
            missed.append(square / np.diff(judged.spans, axis=1).ravel())
        found.append(missed[1] - missed[0])
        ends.append(place.coefficients)
    return np.concatenate(found), (ends[0] - ends[1]) / 2.0


def _pieces(problem: Problem) -> IntArray:
    """Cut each segment into an even number of pieces."""
    time, pieces = problem.inputs.time, []
    for start, stop in problem.segments.tolist():
        own = time[start:stop]
        n = 2 * max(round((own[-1] - own[0]) / _PIECE / 2.0), 1)
        edges = start + np.searchsorted(own, np.linspace(own[0], own[-1], n + 1)[1:-1])
        pieces += list(zip([start, *edges.tolist()], [*edges.tolist(), stop], strict=True))
    return np.array(pieces, dtype=np.int64)

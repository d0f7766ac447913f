"""The method of those who name none: a search that is judged on what it has not seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.output_error import OutputError, told
from hydrodamp.identification.search import ladder, searching, starts, within
from hydrodamp.identification.windows import covered, laid
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

#: Length of the pieces that a log is cut into, by turns searched and judged on [s].
_PIECE = 100.0


@dataclass(frozen=True)
class Recommended(OutputError):  # noqa: N818 (output error is a method, not an exception)
    """Truncated simulation error over windows that are judged where they were not fitted.

    The search of :class:`OutputError` goes through its windows on all of the log and on either
    half of it, cut into pieces that take turns. How well the start and each stage replay the
    other half, whole pieces from their first sample, says where the search ends: at the last
    stage, but where an earlier one, or the start, does better by more than chance. How far the
    ends of both searches differ widens the intervals.

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
        search, lengths = searching(problem, model), within(problem, self.windows)
        places = ladder(search, starts(search, model), lengths)
        missed, apart = _halves(problem, model, lengths)
        return told(search, model, self, places[: _chosen(missed) + 1], apart)


def _chosen(missed: FloatArray) -> int:
    """Return the stage that does best, but the last where that is not for certain.

    Certain is a mean difference over pieces of more than three standard errors: few pieces that
    are better by half say nothing of the next log.
    """
    best = int(np.argmin(missed.mean(axis=0)))
    more = missed[:, -1] - missed[:, best]
    certain = more.mean() > 3.0 * np.std(more, ddof=1) / np.sqrt(len(more))
    return best if certain else missed.shape[1] - 1


def _halves(
    problem: Problem, model: DampingModel, lengths: Sequence[float]
) -> tuple[FloatArray, FloatArray]:
    """Search each half of the log; return how the stages miss the other, and how far ends differ.

    The first has shape (n_pieces, 1 + n_lengths), the start first: the mean square error of the
    replay of a whole piece as a share of the variance of each velocity, the mean over velocities;
    no error counts for more than saying nothing would. The second is half the difference.
    """
    pieces, found, ends = _pieces(problem), [], []
    most = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
    most[most == 0.0] = 1.0
    halves = [searching(_of(problem, pieces[half::2]), model) for half in (0, 1)]
    for seen, other in (halves, halves[::-1]):
        judged, stages = other.windows(np.inf), []
        for place in ladder(seen, starts(seen, model), lengths):
            errors = np.clip(judged.errors(place.coefficients) / most, -1.0, 1.0)
            square = np.add.reduceat(np.mean(errors**2, axis=1), judged.spans[:, 0])
            stages.append(square / np.diff(judged.spans, axis=1).ravel())
        found.append(np.column_stack(stages))
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


def _of(problem: Problem, pieces: IntArray) -> Problem:
    """Return the problem of some pieces, a segment each."""
    return replace(problem, inputs=problem.inputs.part(covered(pieces)), segments=laid(pieces))

"""Output error: the coefficients whose replay comes nearest to the log, and their intervals."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.covariance import LongRun, long_run
from hydrodamp.identification.dissipative import Dissipative
from hydrodamp.identification.fit import Fit, Method, Uncertainty, attempted, empty_fit, fitted
from hydrodamp.identification.linear import WeakForm
from hydrodamp.identification.ridge import Ridge
from hydrodamp.identification.search import Climb, Place, Search, climb, refine
from hydrodamp.identification.shooting import Guess, Shooting, cut
from hydrodamp.identification.triangle import spanned
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status


def replay_uncertainty(search: Search, place: Place, n_parts: int) -> Uncertainty | None:
    """Return how far to trust the coefficients at the end of a search."""
    whole = search.shooting(np.inf)
    settled = _settled(search, whole, place.coefficients)
    if settled is None:
        return None
    guess, errors = settled
    scores = _covariance(search, whole, guess, place, errors)
    ends = left_out(search, place, n_parts) if n_parts else None
    if ends is None:
        return Uncertainty(
            covariance=scores.covariance,
            degrees_of_freedom=scores.degrees_of_freedom,
            method="the scores of the replay's errors alone, which is too little",
            block=scores.block,
            n_blocks=scores.n_blocks,
        )
    away, n = ends - ends.mean(axis=0), len(ends)
    return Uncertainty(
        covariance=(n - 1) / n * (away.T @ away) + scores.covariance,
        degrees_of_freedom=n - 1,
        method="searches without one part of the log after another (jackknife)",
        block=search.problem.duration / n_parts,
        n_blocks=n,
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


def left_out(search: Search, place: Place, n_parts: int) -> FloatArray | None:
    """Search again without one part of the log after another; return the ends, one a row."""
    windows, parts = _parts(search.problem, n_parts)
    ends = []
    for part in np.unique(parts):
        rest = replace(search, problem=_of(search.problem, windows[parts != part]))
        path = refine(rest, rest.shooting(np.inf), place, _ROUNDS)
        if path is not None:
            ends.append(path.places[-1].coefficients)
    return np.array(ends) if len(ends) >= FEWEST else None


def _parts(problem: Problem, n_parts: int) -> tuple[IntArray, IntArray]:
    """Cut segments into windows, and number the part of the log that each belongs to."""
    windows = cut(problem, problem.duration / n_parts)
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


#: What the intervals make room for besides noise.
_PUSHES = "how far the shortest windows disagree with the longest"


@dataclass(frozen=True)
class OutputError:
    """Fit the open-loop replay, window by window, then run by run.

    Gauss-Newton with Levenberg-Marquardt damping on multiple shooting windows. The
    sensitivities are those of exactly the Runge-Kutta steps a replay takes. Windows
    grow from stage to stage, so that a start whose whole replay runs away can still be
    mended. Each velocity is weighted by the spread of its own errors, which count as many
    times as they are independent, and the coefficients by a prior around zero whose
    strength the data set, axis by axis (evidence, MacKay 1992): it decides only where the
    data do not.

    Parameters
    ----------
    start : Method
        Gives the first coefficients.
    windows : tuple of float
        Lengths of the windows [s], rising; infinite for whole segments.
    rounds : int
        Most Gauss-Newton steps a stage.
    parts : int
        Parts of the log that are left out in turn for the standard errors; each costs a
        short search. Seven degrees of freedom widen an interval by a fifth. 0 leaves the
        standard errors to the scores alone, which makes them too small.

    Raises
    ------
    MethodError
        If the lengths are not positive and rising, there is no round, or there are one to
        three parts.

    Examples
    --------
    >>> OutputError().key, OutputError(windows=(5.0,)).windows
    ('oe', (5.0,))
    """

    start: Method = field(default_factory=Ridge)
    windows: tuple[float, ...] = (5.0, 30.0, np.inf)
    rounds: int = 12
    parts: int = 8

    def __post_init__(self) -> None:
        """Refuse settings that make no ladder."""
        lengths = np.asarray(self.windows, dtype=np.float64)
        if not len(lengths) or not lengths[0] > 0.0 or np.any(np.diff(lengths) <= 0.0):
            raise MethodError(f"`windows` must be positive and rising [s]; got {self.windows}")
        if self.rounds < 1:
            raise MethodError(f"`rounds` must be at least 1; got {self.rounds}")
        if self.parts and self.parts < FEWEST:
            raise MethodError(f"`parts` must be 0, or {FEWEST} or more; got {self.parts}")

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "oe"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            ``STOPPED`` where the search ended before it came to rest.
        """
        return self.refined(problem, self.start.identify(problem, model))

    def refined(self, problem: Problem, *starts: Fit) -> Fit:
        """Fit the replay, starting from other fits of one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        *starts : Fit
            Give the first coefficients; the best of them is used.

        Returns
        -------
        fit : Fit
            The end of the search, or the best replay met on the way, the starts included,
            where that runs away; the first start where none has numbers.
        """
        model = starts[0].model
        usable = [fit for fit in starts if fit.status.usable]
        if not usable:
            return empty_fit(problem, model, self.key, starts[0].status, starts[0].remarks)
        climbed = climb(
            problem,
            model,
            [np.array(fit.damping.coefficients) for fit in usable],
            self.windows,
            self.rounds,
        )
        return _told(problem, model, self, climbed, usable)


def _told(
    problem: Problem, model: DampingModel, method: OutputError, climbed: Climb, starts: list[Fit]
) -> Fit:
    """Put the end of a search into words."""
    span = spanned(climbed.slopes(), model.labels)
    uncertainty = replay_uncertainty(climbed.search, climbed.place, method.parts)
    if uncertainty is not None and climbed.short is not None:
        uncertainty = uncertainty.widened(climbed.coefficients - climbed.short, _PUSHES)
    idle = {label for group in problem.undetermined(model) for label in group}
    remarks = (
        f"The search started from {' and '.join(fit.method for fit in starts)}; {climbed.words}",
    )
    status = Status.RANK_DEFICIENT if span.aliased else Status.OK
    return fitted(
        problem,
        model,
        method,
        # exactly zero, not the solver's 1e-17
        np.where([label in idle for label in model.labels], 0.0, climbed.coefficients),
        uncertainty=uncertainty,
        rank=span.rank,
        aliased=span.aliased,
        status=status if climbed.settled else Status.STOPPED,
        remarks=remarks,
    )


@dataclass(frozen=True)
class Recommended:
    """Output error from the best of several starts.

    The weak form is best where a model is small, ridge where columns are alike, and
    the dissipative solution where the others run away. A start that this log does not allow
    is left out; which of the others serves, the replay of the log decides. Output error then
    fits the replay itself; the place it returns does not run away when driven a little softer
    than the log, if there is such a place on its way.

    Parameters
    ----------
    starts : tuple of Method
        Tried in turn.
    search : OutputError
        What follows; its own start is not used.

    Examples
    --------
    >>> Recommended().key
    'recommended'
    """

    starts: tuple[Method, ...] = (WeakForm(), Ridge(), Dissipative())
    search: OutputError = field(default_factory=OutputError)

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "recommended"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            ``STOPPED`` where the search ended before it came to rest; the remarks say
            what it started from.
        """
        starts = [attempted(start, problem, model) for start in self.starts]
        fit = self.search.refined(problem, *starts)
        provenance = {**fit.provenance, "settings": repr(self)}
        return replace(fit, method=self.key, provenance=provenance)

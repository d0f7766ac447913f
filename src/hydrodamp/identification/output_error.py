"""Output error: the coefficients whose replay comes nearest to the log."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from hydrodamp.errors import MethodError
from hydrodamp.identification.dissipative import Dissipative
from hydrodamp.identification.fit import Fit, Method, attempted, empty_fit, fitted
from hydrodamp.identification.intervals import Uncertainty
from hydrodamp.identification.jackknife import FEWEST, replay_uncertainty
from hydrodamp.identification.linear import WeakForm
from hydrodamp.identification.ridge import Ridge
from hydrodamp.identification.search import Climb, climb
from hydrodamp.identification.triangle import spanned
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status

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


def _uncertainty(climbed: Climb, n_parts: int) -> Uncertainty | None:
    """Return how far to trust the end of a search."""
    found = replay_uncertainty(climbed.search, climbed.place, n_parts)
    if found is None or climbed.short is None:
        return found
    return found.widened(climbed.coefficients - climbed.short, _PUSHES)


def _told(
    problem: Problem, model: DampingModel, method: OutputError, climbed: Climb, starts: list[Fit]
) -> Fit:
    """Put the end of a search into words."""
    span = spanned(climbed.slopes(), model.labels)
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
        uncertainty=_uncertainty(climbed, method.parts),
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

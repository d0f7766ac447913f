"""Output error: the coefficients whose replay comes nearest to the log, window by window."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, Method, Uncertainty, empty_fit, fitted
from hydrodamp.identification.search import Place, Search, ladder, searching, starts, within
from hydrodamp.identification.triangle import spanned
from hydrodamp.identification.windows import Windows
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status

#: What the intervals make room for besides noise.
_PUSHES = "how far the shortest windows disagree with the longest"


@dataclass(frozen=True)
class OutputError:
    """Fit the open-loop replay of windows that grow: truncated simulation error.

    Windows begin every half of their length, each at the smoothed measured velocity, which is
    not adjusted: a first state that may move absorbs the slow modes that tell a stable hull
    from an unstable one. Damped Gauss-Newton steps use the sensitivities of exactly the
    Runge-Kutta steps that a replay takes. Each velocity is divided by the spread of the errors
    that the start has over the shortest windows, and small coefficients are preferred with a
    strength that the data set (evidence, MacKay 1992). After Farina and Piroddi (2010).

    Parameters
    ----------
    windows : tuple of float
        Lengths of the windows [s], rising; infinite for whole segments. Those longer than any
        segment are the same as that.

    Raises
    ------
    MethodError
        If the lengths are not positive and rising.

    Examples
    --------
    >>> OutputError().key, OutputError(windows=(5.0,)).windows
    ('oe', (5.0,))
    """

    windows: tuple[float, ...] = (2.0, 4.0, 8.0, 16.0)

    def __post_init__(self) -> None:
        """Refuse settings that make no ladder."""
        lengths = np.asarray(self.windows, dtype=np.float64)
        if not len(lengths) or not lengths[0] > 0.0 or not np.all(np.diff(lengths) > 0.0):
            raise MethodError(f"`windows` must be positive and rising [s]; got {self.windows}")

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
        free = model.restricted_to(problem.vehicle.axes)
        problem.columns.require(free)
        if not free.n_coefficients:
            return empty_fit(problem, free, self.key, Status.EMPTY)
        return self._searched(problem, free, starts(problem, free), "the weak form")

    def refined(self, problem: Problem, *fits: Fit) -> Fit:
        """Fit the replay, starting from other fits of one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        *fits : Fit
            Give the first coefficients; the best of them is used.

        Returns
        -------
        fit : Fit
            As :meth:`identify`; without numbers where no start has any.
        """
        usable = [fit for fit in fits if fit.status.usable]
        if not usable:
            return empty_fit(problem, fits[0].model, self.key, fits[0].status, fits[0].remarks)
        first = [np.array(fit.damping.coefficients) for fit in usable]
        names = " and ".join(fit.method for fit in usable)
        return self._searched(problem, usable[0].model, first, names)

    def _searched(
        self, problem: Problem, model: DampingModel, first: Sequence[FloatArray], names: str
    ) -> Fit:
        search = searching(problem, model)
        places = ladder(search, first, within(problem, self.windows))
        return told(search, model, self, places, names)


def _walked(names: str, places: Sequence[Place]) -> str:
    """Say where a search started, which windows it went through, and what prior the data set."""
    seconds = [f"{place.length:g} s" for place in places if np.isfinite(place.length)]
    windows = ", ".join([*seconds, *(["whole segments"] if len(seconds) < len(places) else [])])
    return (
        f"The search started from {names}; windows were {windows}; the prior has "
        f"{places[-1].strength:.2g} of the weight of the errors."
    )


def told(
    search: Search,
    model: DampingModel,
    method: Method,
    places: Sequence[Place],
    names: str,
) -> Fit:
    """Return the fit at the end of a search that went through some places."""
    problem, short, place = search.problem, places[0], places[-1]
    seen = search.windows(short.length).triangle(place.coefficients, place.spread)
    span = spanned(seen[:, :-1], model.labels)
    uncertainty = jackknifed(search, search.windows(place.length), place)
    if uncertainty is not None and short is not place:
        uncertainty = uncertainty.widened(place.coefficients - short.coefficients, _PUSHES)
    idle = {label for group in problem.undetermined(model) for label in group}
    status = Status.RANK_DEFICIENT if span.aliased else Status.OK
    return fitted(
        problem,
        model,
        method,
        # exactly zero, not the solver's 1e-17
        np.where([label in idle for label in model.labels], 0.0, place.coefficients),
        uncertainty=uncertainty,
        rank=span.rank,
        aliased=span.aliased,
        status=status if place.settled else Status.STOPPED,
        remarks=(_walked(names, places),),
    )


#: Parts that must be there to leave one out.
_FEWEST = 4


def jackknifed(search: Search, windows: Windows, place: Place) -> Uncertainty | None:
    """Return how far to trust the end of a search: one part after another left out.

    Each time one Gauss-Newton step is taken from the end, all from the same linearisation. To
    that comes what the prior hides: along directions of which the data tell nothing a
    coefficient may be anything that the prior allows.
    """
    normals = windows.normals(place.coefficients, place.spread)
    n, unit = len(normals), search.unit
    if n < _FEWEST:
        return None
    p, scale = len(unit), np.append(unit, 1.0)
    prior = place.strength / p * len(windows.samples) * len(place.spread)
    normals = normals * scale[:, None] * scale
    normals[:, :-1, :-1] += prior / n * np.eye(p)
    normals[:, :-1, -1] -= prior / n * place.coefficients / unit
    before, after = np.cumsum(normals, axis=0), np.cumsum(normals[::-1], axis=0)[::-1]
    rest = np.concatenate([after[1:2], before[:-2] + after[2:], before[-2:-1]])
    shrunk = rest[:, :-1, :-1] + prior / n * np.eye(p)  # the prior is not left out
    slopes = rest[:, :-1, -1] - prior / n * place.coefficients / unit
    ends = np.linalg.solve(shrunk, slopes[:, :, None])[:, :, 0]
    hidden = prior * np.linalg.inv(before[-1, :-1, :-1]) * unit[:, None]
    away = (ends - ends.mean(axis=0)) * unit
    noise = (n - 1) / n * (away.T @ away)
    return Uncertainty(
        covariance=noise + place.size * (hidden @ hidden.T),
        noise=noise,
        degrees_of_freedom=n - 1,
        method="one part of the log after another left out (jackknife)",
        block=search.problem.duration / n,
        n_blocks=n,
    )

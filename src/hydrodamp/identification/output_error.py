"""Output error: the coefficients whose replay comes nearest to the log, window by window."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, Method, Uncertainty, empty_fit, make_fit
from hydrodamp.identification.gauss_newton import (
    Iterate,
    ShootingObjective,
    admissible_lengths,
    best_initial_iterate,
    continue_over_lengths,
    initial_candidates,
    make_objective,
)
from hydrodamp.identification.qr_factor import column_span
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status

#: What the intervals make room for besides noise.
_MOVED = "how far the search moved from its start, an estimate with another bias"


@dataclass(frozen=True)
class OutputError:
    """Fit the open-loop replay of windows that grow: truncated simulation error.

    Windows begin near the smoothed measured velocity, moved as far as its own error and the fit
    together ask for: a first state that is free absorbs the slow modes that tell a stable hull
    from an unstable one, and of one that is fixed the error grows into damping. The search goes
    through windows of one length, then of one more each time, by damped Gauss-Newton steps with
    the sensitivities of exactly the Runge-Kutta steps that a replay takes. Errors of each
    velocity over each length have an unknown variance of their own (concentrated likelihood).
    Small coefficients are preferred with a strength that the data set (evidence, MacKay 1992),
    and damping that feeds no power to the motion up to three times the velocities of the log.
    After Farina and Piroddi (2010).

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
        problem = replace(problem, equations=problem.equations.restrict_to(free))
        if not free.n_coefficients:
            return empty_fit(problem, free, self.key, Status.EMPTY)
        return self._searched(problem, free)

    def _searched(self, problem: Problem, model: DampingModel) -> Fit:
        search = make_objective(problem, model)
        lengths = admissible_lengths(problem, self.windows)
        start = best_initial_iterate(search, initial_candidates(search, model), lengths[0])
        return build_fit(search, model, self, start, continue_over_lengths(search, start, lengths))


def _walked(start: Iterate, place: Iterate) -> str:
    """Say where a search started, which windows it went through, and what prior the data set."""
    if place is start:
        return (
            "This is the weak form: no search did better on parts of the log that were not fitted."
        )
    lengths = [one.windows.length for one in place.kinds]
    words = ", ".join("whole segments" if np.isinf(one) else f"{one:g} s" for one in lengths)
    return (
        f"The search started from the weak form; windows were {words}; the prior has "
        f"{place.strength:.2g} of the weight of the errors."
    )


def build_fit(
    search: ShootingObjective,
    model: DampingModel,
    method: Method,
    start: Iterate,
    place: Iterate,
    apart: FloatArray | None = None,
) -> Fit:
    """Return the fit at a place, the end of a search or its start.

    ``apart`` is half of what searches through two halves of the log differ by.
    """
    problem = search.problem
    shortest = place.kinds[0]
    root = shortest.windows.triangle(place.coefficients, shortest.spread)
    span = column_span(root[:, :-1], model.labels)
    uncertainty = jackknife_uncertainty(search, place)
    if uncertainty is not None and apart is not None:
        uncertainty = uncertainty.rescale(_beyond_linear(uncertainty, apart, search.entries[1]))
    if uncertainty is not None and start is not place:
        uncertainty = uncertainty.inflate(place.coefficients - start.coefficients, _MOVED)
    idle = {label for group in problem.undetermined(model) for label in group}
    status = Status.RANK_DEFICIENT if span.aliased else Status.OK
    return make_fit(
        problem,
        model,
        method,
        # exactly zero, not the solver's 1e-17
        np.where([label in idle for label in model.labels], 0.0, place.coefficients),
        uncertainty=uncertainty,
        rank=span.rank,
        aliased=span.aliased,
        status=status if place.converged or place is start else Status.STOPPED,
        remarks=(_walked(start, place),),
    )


def _beyond_linear(uncertainty: Uncertainty, apart: FloatArray, axes: IntArray) -> FloatArray:
    """Return by what factor two searches differ more than standard errors say, each axis alike.

    One linearisation does not see that far from its place errors bend.
    """
    error = uncertainty.noise_only.standard_errors
    share = np.divide(apart, error, out=np.zeros_like(apart), where=error > 0.0) ** 2
    count = np.bincount(axes, minlength=6)
    square = np.bincount(axes, share, minlength=6) / np.maximum(count, 1)
    return np.sqrt(np.maximum(square, 1.0))[axes]


#: Parts that must be there to leave one out, and parts at most.
_FEWEST, _MOST = 4, 32


@factorisation("normal matrix of the windows")
def jackknife_uncertainty(search: ShootingObjective, place: Iterate) -> Uncertainty | None:
    """Return how far to trust the end of a search: one part of the log after another left out.

    Each time one Gauss-Newton step is taken from the end, all from the same linearisation. To
    that comes what the prior hides: along directions of which the data tell nothing a
    coefficient may be anything that the prior allows.
    """
    n, unit = min(_MOST, len(place.kinds[0].windows.bounds)), search.unit
    if n < _FEWEST:
        return None
    p, scale = len(unit), np.append(unit, 1.0)
    normals: FloatArray = np.zeros((n, p + 1, p + 1))
    for windows, spread, *_ in place.kinds:
        share = len(place.kinds) * len(windows.samples) * len(spread)
        normals += windows.normals(place.coefficients, spread, n) / share
    normals *= scale[:, None] * scale
    prior = place.strength / p
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

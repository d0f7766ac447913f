"""The optimiser: manoeuvres found one after another, each the best complement of those before.

With I(m) the Fisher information of manoeuvre m, P the inverse prior covariance and w the ratio of a
fit's standard errors to the Cramer-Rao bound, the dive m_1 ... m_n has the expected covariance

    C = (W^-1 sum I(m_k) W^-1 + P)^-1,  W = diag(w),

and manoeuvre n minimises, over m_n and averaged over the ensemble of damping coefficients,

    J(m_n) = phi(C) + a max(v(m_n) + f, 0) + b s(m_n).

phi is the criterion of :class:`Objective`, a logarithm of standard errors; v the largest violation
of a limit of the envelope as a share of that limit, with the share f left free; s the share of time
for which an actuator is at its limit or rate limit, the most of any. All terms are dimensionless:
what saves 1/b of the time at limits is worth a factor e in all standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from hydrodamp.arrays import FloatArray
from hydrodamp.experiment_design.closed_loop import (
    ClosedLoopSimulator,
    Trajectories,
    limit_violations,
    saturation,
)
from hydrodamp.experiment_design.excitation import Manoeuvre, candidate_manoeuvres
from hydrodamp.experiment_design.fisher_information import ErrorModel, fisher_information
from hydrodamp.experiment_design.guidance import follow_tracks

Criterion = Literal["determinant", "worst", "replay"]

#: Candidates of each generation, and generations.
_MEMBERS, _GENERATIONS = 14, 4

#: Weight a of a violation, and share f of each limit left free for what comes before and after.
_COST, _FREE = 20.0, 0.05

#: Weight b of time at actuator limits.
_SATURATION = 10.0

#: The norm that stands for the worst of several numbers.
_NORM = 8.0


@dataclass(frozen=True, eq=False)
class Objective:
    """What a dive is to make small.

    Attributes
    ----------
    criterion : {"determinant", "worst", "replay"}
        The volume of the coefficients' errors, the worst standard error against what is allowed,
        or the expected error of a replay.
    allowed : ndarray, shape (p,)
        Standard error of each coefficient that would do.
    replay : ndarray, shape (p, p)
        What replays are off by, squared, per error of the coefficients.
    wider : ndarray, shape (p,)
        By how much standard errors of fits exceed the bound.
    known : ndarray, shape (p, p)
        Information there is before.
    """

    criterion: Criterion
    target_std_errors: FloatArray
    replay_information: FloatArray
    std_error_inflation: FloatArray
    prior_information: FloatArray

    def optimality_criterion(self, information: FloatArray, share: float) -> FloatArray:
        """Return phi after this share of a dive, from its Fisher information, shape (n,)."""
        unit, wider = (
            np.outer(self.target_std_errors, self.target_std_errors),
            np.outer(self.std_error_inflation, self.std_error_inflation),
        )
        whole = np.linalg.inv(information / share / wider + self.prior_information) / unit
        return np.asarray(np.mean(self._size(whole), axis=-1))

    def _size(self, covariance: FloatArray) -> FloatArray:
        if self.criterion == "determinant":
            return np.asarray(0.5 * np.linalg.slogdet(covariance)[1] / len(self.target_std_errors))
        if self.criterion == "worst":
            square = np.maximum(np.einsum("...pp->...p", covariance), 0.0)
            return np.asarray(0.5 / _NORM * np.log(np.sum(square**_NORM, axis=-1)))
        weight = self.replay_information * np.outer(self.target_std_errors, self.target_std_errors)
        return np.asarray(0.5 * np.log(np.einsum("...pq,pq->...", covariance, weight)))


@dataclass(frozen=True, eq=False)
class Optimiser:
    """Searches manoeuvres of a number of samples for a few members of the ensemble.

    With a radius of acceptance [m] manoeuvres are executed along waypoints.
    """

    closed_loop: ClosedLoopSimulator
    error_model: ErrorModel
    objective: Objective
    samples: int
    acceptance: float | None = None

    def evaluate(
        self, several: Sequence[Manoeuvre]
    ) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
        """Return Fisher information (n, members, p, p), violations and saturation (n, members)."""
        if self.acceptance is None:
            trajectories = simulate_candidates(self.closed_loop, several, self.samples)
        else:
            nominal = self.closed_loop.with_members([0])
            planned = simulate_candidates(nominal, several, self.samples)
            trajectories, _ = follow_tracks(self.closed_loop, planned, self.acceptance)
        found = fisher_information(self.closed_loop, trajectories, self.error_model)
        shape = len(several), len(self.closed_loop.matrices)
        shares = saturation(self.closed_loop.autopilot, trajectories)
        return (
            found.reshape(*shape, *found.shape[1:]),
            worst_violation(self.closed_loop, trajectories),
            {name: share.reshape(shape) for name, share in shares.items()},
        )

    def best_manoeuvre(
        self, information: FloatArray, share: float, start: Sequence[Manoeuvre], seed: int
    ) -> tuple[Manoeuvre, FloatArray]:
        """Return the manoeuvre that best follows, and the Fisher information with it."""
        best: list[tuple[float, Manoeuvre, FloatArray]] = []

        def cost(numbers: FloatArray, /) -> Any:
            several = [Manoeuvre.from_design_vector(one) for one in np.atleast_2d(numbers.T)]
            added, violation, saturated = self.evaluate(several)
            after = added + information
            outside = np.maximum(violation + _FREE, 0.0).max(axis=1)
            shares = (np.mean(one, axis=1) for one in saturated.values())
            at_limit = np.max([np.zeros(len(several)), *shares], axis=0)
            costs = (
                self.objective.optimality_criterion(after, share)
                + _COST * outside
                + _SATURATION * at_limit
            )
            index = int(np.argmin(costs))
            best.append((float(costs[index]), several[index], after[index]))
            return costs

        first = np.array([one.numbers for one in start])
        differential_evolution(
            cost,
            Bounds(np.zeros(first.shape[1]), np.ones(first.shape[1])),
            init=np.clip(first, 0.0, 1.0),
            maxiter=_GENERATIONS,
            vectorized=True,
            updating="deferred",
            polish=False,
            rng=seed,
        )
        _, manoeuvre, after = min(best, key=lambda one: one[0])
        return manoeuvre, after

    def optimise_dive(
        self, stretches: int, seed: int, done: Callable[[], None] = lambda: None
    ) -> list[Manoeuvre]:
        """Return the manoeuvres of a dive in order."""
        p = len(self.objective.target_std_errors)
        found: list[Manoeuvre] = []
        information = np.zeros((len(self.closed_loop.matrices), p, p))
        offered = candidate_manoeuvres(len(self.closed_loop.autopilot.overlays))
        for number in range(stretches):
            rng = np.random.default_rng([seed, number])
            start = [*found[-3:], *(offered[i] for i in rng.permutation(len(offered)))][:_MEMBERS]
            manoeuvre, information = self.best_manoeuvre(
                information, (number + 1) / stretches, start, seed + number
            )
            found.append(manoeuvre)
            done()
        return found


def simulate_candidates(
    closed_loop: ClosedLoopSimulator, several: Sequence[Manoeuvre], samples: int
) -> Trajectories:
    """Simulate each manoeuvre for each member, from a steady run at half depth."""
    envelope, n = closed_loop.envelope, len(closed_loop.matrices)
    orders = [one.setpoints(closed_loop.autopilot, envelope, samples) for one in several]
    setpoints = np.repeat(np.stack([one for one, _ in orders], axis=1), n, axis=1)
    overlays = np.repeat(np.stack([one for _, one in orders], axis=1), n, axis=1)
    setpoints[:, :, 2] += envelope.mid_depth
    return closed_loop.simulate((setpoints, overlays))


def worst_violation(closed_loop: ClosedLoopSimulator, trajectories: Trajectories) -> FloatArray:
    """Return by how much each manoeuvre violates a limit for each member, shape (n, members)."""
    limits = limit_violations(closed_loop.envelope, trajectories, area=False).values()
    worst = np.max([one.max(axis=0) for one in limits], axis=0)
    return np.reshape(worst, (-1, len(closed_loop.matrices)))

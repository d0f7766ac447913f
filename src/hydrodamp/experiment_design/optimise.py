"""Sequential optimal design: manoeuvres added one after another by differential evolution.

With I(m) the Fisher information of manoeuvre m, P the inverse prior covariance and w the ratio of
the standard errors of fits to the Cramer-Rao bound, the dive m_1 ... m_n has the covariance

    C = (W^-1 sum I(m_k) W^-1 + P)^-1,  W = diag(w),

and manoeuvre n minimises, over m_n and averaged over the ensemble of damping coefficients,

    J(m_n) = phi(C) + a max(v(m_n) + f, 0) + b s(m_n).

phi is the criterion of :class:`Objective`, a logarithm of standard errors; v the largest violation
of a limit of the envelope as a share of that limit, with the share f left free; s the largest share
of time for which an actuator is at its limit or rate limit. All terms are dimensionless: 1/b less
time at limits is worth a factor e in all standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

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
from hydrodamp.experiment_design.fisher_information import (
    ErrorModel,
    Objective,
    fisher_information,
)
from hydrodamp.experiment_design.guidance import follow_tracks

POPULATION, MAX_GENERATIONS = 14, 4
"""Candidates of each generation, and generations, of differential evolution."""

VIOLATION_WEIGHT, LIMIT_MARGIN = 20.0, 0.05
"""Weight a of a violation; share f of each limit left free for the adjacent manoeuvres."""

SATURATION_WEIGHT = 10.0
"""Weight b of time at actuator limits."""

N_CARRIED_OVER = 3
"""Manoeuvres of the dive that are among the initial candidates of the next."""


@dataclass(frozen=True, eq=False)
class Optimiser:
    """Optimises manoeuvres of a number of samples for a few members of the ensemble.

    With a radius of acceptance [m], manoeuvres are executed along waypoints.
    """

    simulator: ClosedLoopSimulator
    error_model: ErrorModel
    objective: Objective
    samples: int
    acceptance: float | None = None

    def evaluate(
        self, candidates: Sequence[Manoeuvre]
    ) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
        """Return Fisher information (n, members, p, p), violations and saturation (n, members)."""
        simulator = self.simulator
        if self.acceptance is None:
            trajectories = simulate_candidates(simulator, candidates, self.samples)
        else:
            nominal = simulator.with_members([0])
            planned = simulate_candidates(nominal, candidates, self.samples)
            trajectories, _ = follow_tracks(simulator, planned, self.acceptance)
        information = fisher_information(simulator, trajectories, self.error_model)
        shape = len(candidates), simulator.n_members
        shares = saturation(simulator.autopilot, trajectories)
        return (
            information.reshape(*shape, *information.shape[1:]),
            worst_violation(simulator, trajectories),
            {name: share.reshape(shape) for name, share in shares.items()},
        )

    def best_manoeuvre(
        self, information: FloatArray, fraction: float, start: Sequence[Manoeuvre], seed: int
    ) -> tuple[Manoeuvre, FloatArray]:
        """Return the manoeuvre that minimises J, and the Fisher information including it."""
        best: list[tuple[float, Manoeuvre, FloatArray]] = []

        def cost(vectors: FloatArray, /) -> Any:
            candidates = [Manoeuvre.from_design_vector(row) for row in np.atleast_2d(vectors.T)]
            increment, violation, shares = self.evaluate(candidates)
            total = increment + information
            penalty = np.maximum(violation + LIMIT_MARGIN, 0.0).max(axis=1)
            mean_shares = (np.mean(share, axis=1) for share in shares.values())
            saturated = np.max([np.zeros(len(candidates)), *mean_shares], axis=0)
            criterion = self.objective.optimality_criterion(total, fraction)
            costs = criterion + VIOLATION_WEIGHT * penalty + SATURATION_WEIGHT * saturated
            index = int(np.argmin(costs))
            best.append((float(costs[index]), candidates[index], total[index]))
            return costs

        population = np.array([manoeuvre.design_vector for manoeuvre in start])
        n = population.shape[1]
        differential_evolution(
            cost,
            Bounds(np.zeros(n), np.ones(n)),
            init=np.clip(population, 0.0, 1.0),
            maxiter=MAX_GENERATIONS,
            vectorized=True,
            updating="deferred",
            polish=False,
            rng=seed,
        )
        _, manoeuvre, total = min(best, key=lambda item: item[0])
        return manoeuvre, total

    def optimise_dive(
        self, n_segments: int, seed: int, done: Callable[[], None] = lambda: None
    ) -> list[Manoeuvre]:
        """Return the manoeuvres of a dive in order."""
        p = len(self.objective.target_std_errors)
        dive: list[Manoeuvre] = []
        information = np.zeros((self.simulator.n_members, p, p))
        candidates = candidate_manoeuvres(len(self.simulator.autopilot.overlays))
        for number in range(n_segments):
            order = np.random.default_rng([seed, number]).permutation(len(candidates))
            start = [*dive[-N_CARRIED_OVER:], *(candidates[index] for index in order)][:POPULATION]
            manoeuvre, information = self.best_manoeuvre(
                information, (number + 1) / n_segments, start, seed + number
            )
            dive.append(manoeuvre)
            done()
        return dive


def simulate_candidates(
    simulator: ClosedLoopSimulator, candidates: Sequence[Manoeuvre], samples: int
) -> Trajectories:
    """Simulate each manoeuvre for each member, from a steady state at mid-depth."""
    envelope = simulator.envelope
    pairs = [item.setpoints(simulator.autopilot, envelope, samples) for item in candidates]
    setpoints, overlays = (
        np.repeat(np.stack(arrays, axis=1), simulator.n_members, axis=1)
        for arrays in zip(*pairs, strict=True)
    )
    setpoints[:, :, 2] += envelope.mid_depth
    return simulator.simulate((setpoints, overlays))


def worst_violation(simulator: ClosedLoopSimulator, trajectories: Trajectories) -> FloatArray:
    """Return the largest violation of any limit, shape (n, members)."""
    violations = limit_violations(simulator.envelope, trajectories, area=False).values()
    worst = np.max([violation.max(axis=0) for violation in violations], axis=0)
    return np.reshape(worst, (-1, simulator.n_members))

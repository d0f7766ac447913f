"""Greedy optimal design: manoeuvres added one after another by differential evolution.

With I(m) the Fisher information of manoeuvre m, P the inverse prior covariance and w the ratio of
the standard errors of fits to the Cramer-Rao bound, the dive m_1 ... m_n has the covariance

    C = (W^-1 sum I(m_k) W^-1 + P)^-1,  W = diag(w),

and manoeuvre n minimises, over m_n and averaged over the ensemble of damping coefficients,

    J(m_n) = log det(C) / (2 p) + a max(v(m_n) + f, 0) + b s(m_n).

The first term is a mean logarithm of p standard errors; v the largest violation of a limit of the
envelope by any member, relative to that limit, and f a margin; s the largest share of time for
which an actuator is at its limit or rate limit. All terms are dimensionless: a
share 1/b of time at limits costs as much as a factor e in all standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from hydrodamp.arrays import FloatArray
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.guidance import Manoeuvre, candidate_manoeuvres, follow_tracks
from hydrodamp.identification.continuation import INITIAL_STATE_FACTOR, window_lengths
from hydrodamp.identification.gauss_newton import split_windows
from hydrodamp.identification.information import fisher_information
from hydrodamp.identification.multiple_shooting import MAX_RELATIVE_STEP, VelocityOutputs, Windows
from hydrodamp.simulation.problem import build_problem

MIN_STD = 1e-6
"""Least standard deviation of residuals [m/s, rad/s]."""


def ensemble_information(
    simulator: ClosedLoopSimulator, trajectories: Trajectories, time_scale: float
) -> FloatArray:
    """Return the Fisher information in each vehicle's log, shape (n, p, p).

    ``time_scale`` [s] is that of the motion, which gives the windows of output error.
    """
    vehicle, model, members = simulator.vehicle, simulator.ensemble.model, simulator.n_members
    extended = simulator.ensemble.extended_model.restricted_to(vehicle.axes)
    log = trajectories.log(vehicle, simulator.autopilot.names, exact=True)
    # Simulated vehicles may tumble: all samples count, however implausible.
    problem = build_problem(vehicle, log, (extended,))
    length = window_lengths(problem, time_scale)[-1]
    bounds, free = split_windows(problem, length), np.flatnonzero(vehicle.free)
    std = np.maximum(simulator.envelope.noise_std[free], MIN_STD)
    states, max_step = problem.inputs.velocity[bounds[:, 0]], MAX_RELATIVE_STEP * time_scale
    n, rows = trajectories.states.shape[1], problem.equations.entries(model)
    of_window = np.searchsorted(problem.segments[:, 0], bounds[:, 0], side="right") - 1
    information = np.empty((n, model.n_coefficients, model.n_coefficients))
    for member, matrix in enumerate(simulator.equation.matrices[:n]):
        chosen = np.flatnonzero(of_window % members == member)
        known = replace(problem, equations=problem.equations.hold(matrix, model))
        windows = Windows(
            *(length, known, known.equations.entries(model), bounds[chosen], states[chosen]),
            *(INITIAL_STATE_FACTOR * std, max_step, VelocityOutputs()),
        )
        vehicles, block = np.unique(of_window[chosen], return_inverse=True)
        information[vehicles] = fisher_information(windows, matrix[rows], std, block)
    n_rows = np.bincount(of_window, np.diff(bounds).ravel())  # windows overlap
    share = np.diff(problem.segments).ravel() / n_rows
    return np.asarray(information * share[:, None, None])


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

    ``inflation`` (p,) is the ratio of standard errors of fits to the Cramer-Rao bound. With a
    radius of acceptance [m], manoeuvres are executed along waypoints.
    """

    simulator: ClosedLoopSimulator
    time_scale: float
    samples: int
    prior_information: FloatArray
    inflation: FloatArray
    acceptance_radius: float | None = None

    def evaluate(
        self, candidates: Sequence[Manoeuvre]
    ) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
        """Return Fisher information (n, members, p, p), violations and saturation (n, members)."""
        simulator = self.simulator
        if self.acceptance_radius is None:
            trajectories = simulate_candidates(simulator, candidates, self.samples)
        else:
            nominal = simulator.with_members([0])
            planned = simulate_candidates(nominal, candidates, self.samples)
            trajectories, _ = follow_tracks(simulator, planned, self.acceptance_radius)
        information = ensemble_information(simulator, trajectories, self.time_scale)
        shape = len(candidates), simulator.n_members
        shares = trajectories.saturation(simulator.autopilot)
        return (
            information.reshape(*shape, *information.shape[1:]),
            simulator.worst_violation(trajectories),
            {name: share.reshape(shape) for name, share in shares.items()},
        )

    def mean_log_error(self, information: FloatArray, fraction: float) -> FloatArray:
        """Return log det(C) / (2 p) of n candidates, shape (n,), averaged over the members.

        ``information`` (n, members, p, p) of a fraction of the dive is scaled to the whole dive.
        """
        inflation = np.outer(self.inflation, self.inflation)
        expected = information / fraction / inflation + self.prior_information
        half_log_det = -0.5 * np.linalg.slogdet(expected)[1]
        return np.asarray(np.mean(half_log_det, axis=-1) / len(self.inflation))

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
            criterion = self.mean_log_error(total, fraction)
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
        p, dive = len(self.inflation), list[Manoeuvre]()
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
    setpoints, overlays = (np.stack(arrays, axis=1) for arrays in zip(*pairs, strict=True))
    setpoints[:, :, 2] += envelope.mid_depth
    return simulator.simulate((setpoints, overlays))

"""Greedy optimal design: manoeuvres added one after another by differential evolution.

With I(m) the Fisher information of manoeuvre m, P the inverse prior covariance and w the ratio of
the standard errors of fits to the Cramer-Rao bound, the dive m_1 ... m_n has the covariance

    C = (W^-1 sum I(m_k) W^-1 + P)^-1,  W = diag(w),

and manoeuvre n minimises, over m_n and averaged over the ensemble of damping coefficients,

    J(m_n) = phi(C) + a max(v(m_n) + f, 0) + b s(m_n).

phi is the criterion of :class:`Objective`, a logarithm of standard errors; v the largest violation
of a limit of the envelope by any member, relative to that limit, and f a margin; s the largest
share of time for which an actuator is at its limit or rate limit. All terms are dimensionless: a
share 1/b of time at limits costs as much as a factor e in all standard errors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from hydrodamp.arrays import FloatArray
from hydrodamp.experiment_design.closed_loop import MAX_STEP, ClosedLoopSimulator, Trajectories
from hydrodamp.experiment_design.guidance import Manoeuvre, candidate_manoeuvres, follow_tracks
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.multiple_shooting import eliminate_initial_states
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, build_problem

WINDOW = 8.0
"""Duration of a window [s], as in output error."""

N_MEANS = 10
"""Mean residuals of a window, as in output error."""

INITIAL_STATE_RATIO = 0.4
"""Standard deviation of an initial state over that of the noise, as in output error."""

MIN_STD = 1e-6
"""Least standard deviation of residuals and initial states [m/s, rad/s]."""

MINIMAX_NORM = 8.0
"""Order of the norm that approximates a maximum."""

Criterion = Literal["determinant", "worst", "replay"]


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """Standard deviations of residuals and of initial states, shape (6,) [m/s, rad/s]."""

    residual_std: FloatArray
    initial_state_std: FloatArray

    @classmethod
    def of(cls, noise_std: FloatArray) -> ErrorModel:
        """Return the error model of sensor noise."""
        initial_state_std = np.maximum(INITIAL_STATE_RATIO * noise_std, MIN_STD)
        return cls(np.maximum(noise_std, MIN_STD), initial_state_std)


def fisher_information(
    simulator: ClosedLoopSimulator,
    trajectories: Trajectories,
    error_model: ErrorModel,
    window: float = WINDOW,
) -> FloatArray:
    """Return the Fisher information in each vehicle's log, shape (n, p, p)."""
    model, n = simulator.ensemble.model, trajectories.states.shape[1]
    information = np.zeros((n, model.n_coefficients, model.n_coefficients))
    for member in range(min(simulator.n_members, n)):
        vehicles = np.arange(member, n, simulator.n_members)
        selected = trajectories.select(vehicles)
        log = selected.log(simulator.vehicle, simulator.autopilot.names, exact=True)
        # Simulated vehicles may tumble: all samples count, however implausible.
        free = simulator.ensemble.extended_model.restricted_to(simulator.vehicle.axes)
        problem = build_problem(simulator.vehicle, log, (free,))
        matrix = simulator.equation.matrices[member]
        by_window = window_information(problem, matrix, model, error_model, window)
        shape = (len(vehicles), -1, *by_window.shape[1:])
        information[vehicles] = by_window.reshape(shape).sum(axis=1)
    return information


def window_information(
    problem: Problem,
    matrix: FloatArray,
    model: DampingModel,
    error_model: ErrorModel,
    window: float = WINDOW,
) -> FloatArray:
    """Return the Fisher information in each window of a log, shape (windows, p, p)."""
    free, p = np.flatnonzero(problem.vehicle.free), model.n_coefficients
    bounds = problem.segments.tolist()
    length = max(round(window / median_step(problem)), 2)
    length = min(length, *(stop - start - 1 for start, stop in bounds))
    first = np.concatenate([np.arange(a, b - length, length) for a, b in bounds])
    _, _, sensitivities = core.replay(
        problem.equations.plant,
        matrix,
        problem.inputs,
        np.column_stack([first, first + length]),
        problem.equations.entries(model),
        max_step=MAX_STEP,
        block=max(length // N_MEANS, 1),
    )
    sensitivities = sensitivities[:, free] / error_model.residual_std[free, None]
    sensitivities = np.nan_to_num(sensitivities).reshape(len(first), -1, p + 6)
    rows = sensitivities[:, :, [*(p + free), *range(p)]]
    normals = rows.transpose(0, 2, 1) @ rows
    return eliminate_initial_states(normals, error_model.initial_state_std[free])


@dataclass(frozen=True, eq=False)
class Objective:
    """Optimality criterion of a dive.

    Attributes
    ----------
    criterion : {"determinant", "worst", "replay"}
        The function phi of the expected covariance.
    target_std_errors : ndarray, shape (p,)
        Largest standard error of each coefficient at which it is determined.
    replay_information : ndarray, shape (p, p)
        Squared error of a replay per error of the coefficients.
    std_error_inflation : ndarray, shape (p,)
        Ratio of the standard errors of fits to the Cramer-Rao bound.
    prior_information : ndarray, shape (p, p)
        Inverse covariance of the prior.
    """

    criterion: Criterion
    target_std_errors: FloatArray
    replay_information: FloatArray
    std_error_inflation: FloatArray
    prior_information: FloatArray

    def optimality_criterion(self, information: FloatArray, fraction: float) -> FloatArray:
        """Return phi of n candidates, shape (n,), given the fraction of the dive that is planned.

        ``information`` (n, members, p, p) is scaled to the whole dive; phi is the members' mean.
        """
        targets = np.outer(self.target_std_errors, self.target_std_errors)
        inflation = np.outer(self.std_error_inflation, self.std_error_inflation)
        expected = information / fraction / inflation + self.prior_information
        covariance = np.linalg.inv(expected) / targets
        if self.criterion == "determinant":
            phi = 0.5 * np.linalg.slogdet(covariance)[1] / len(self.target_std_errors)
        elif self.criterion == "worst":
            variance = np.maximum(np.einsum("...pp->...p", covariance), 0.0)
            phi = 0.5 / MINIMAX_NORM * np.log(np.sum(variance**MINIMAX_NORM, axis=-1))
        else:
            weight = self.replay_information * targets
            phi = 0.5 * np.log(np.einsum("...pq,pq->...", covariance, weight))
        return np.asarray(np.mean(phi, axis=-1))


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
        information = fisher_information(simulator, trajectories, self.error_model)
        shape = len(candidates), simulator.n_members
        shares = trajectories.saturation(simulator.autopilot)
        return (
            information.reshape(*shape, *information.shape[1:]),
            simulator.worst_violation(trajectories),
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

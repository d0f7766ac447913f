"""Fisher information of a dive, and optimality criteria of the expected covariance.

In a window the predicted velocity depends on the coefficients kappa and on its initial state nu_0.
With A = d nu / d kappa and B = d nu / d nu_0, divided by the standard deviation of the residuals,
and D the inverse variance of nu_0, the information on kappa is the Schur complement

    I = A^T A - A^T B (B^T B + D)^-1 B^T A,    summed over windows,

and I^-1 is the Cramer-Rao bound of output error (Farina and Piroddi 2010). For a covariance C of
the estimates, with target standard errors t and replay information W, the criteria are

    "determinant"  phi = log det(T^-1 C T^-1) / 2p      (D-optimality, T = diag t)
    "worst"        phi = log ||diag(T^-1 C T^-1)||_8 / 2 (minimax, as an 8-norm)
    "replay"       phi = log tr(C W) / 2                 (I-optimality of the replay error).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.experiment_design.closed_loop import ClosedLoopSimulator, Trajectories
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.multiple_shooting import MAX_STEP
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, prepare

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
        problem = prepare(simulator.vehicle, log, simulator.ensemble.extended_model)
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
    a, b = sensitivities[:, :, :p], sensitivities[:, :, p + free]
    a_t, b_t = a.transpose(0, 2, 1), b.transpose(0, 2, 1)
    initial = b_t @ b + np.diag(error_model.initial_state_std[free] ** -2.0)
    mixed = b_t @ a
    return np.asarray(a_t @ a - mixed.transpose(0, 2, 1) @ np.linalg.solve(initial, mixed))


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

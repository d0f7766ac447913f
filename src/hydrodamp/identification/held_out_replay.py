"""Choice between estimates by the replay of pieces of the log that are left out.

The log is cut into pieces b. One Gauss-Newton step updates an estimate without piece b; with the
Hessian H and the gradient g of the objective on all pieces, and those without b,

    x_(b) = x + H_(-b)⁻¹ g_(-b) − H⁻¹ g.

``e_b`` is the mean square error of the replay of piece b with x_(b), each error over the standard
deviation of its velocity and clipped at one. Another estimate is better if its mean error is lower
by more than one standard error of the paired differences (one-standard-error rule, Breiman et al.
1984).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.fit import MAX_BLOCKS
from hydrodamp.identification.gauss_newton import (
    FINAL_TOLERANCE,
    MIN_DAMPING,
    Iterate,
    ShootingObjective,
    minimise,
)
from hydrodamp.simulation.problem import Problem

#: Shortest piece [samples], and rounding of the clock [pieces].
MIN_PIECE, CLOCK_ROUNDING = 8, 1e-6


def split_pieces(problem: Problem) -> IntArray:
    """Return the bounds of pieces of about equal duration of all segments."""
    pieces: list[tuple[int, int]] = []
    shares = MAX_BLOCKS * problem.durations / problem.durations.sum()
    for (start, stop), share in zip(problem.segments.tolist(), shares, strict=True):
        n = max(min(round(share), (stop - start) // MIN_PIECE), 1)
        time = problem.inputs.time[start:stop]
        edges = time[0] + (time[-1] - time[0]) * (np.arange(1, n) - CLOCK_ROUNDING) / n
        inner = start + np.searchsorted(time, edges)
        pieces += pairwise([start, *inner.tolist(), stop])
    return np.array(pieces, dtype=np.int64)


@factorisation("normal matrix of the windows")
def leave_one_out(objective: ShootingObjective, iterate: Iterate, pieces: IntArray) -> FloatArray:
    """Return the coefficients (n_pieces, p) after a Gauss-Newton step without each piece."""
    scale, p = objective.scale, len(objective.scale)
    restricted = objective.restrict(pieces)
    first = restricted.problem.segments[:, 0]
    normals: FloatArray = np.zeros((len(pieces), p + 1, p + 1))
    for previous in iterate.linearisations:
        windows = restricted.windows_like(previous.windows)
        block = np.searchsorted(first, windows.bounds[:, 0], side="right") - 1
        normals += windows.block_normal_matrices(
            iterate.coefficients, previous.residual_std / np.sqrt(objective.weights), block
        ) / (objective.residuals_per_sample * len(iterate.linearisations))
    column_scale = np.append(scale, 1.0)
    normals *= column_scale[:, None] * column_scale
    x = iterate.coefficients / scale
    penalty = objective.penalty_hessian(x, iterate.prior_strength, iterate.penalty_weight)
    size = np.diff(pieces, axis=1).ravel()
    total, n = normals.sum(axis=0), size.sum()
    means = np.concatenate([(total - normals) / (n - size)[:, None, None], total[None] / n])
    gradients = means[:, :-1, -1] - penalty @ x
    steps = np.linalg.solve(means[:, :-1, :-1] + penalty, gradients[:, :, None])[:, :, 0]
    return np.asarray((x + steps[:-1] - steps[-1]) * scale)


def replay_pieces(
    objective: ShootingObjective, pieces: IntArray, coefficients: FloatArray
) -> FloatArray:
    """Return the errors e_b (n_pieces,) of replays with coefficients (n_pieces, p)."""
    problem = objective.problem
    velocity_std = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
    velocity_std[velocity_std == 0.0] = 1.0
    windows = objective.restrict(pieces).windows(np.inf)
    errors = [
        np.clip(windows.select(slice(b, b + 1)).residuals(each) / velocity_std, -1.0, 1.0)
        for b, each in enumerate(coefficients)
    ]
    return np.array([np.mean(each**2) for each in errors])


def is_lower(errors: FloatArray, reference: FloatArray) -> bool:
    """Return whether the mean of errors (n,) is lower by more than one standard error."""
    excess = errors - reference
    return bool(excess.mean() < -excess.std(ddof=1) / np.sqrt(len(excess)))


def half_estimates(
    objective: ShootingObjective,
    pieces: IntArray,
    estimate: Callable[[ShootingObjective], FloatArray],
) -> FloatArray:
    """Return the estimates (2, p) from the even and from the odd pieces."""
    return np.array([estimate(objective.restrict(pieces[parity::2])) for parity in (0, 1)])


def update_estimate(half: ShootingObjective, *, iterate: Iterate) -> FloatArray:
    """Return an estimate after one step on a part of the log."""
    linearisations = tuple(
        previous._replace(windows=half.windows_like(previous.windows))
        for previous in iterate.linearisations
    )
    start = replace(iterate, linearisations=linearisations, damping=MIN_DAMPING)
    start = half.move(start, iterate.coefficients)
    return minimise(half, start, FINAL_TOLERANCE, max_iterations=1).coefficients

"""Estimates from parts of a log by one step, and replays of the parts that are left out.

The log is cut into pieces. With the Hessian H and the gradient g of the objective on all pieces,
and those on the pieces S, one Gauss-Newton step updates an estimate x to that of S::

    x_S = x + H_S⁻¹ g_S − H⁻¹ g

S without piece b gives the replicates of the delete-one-block jackknife, every second piece the two
halves. ``e_ib²`` is the mean square error of velocity i in the replay of part b, of several pieces,
with the estimate without it, each error over the standard deviation of its velocity and clipped at
one; ``1 − mean_b e_ib²`` is the R² of held-out replays.

The error of the form has the variance ``L_i² (1 − exp(−t/τ_i))`` a time t after the start of a
replay. Its mean over a replay of duration d is ``L_i² g(d/τ_i)``, ``g(x) = 1 − (1 − e⁻ˣ)/x``: the
ratio of the mean square errors in replays of pieces and of parts gives τ_i, and the error that the
share ``LEVEL`` of the parts does not exceed gives L_i, both less the variance of the sensor errors.
The latter is at most the least error of a part: a filter takes some of a wrong form for noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, factorisation
from hydrodamp.identification.fit import MAX_BLOCKS, MIN_BLOCKS, Uncertainty, jackknife
from hydrodamp.identification.gauss_newton import Iterate, ShootingObjective
from hydrodamp.identification.multiple_shooting import VelocityOutputs
from hydrodamp.simulation.problem import Problem

#: Parts of the log to replay: the error of a replay grows with its length.
N_PARTS = 8

#: Share of the parts whose error a mission is not to exceed.
LEVEL = 0.9

#: Rise times of the error of the form, over the duration of a part.
RISE_TIMES = np.logspace(-3.0, 0.0, 61)

#: Least standard deviation of a velocity that moves, over the noise floor of the objective.
MIN_MOTION = 4.0

#: Shortest piece [samples], and rounding of the clock [pieces].
MIN_PIECE, CLOCK_ROUNDING = 8, 1e-6


def split_pieces(problem: Problem, n_pieces: int = MAX_BLOCKS) -> IntArray:
    """Return the bounds of pieces of about equal duration of all segments."""
    pieces: list[tuple[int, int]] = []
    shares = n_pieces * problem.durations / problem.durations.sum()
    for (start, stop), share in zip(problem.segments.tolist(), shares, strict=True):
        n = max(min(round(share), (stop - start) // MIN_PIECE), 1)
        time = problem.inputs.time[start:stop]
        edges = time[0] + (time[-1] - time[0]) * (np.arange(1, n) - CLOCK_ROUNDING) / n
        inner = start + np.searchsorted(time, edges)
        pieces += pairwise([start, *inner.tolist(), stop])
    return np.array(pieces, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class PieceNormals:
    """Normal equations (n_pieces, p + 1, p + 1) of pieces of a log at an iterate, in x."""

    objective: ShootingObjective
    iterate: Iterate
    pieces: IntArray
    normals: FloatArray

    @classmethod
    def of(
        cls, objective: ShootingObjective, iterate: Iterate, pieces: IntArray | None = None
    ) -> PieceNormals:
        """Linearise the residuals of each piece."""
        pieces = split_pieces(objective.problem) if pieces is None else pieces
        p = len(objective.scale)
        restricted = objective.restrict(pieces)
        first = restricted.problem.segments[:, 0]
        normals: FloatArray = np.zeros((len(pieces), p + 1, p + 1))
        for previous in iterate.linearisations:
            windows = restricted.windows_like(previous.windows)
            block = np.searchsorted(first, windows.bounds[:, 0], side="right") - 1
            std = previous.residual_std / np.sqrt(objective.weights)
            normals += windows.block_normal_matrices(iterate.coefficients, std, block)
        scale = np.append(objective.scale, 1.0)
        normals *= scale[:, None] * scale
        n_lengths = len(iterate.linearisations)
        return cls(
            objective, iterate, pieces, normals / (objective.residuals_per_sample * n_lengths)
        )

    @factorisation("normal matrix of the windows")
    def estimates(self, is_used: BoolArray) -> FloatArray:
        """Return the estimates (m, p) from the pieces that each row (m, n_pieces) uses."""
        iterate, scale = self.iterate, self.objective.scale
        x = iterate.coefficients / scale
        penalty = self.objective.penalty_hessian(x, iterate.prior_strength, iterate.penalty_weight)
        weights = np.vstack([is_used, np.ones(len(self.pieces))])
        size = weights @ np.diff(self.pieces).ravel()
        means = np.tensordot(weights, self.normals, 1) / size[:, None, None]
        gradients = means[:, :-1, -1] - penalty @ x
        steps = np.linalg.solve(means[:, :-1, :-1] + penalty, gradients[:, :, None])[:, :, 0]
        return np.asarray((x + steps[:-1] - steps[-1]) * scale)

    @cached_property
    def replicates(self) -> FloatArray:
        """The estimates (n_pieces, p) without each piece."""
        if len(self.pieces) == 1:
            return np.empty((0, len(self.objective.scale)))
        return self.estimates(~np.eye(len(self.pieces), dtype=bool))

    @cached_property
    def half_difference(self) -> FloatArray:
        """Half the difference (p,) of the estimates from the even and the odd pieces."""
        if len(self.pieces) == 1:
            return np.full(len(self.objective.scale), np.nan)
        is_even = np.arange(len(self.pieces)) % 2 == 0
        even, odd = self.estimates(np.array([is_even, ~is_even]))
        return np.asarray((even - odd) / 2.0)

    @cached_property
    def held_out_errors(self) -> FloatArray:
        """Errors e_ib² (n_parts, f) of replays of parts by estimates without them."""
        if len(self.parts) == 1:
            return np.ones((1, np.count_nonzero(self.objective.problem.vehicle.free)))
        return replay_pieces(self.objective, self.parts, self.estimates(~self._is_inside))

    @cached_property
    def parts(self) -> IntArray:
        """Bounds of the parts of the log."""
        return split_pieces(self.objective.problem, N_PARTS)

    @property
    def _is_inside(self) -> BoolArray:
        """Whether part b (n_parts, n_pieces) has the piece."""
        middle = self.pieces.mean(axis=1)
        return np.asarray((middle >= self.parts[:, :1]) & (middle < self.parts[:, 1:]))

    @property
    def held_out_r_squared(self) -> dict[str, float]:
        """1 − mean_b e_ib² of each free velocity, by axis."""
        values = 1.0 - self.held_out_errors.mean(axis=0)
        return dict(zip(self.objective.problem.vehicle.axes, values.tolist(), strict=True))

    @property
    def moving_r_squared(self) -> dict[str, float]:
        """The same of velocities that move."""
        pairs = zip(self.held_out_r_squared.items(), self.motion.tolist(), strict=True)
        return {axis: value for (axis, value), size in pairs if size}

    @cached_property
    def motion(self) -> FloatArray:
        """Standard deviation (f,) of the velocities, zero where it may be noise."""
        problem = self.objective.problem
        std = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
        return np.where(std > MIN_MOTION * self.objective.noise_std, std, 0.0)

    def form_errors(self, sensor_std: FloatArray | float) -> dict[str, tuple[float, float, float]]:
        """Return L_i, τ_i [s] and the standard deviation of each velocity, by axis."""
        problem = self.objective.problem
        if len(self.parts) == 1:
            return {}
        variance = np.var(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
        long = self.held_out_errors * variance
        sensor = np.minimum(sensor_std**2, long.min(axis=0))
        estimates = self.estimates(~self._is_inside)[self._is_inside.argmax(axis=0)]
        short = replay_pieces(self.objective, self.pieces, estimates) * variance
        means = np.maximum(np.mean(short, axis=0) - sensor, 0.0), np.mean(long, axis=0) - sensor
        ratio = np.divide(*means, out=np.ones_like(sensor), where=means[1] > 0.0)
        time = problem.inputs.time
        durations = [
            float(np.median(time[each[:, 1] - 1] - time[each[:, 0]]))
            for each in (self.pieces, self.parts)
        ]
        of_pieces, of_parts = (_mean_rise(each / durations[1] / RISE_TIMES) for each in durations)
        rise = np.interp(-ratio, -of_pieces / of_parts, RISE_TIMES)
        square = np.quantile(long, LEVEL, axis=0) - sensor
        level = np.sqrt(square / _mean_rise(1.0 / rise))
        sizes = np.array([level, rise * durations[1], np.sqrt(variance)]).T.tolist()
        return dict(zip(problem.vehicle.axes, map(tuple, sizes), strict=True))


def _mean_rise(x: FloatArray) -> FloatArray:
    """Return the mean of 1 − e⁻ˢ over s from 0 to x."""
    return np.asarray(1.0 + np.expm1(-x) / x)


def replay_pieces(
    objective: ShootingObjective, pieces: IntArray, coefficients: FloatArray
) -> FloatArray:
    """Return the errors e_ib² (n_pieces, f) of replays with coefficients (n_pieces, p)."""
    problem = objective.problem
    velocity_std = np.std(problem.inputs.velocity[:, problem.vehicle.free], axis=0)
    windows, errors = objective.restrict(pieces).windows(np.inf), []
    for b, each in enumerate(coefficients):
        window = windows.outputs.apply_plant(windows.select(slice(b, b + 1)), each)
        residuals = next(VelocityOutputs().residuals(*window)).residuals
        ratio = np.divide(
            residuals, velocity_std, out=np.ones_like(residuals), where=velocity_std > 0.0
        )
        errors.append(np.mean(np.clip(ratio, -1.0, 1.0) ** 2, axis=0))
    return np.array(errors)


@factorisation("normal matrix of the windows")
def jackknife_uncertainty(
    objective: ShootingObjective, result: Iterate, replicates: FloatArray
) -> Uncertainty | None:
    """Return the jackknife covariance of replicates (n_blocks, p), plus the prior variance.

    With Hessian H, the prior adds ``σ_κ² (λ/p)² H⁻²``: the variance of directions that the data do
    not determine.
    """
    if len(replicates) < MIN_BLOCKS:
        return None
    p = objective.n_coefficients
    scale = objective.scale[:p]
    uncertainty = jackknife(replicates[:, :p], objective.problem.duration)
    prior = result.prior_strength / p
    hessian = objective.gauss_newton(result)[0][:p, :p] + prior * np.eye(p)
    prior_root = prior * np.linalg.inv(hessian) * scale[:, None]
    variance = result.prior_variance * (prior_root @ prior_root.T)
    noise = uncertainty.covariance
    return replace(uncertainty, covariance=noise + variance, noise=noise)


def half_difference_factors(
    uncertainty: Uncertainty, half_difference: FloatArray, axes: IntArray
) -> FloatArray:
    """Return the RMS difference of halves over standard errors on each axis, at least 1.

    It covers the curvature of the objective, which one linearisation does not.
    """
    error = uncertainty.noise_only.standard_errors
    ratio = np.divide(half_difference, error, out=np.zeros_like(error), where=error > 0.0) ** 2
    count = np.bincount(axes, minlength=6)
    mean_square = np.bincount(axes, ratio, minlength=6) / np.maximum(count, 1)
    return np.sqrt(np.maximum(mean_square, 1.0))[axes]


@factorisation("Fisher information of the innovations")
def information_covariance(objective: ShootingObjective, result: Iterate) -> FloatArray:
    """Return the inverse of the Fisher information of coefficients and parameters, (q, q).

    The penalty on energy injection is no information: the truth may lie well inside its bound.
    """
    x = result.coefficients / objective.scale
    hessian = objective.gauss_newton(result)[0]
    hessian += objective.penalty_hessian(x, result.prior_strength, 0.0)
    scale = np.outer(objective.scale, objective.scale)
    return np.asarray(np.linalg.inv(hessian) * scale / objective.counts.sum())


def information_uncertainty(known: FloatArray, scattered: Uncertainty) -> Uncertainty:
    """Return the inverse of the Fisher information, scaled to the scatter of other estimates.

    Its noise is not scaled: the curvature of the objective scatters the coefficients along valleys
    in which they predict the same motion.
    """
    variance, total = np.diag(known), np.diag(scattered.covariance)
    ratio = np.divide(total, variance, out=np.ones(len(known)), where=variance > 0.0)
    return Uncertainty(
        known * np.mean(np.maximum(ratio, 1.0)),
        scattered.degrees_of_freedom,
        f"the Fisher information of the innovations, scaled to {scattered.method}",
        known,
    )

"""Prediction errors along the path of an extended Kalman filter: pushes and coloured errors.

The states are the velocity ν, a push d on each axis of the wrench, and an error n of each measured
velocity, with white w and e::

    ν_t+1 = φ(ν_t, κ) + B_t d_t,    d_t+1 = exp(−T/τ) d_t + w_t
    y_t = ν_t + n_t,    n_t+1 = a n_t + e_t

The filter corrects ν, d and n at every sample; the residuals are the innovations over the Cholesky
factor of their covariance. Their derivatives on κ follow the same recursion, gains and B held.
An autopilot answers a push with commands, which are then correlated with it; an innovation is
independent of all that went before, so the estimate is consistent in closed loop (U. Forssell and
L. Ljung, "Closed-loop identification revisited" (1999), doi:10.1016/S0005-1098(99)00022-9). The
standard deviations of d and n, τ and the a minimise ``Σ_t |r_t|²/2 + log |C_t|`` of the innovations
r and their factors C at the coefficients of the previous estimate, by scoring on their logarithms;
then each push without which the likelihood is no lower is zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.identification.continuation import (
    INITIAL_STATE_FACTOR,
    minimise_finally,
    update_prior,
)
from hydrodamp.identification.differentiation import median_step
from hydrodamp.identification.gauss_newton import (
    MAX_DAMPING_TRIALS,
    MIN_DAMPING,
    Iterate,
    ShootingObjective,
)
from hydrodamp.identification.multiple_shooting import (
    KnownPlant,
    LinearisedResiduals,
    ResidualSeries,
    Windows,
)
from hydrodamp.identification.parameters import Parameter
from hydrodamp.identification.rebuilt_outputs import fix_parameters
from hydrodamp.kernels.kalman import NO_ENTRIES, Noise, filter_replay

#: Innovation after a divergence [1], and slope from which it is one, whose square is finite.
DIVERGED, MAX_SLOPE = 1e3, 1e100

#: Longest run of samples, of which a part of the log is made.
MAX_RUN = 300

#: Initial noise: pushes over the RMS inertial force of the axis, their time constant over the time
#: scale of the motion, and correlation of the errors of successive samples.
PUSH_SHARE, RELATIVE_TIME, CORRELATION = 0.2, 2.0, 0.3

#: Smallest initial error of a sensor over the RMS of its velocity.
MIN_SENSOR = 1e-3

#: Shortest time constant of the pushes [sampling steps].
MIN_TIME = 4.0

#: Samples of each estimate of the noise, and decrease of J below which the minimisation with it
#: ends, over p / N: a share of the expected decrease of −2 log-likelihood from the true to the
#: estimated coefficients.
ROUNDS = (600, 0.1), (1800, 0.005), (1800, 0.005)

#: Weight of the squared logarithms of noise parameters over their initial values.
NOISE_WEIGHT = 0.05

#: Scoring steps, decrease of the cost at which they end, and difference of the logarithms.
MAX_SCORING, SCORING_TOLERANCE, LOG_STEP = 6, 1.0, 0.05


@dataclass(frozen=True, eq=False)
class FilteredOutputs(KnownPlant):
    """The innovations of the velocities of the free axes, times their mean standard deviations.

    Their log mean square is then ``Σ_t log |C_t|`` and the likelihood, also where C follows κ.
    """

    noise: Noise
    interval: float = 0.0
    parameters: tuple[Parameter, ...] = ()
    samples_per_residual: float = 1.0

    def jacobian_entries(self, windows: Windows) -> int:
        """Return the entries of the Jacobian of a window."""
        length = int(np.diff(windows.bounds, axis=1).max())
        return 6 * length * (len(windows.entries[0]) + 6)

    def weights(self, counts: FloatArray) -> FloatArray:
        """Return ones: the velocities have the same number of residuals."""
        return np.ones(len(counts))

    def select(self, samples: IntArray) -> FilteredOutputs:
        """Return the outputs of some samples."""
        return self

    def residuals(self, windows: Windows, parameters: FloatArray) -> Iterator[ResidualSeries]:
        """Yield the innovations (n, f)."""
        window = np.repeat(np.arange(len(windows.spans)), np.diff(windows.spans, axis=1).ravel())
        innovations, log_std, _ = filter_windows(windows, parameters, self.noise)
        time = windows.problem.inputs.time[windows.samples]
        yield ResidualSeries(window, time, mean_factor(log_std) * innovations)

    def linearise(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> LinearisedResiduals:
        """Linearise the innovations."""
        entries, f = windows.entries, len(windows.free)
        innovations, log_std, slopes = filter_windows(windows, parameters, self.noise, entries)
        p = slopes.shape[2] - f
        unit = mean_factor(log_std)
        weight = unit / residual_std
        columns = np.empty((len(innovations), f, f + p + 1))
        np.multiply(slopes[:, :, p:], weight[:, None], out=columns[:, :, :f])
        np.multiply(slopes[:, :, :p], weight[:, None], out=columns[:, :, f:-1])
        np.multiply(innovations, weight, out=columns[:, :, -1])
        edges = np.append(windows.spans[:, 0], len(innovations))
        columns[innovations[:, 0] == DIVERGED] = 0.0
        square = np.sum((unit * innovations) ** 2, axis=0)
        output = np.tile(np.arange(f), len(innovations))
        number = np.full(f, float(len(innovations)))
        rows = columns.reshape(-1, f + p + 1)
        return LinearisedResiduals(rows, f * edges, output, square, number)

    def averages(
        self, windows: Windows, parameters: FloatArray, residual_std: FloatArray
    ) -> FloatArray:
        """Return the innovations of a linearisation without slopes, NaN after a divergence."""
        innovations, log_std, _ = filter_windows(windows, parameters, self.noise)
        innovations[innovations == DIVERGED] = np.nan
        return np.asarray(innovations * mean_factor(log_std) / residual_std).ravel()


def mean_factor(log_std: FloatArray) -> FloatArray:
    """Return the geometric means (f,) of the innovations' standard deviations."""
    return np.asarray(np.exp(log_std.mean(axis=0)))


def filter_windows(
    windows: Windows,
    parameters: FloatArray,
    noise: Noise,
    entries: tuple[np.ndarray, np.ndarray] = NO_ENTRIES,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return innovations, logarithms of their factors (n, f), and slopes (n, f, p + f).

    After a divergence they are ``DIVERGED``, zero and zero.
    """
    equations, free = windows.problem.equations, windows.free
    matrix = equations.with_unknown(windows.entries, parameters[: len(windows.entries[0])])
    measured = windows.problem.inputs.velocity[windows.samples]
    innovations, log_std, slopes = filter_replay(
        equations.plant,
        matrix,
        windows.inputs,
        measured,
        windows.spans,
        noise,
        entries,
        max_step=windows.max_step,
        slopes=windows.plant_slopes,
    )
    with np.errstate(invalid="ignore"):
        is_small = (np.abs(innovations) < DIVERGED).all(axis=1)
        is_lost = ~(is_small & (np.abs(slopes) < MAX_SLOPE).all(axis=(1, 2)))
    innovations[is_lost], log_std[is_lost], slopes[is_lost] = DIVERGED, 0.0, 0.0
    if len(free) < 6:
        p = slopes.shape[2] - 6
        columns = np.append(np.arange(p), p + free)
        return innovations[:, free], log_std[:, free], slopes[:, free][:, :, columns]
    return innovations, log_std, slopes


def project_states(
    windows: Windows, innovations: FloatArray, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return innovations (n, f) and slopes (n, f, p) without what initial states explain."""
    f, p = innovations.shape[1], slopes.shape[2] - innovations.shape[1]
    rows = np.concatenate([slopes, innovations[:, :, None]], axis=2)
    for start, stop in windows.spans.tolist():
        run = rows[start:stop].reshape(-1, rows.shape[2])
        states, columns = run[:, p : p + f], np.delete(run, np.s_[p : p + f], axis=1)
        columns -= states @ (np.linalg.pinv(states.T @ states) @ (states.T @ columns))
        run[:, :p], run[:, -1] = columns[:, :-1], columns[:, -1]
    return rows[:, :, -1], rows[:, :, :p]


def initial_noise(objective: ShootingObjective) -> Noise:
    """Return the noise from which its likelihood is maximised."""
    problem, step = objective.problem, median_step(objective.problem)
    free = problem.vehicle.free
    acceleration = np.concatenate(
        [
            np.gradient(objective.velocity[start:stop], problem.inputs.time[start:stop], axis=0)
            for start, stop in problem.segments.tolist()
        ]
    )
    inertia = acceleration @ problem.vehicle.mass_matrix.T
    push = np.where(free, PUSH_SHARE * np.sqrt(np.mean(inertia**2, axis=0)), 0.0)
    sensor = np.ones(6)
    floor = MIN_SENSOR * np.sqrt(np.mean(problem.inputs.velocity[:, free] ** 2, axis=0))
    sensor[free] = np.maximum(3.0 * objective.noise_std, floor)
    time_constant = max(RELATIVE_TIME * objective.time_scale, 5.0 * step)
    return Noise(push, sensor, np.full(6, CORRELATION), time_constant, step)


def minimise_prediction_errors(
    objective: ShootingObjective, result: Iterate
) -> Iterator[tuple[ShootingObjective, Iterate]]:
    """Yield the objective of the innovations and its minimum from the estimate of windows.

    The noise is estimated at the estimate of windows, then at each minimum. It starts from the same
    noise each time: a strength that vanishes at a biased estimate has no slope to grow back from.
    """
    std = INITIAL_STATE_FACTOR * result.linearisations[-1].residual_std
    initial, iterate = initial_noise(objective), result
    for max_samples, tolerance in ROUNDS:
        fixed, at = fix_parameters(objective, iterate)
        runs = fixed.restrict(spread_runs(fixed, max_samples))
        noise = estimate_noise(runs, at.coefficients, initial)
        outputs = FilteredOutputs(noise)
        filtered = replace(
            objective,
            outputs=objective.outputs.with_base(outputs),
            noise_std=np.zeros_like(objective.noise_std),
        )
        windows = replace(filtered.windows(np.inf), initial_state_std=std)
        start = replace(iterate, linearisations=(), damping=MIN_DAMPING)
        start = update_prior(filtered, filtered.add_length(start, windows))
        iterate = minimise_finally(filtered, start, tolerance)
        yield filtered, iterate


def estimate_noise(objective: ShootingObjective, coefficients: FloatArray, noise: Noise) -> Noise:
    """Return the noise of the highest likelihood at the coefficients of an estimate."""
    windows = objective.windows(np.inf)
    free, f = windows.free, len(windows.free)

    def at(z: FloatArray) -> Noise:
        push, sensor, logit = noise.push.copy(), noise.sensor.copy(), np.zeros(6)
        push[free] *= np.exp(z[:f])
        sensor[free] *= np.exp(z[f : 2 * f])
        logit[free] = z[2 * f : 3 * f]
        odds = noise.correlation / (1.0 - noise.correlation) * np.exp(logit)
        time_constant = max(noise.time_constant * float(np.exp(z[-1])), MIN_TIME * noise.step)
        return replace(
            noise,
            push=push,
            sensor=sensor,
            correlation=odds / (1.0 + odds),
            time_constant=time_constant,
        )

    def terms(z: FloatArray) -> tuple[FloatArray, FloatArray]:
        innovations, log_std, slopes = filter_windows(windows, coefficients, at(z))
        return project_states(windows, innovations, slopes)[0].ravel(), log_std.ravel()

    def misfit(values: tuple[FloatArray, FloatArray]) -> float:
        return 0.5 * float(values[0] @ values[0]) + float(values[1].sum())

    def cost(z: FloatArray, values: tuple[FloatArray, FloatArray]) -> float:
        return misfit(values) + NOISE_WEIGHT * float(z @ z)

    z, damping = np.zeros(3 * f + 1), 1e-2
    values = terms(z)
    for _ in range(MAX_SCORING):
        shifted = [terms(z + LOG_STEP * unit) for unit in np.eye(len(z))]
        slopes = [
            (np.array([each[i] for each in shifted]) - values[i]) / LOG_STEP for i in range(2)
        ]
        gradient = slopes[0] @ values[0] + slopes[1].sum(axis=1) + 2.0 * NOISE_WEIGHT * z
        hessian = sum(each @ each.T for each in slopes) + 2.0 * NOISE_WEIGHT * np.eye(len(z))
        before = cost(z, values)
        for _ in range(MAX_DAMPING_TRIALS):
            step = np.linalg.solve(hessian + damping * np.diag(np.diag(hessian)), -gradient)
            trial = z + np.clip(step, -2.0, 2.0)
            trial_values = terms(trial)
            if cost(trial, trial_values) < before:
                break
            damping = max(10.0 * damping, 1e-2)
        else:
            break
        z, values, damping = trial, trial_values, damping / 10.0
        if before - cost(z, values) < SCORING_TOLERANCE:
            break
    for axis in range(f):  # the slope on the logarithm vanishes with the push
        trial = z.copy()
        trial[axis] = -np.inf
        trial_values = terms(trial)
        if misfit(trial_values) <= misfit(values):
            z, values = trial, trial_values
    return at(z)


def spread_runs(objective: ShootingObjective, max_samples: int) -> IntArray:
    """Return the bounds of runs of the log that have about ``max_samples`` samples together."""
    runs = [
        (first, min(first + MAX_RUN, stop))
        for start, stop in objective.problem.segments.tolist()
        for first in range(start, stop, MAX_RUN)
        if min(first + MAX_RUN, stop) - first > MAX_RUN // 4 or first == start
    ]
    every = -(-sum(stop - start for start, stop in runs) // max_samples)
    return np.array(runs[::every], dtype=np.int64)

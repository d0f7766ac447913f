"""How noisy velocities are, how large the terms made of them, and velocities with less noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.problem import Problem

# Samples whose terms are held at once.
_BLOCK = 4096


def median_step(problem: Problem) -> float:
    """Return the median step between samples of one segment [s]; one second where there is none."""
    steps = [np.diff(problem.inputs.time[start:stop]) for start, stop in problem.segments]
    every = np.concatenate(steps)
    return float(np.median(every)) if len(every) else 1.0


def signal_to_noise(problem: Problem) -> FloatArray:
    """Return variance over white noise of each velocity, from its fourth differences."""
    velocity = problem.inputs.velocity
    left = [np.diff(velocity[start:stop], n=4, axis=0) for start, stop in problem.segments]
    differences = np.concatenate([part for part in left if len(part)] or [np.zeros((1, 6))])
    noise = np.mean(differences**2, axis=0) / 70.0  # 70 = 1 + 16 + 36 + 16 + 1
    signal = velocity.var(axis=0)
    floor = np.maximum(noise, 1e-6 * signal)
    ratio = np.where(floor > 0.0, signal / np.where(floor > 0.0, floor, 1.0), 1.0)
    return np.maximum(ratio, 1.0)


def noise_variance(problem: Problem) -> FloatArray:
    """Return the variance of the white noise of each velocity."""
    variance: FloatArray = problem.inputs.velocity.var(axis=0) / signal_to_noise(problem)
    return variance


def mean_square(problem: Problem) -> FloatArray:
    """Return the mean square of every unknown column over a log."""
    total = np.zeros(len(problem.columns.basis))
    for start in range(0, problem.n_samples, _BLOCK):
        stop = min(start + _BLOCK, problem.n_samples)
        xi = problem.regressor(start, stop)[:, problem.columns.n_known :]
        total += np.einsum("nj,nj->j", xi, xi)
    return total / problem.n_samples


def smoothed(problem: Problem, windows: Sequence[int]) -> tuple[FloatArray, tuple[int, ...]]:
    """Return velocities by local quadratics, each over the window of the least risk.

    The windows chosen [samples] come with them; one where a velocity is best as measured. The
    risk is Stein's estimate of the mean square error under white noise.
    """
    from scipy.signal import savgol_coeffs, savgol_filter  # takes long to import

    measured, noise = problem.inputs.velocity, noise_variance(problem)
    best, velocity, chosen = noise.copy(), measured.copy(), np.ones(6, dtype=int)
    for window in windows:
        trial = measured.copy()
        for start, stop in problem.segments.tolist():
            if stop - start >= window:
                trial[start:stop] = savgol_filter(trial[start:stop], window, 2, axis=0)
        own = float(savgol_coeffs(window, 2)[window // 2])
        risk = np.mean((trial - measured) ** 2, axis=0) + (2.0 * own - 1.0) * noise
        better = risk < best
        velocity[:, better], chosen[better] = trial[:, better], window
        best = np.minimum(best, risk)
    return velocity, tuple(chosen.tolist())

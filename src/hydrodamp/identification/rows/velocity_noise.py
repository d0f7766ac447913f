"""How noisy velocities are, and how large the terms made of them."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.problem import Problem

_BLOCK = 4096
"""Samples whose terms are held at once."""


def median_step(problem: Problem) -> float:
    """Return the median step between samples of one segment [s]; one second where there is none."""
    steps = [np.diff(problem.inputs.time[start:stop]) for start, stop in problem.segments]
    every = np.concatenate(steps)
    return float(np.median(every)) if len(every) else 1.0


def signal_to_noise(problem: Problem) -> FloatArray:
    """Return variance over white noise of each velocity."""
    velocity = problem.inputs.velocity
    left = [np.diff(velocity[start:stop], n=4, axis=0) for start, stop in problem.segments]
    differences = np.concatenate([part for part in left if len(part)] or [np.zeros((1, 6))])
    noise = np.mean(differences**2, axis=0) / 70.0
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

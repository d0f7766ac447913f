"""Velocities with less noise, to evaluate terms at: each as much as its noise asks for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.identification.rows.velocity_noise import noise_variance
from hydrodamp.simulation.problem import Problem

_DEGREE = 2


@dataclass(frozen=True, eq=False)
class Smoothed:
    """Velocities with less noise."""

    velocity: FloatArray
    windows: tuple[int, ...]


def smoothed(problem: Problem, windows: Sequence[int]) -> Smoothed:
    """Smooth each velocity over the window of the least risk."""
    from scipy.signal import savgol_coeffs  # takes long to import

    measured = problem.inputs.velocity
    noise = noise_variance(problem)
    best, velocity, chosen = noise.copy(), measured.copy(), np.ones(6, dtype=int)
    for window in windows:
        trial = _local_quadratics(problem, window)
        own = float(savgol_coeffs(window, _DEGREE)[window // 2])
        risk = np.mean((trial - measured) ** 2, axis=0) + (2.0 * own - 1.0) * noise
        better = risk < best
        velocity[:, better], chosen[better] = trial[:, better], window
        best = np.minimum(best, risk)
    return Smoothed(frozen(velocity), tuple(chosen.tolist()))


def _local_quadratics(problem: Problem, window: int) -> FloatArray:
    from scipy.signal import savgol_filter  # as above

    values = problem.inputs.velocity.copy()
    for start, stop in problem.segments.tolist():
        if stop - start >= window:
            values[start:stop] = savgol_filter(values[start:stop], window, _DEGREE, axis=0)
    return values

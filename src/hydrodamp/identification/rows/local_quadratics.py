"""Velocities with less noise, to evaluate terms at: each as much as its noise asks for.

A term of a noisy velocity is wrong and stays wrong under a test function where it is
not linear; least squares then finds too small a coefficient. Local quadratics take noise
away and add a bias where the motion bends. The window of each velocity is the one of
the least estimated risk ``mean (Sν − ν)² + (2 S_kk − 1) σ²`` (C. M. Stein, "Estimation
of the mean of a multivariate normal distribution" (1981), doi:10.1214/aos/1176345632),
bias included; no smoothing has the risk σ².
"""

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
    """Velocities with less noise.

    Attributes
    ----------
    velocity : ndarray, shape (n, 6)
        [m/s, rad/s].
    windows : tuple of 6 ints
        Samples under the local quadratic of each velocity; 1 where it stands as measured.
    """

    velocity: FloatArray
    windows: tuple[int, ...]


def smoothed(problem: Problem, windows: Sequence[int]) -> Smoothed:
    """Smooth each velocity over the window of the least risk.

    Parameters
    ----------
    problem : Problem
        Velocities and segments; nothing is smoothed across a join, nor a segment shorter
        than the window. The quadratic is in the number of the sample: what an irregular
        clock makes of that counts as bias.
    windows : sequence of int
        Odd lengths to choose from, three samples or more; none at all leaves velocities
        as measured.

    Returns
    -------
    smoothed : Smoothed
        Never of more estimated risk than the measurement.
    """
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

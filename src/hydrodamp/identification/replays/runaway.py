"""Whether a model runs away a little beside the log it was fitted to.

Coefficients can replay their own log well and still run away at another speed: nothing
in the log speaks against it. So candidates are also driven through the log with every
command a tenth weaker, which stays within what was seen. What should come out is
unknown, but not that a velocity leaves the recorded range by a factor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.problem import Problem

SHARES = (0.9, 1.0)
"""Commands, recorded wrench and first velocities are multiplied by these."""

BEYOND = 5.0
"""A velocity beyond this many times the largest recorded of its kind, linear or angular,
has run away."""


def runaways(problem: Problem, matrix: FloatArray) -> int:
    """Count the replays that run away beside the log.

    Parameters
    ----------
    problem : Problem
        What was measured.
    matrix : ndarray, shape (n_columns, 6)
        All coefficients of equation 1.

    Returns
    -------
    count : int
        Segments in which a velocity left five times the recorded range, summed over
        commands at 0.9 and 1.0 times the recorded.
    """
    recorded = np.abs(problem.inputs.velocity)
    largest = BEYOND * np.repeat([recorded[:, :3].max(), recorded[:, 3:].max()], 3)
    return sum(_count(problem, matrix, share, largest) for share in SHARES)


def _count(problem: Problem, matrix: FloatArray, share: float, largest: FloatArray) -> int:
    inputs = problem.inputs
    driven = replace(
        inputs,
        velocity=share * inputs.velocity,
        wrench=share**2 * inputs.wrench,
        channels=share * inputs.channels,
        propulsion=share * inputs.propulsion,
    )
    velocity, _ = kernels.replay(problem.columns.plant, matrix, driven, problem.segments)
    left = ~np.all(np.abs(velocity) <= largest, axis=1)
    return sum(bool(left[start:stop].any()) for start, stop in problem.segments.tolist())

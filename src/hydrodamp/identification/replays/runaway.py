"""Whether a model runs away a little beside the log it was fitted to."""

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
    """Count the replays that run away beside the log."""
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

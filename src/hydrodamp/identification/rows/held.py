"""What a differentiated velocity sees of inputs that are held between samples."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.problem import Problem

Slopes = Callable[[FloatArray, FloatArray], FloatArray]
"""From times (n,) and values (n, k) of one segment to slopes (n, k)."""


def by_segment(problem: Problem, values: FloatArray, slopes: Slopes) -> FloatArray:
    """Differentiate segment by segment, never across a join."""
    result = np.empty_like(values)
    for start, stop in problem.segments.tolist():
        result[start:stop] = slopes(problem.inputs.time[start:stop], values[start:stop])
    return result


def seen_through(problem: Problem, slopes: Slopes) -> Problem:
    """Return the problem with held inputs as a derivative of velocities sees them."""
    inputs = problem.inputs
    turning = problem.propulsion_known and problem.log.propulsion_ratio is None
    held = np.hstack([inputs.channels, inputs.propulsion[:, : int(turning)]])
    if not held.size:
        return problem
    seen = by_segment(problem, held, lambda time, rows: slopes(time, _integral(time, rows)))
    propulsion = inputs.propulsion.copy()
    propulsion[:, : int(turning)] = seen[:, inputs.n_channels :]
    channels = seen[:, : inputs.n_channels]
    return replace(problem, inputs=replace(inputs, channels=channels, propulsion=propulsion))


def _integral(time: FloatArray, held: FloatArray) -> FloatArray:
    steps = np.diff(time)[:, None]
    return np.vstack([np.zeros((1, held.shape[1])), np.cumsum(held[:-1] * steps, axis=0)])

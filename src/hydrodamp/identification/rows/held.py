"""What a differentiated velocity sees of inputs that are held between samples.

A command is held from sample to sample, so an acceleration taken from several
velocities belongs to several commands: the central difference at sample k spans
the command of k - 1 and that of k. Any derivative is a weighted mean of the
slopes of single steps, and over a step the slope answers to the command held
there; so the command it sees is the same weighted mean of commands, which is the
same derivative of the command's integral. To take the command of sample k alone
is to take it half a sample late, and that error goes into the coefficients.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.problem import Problem

Slopes = Callable[[FloatArray, FloatArray], FloatArray]
"""From times (n,) and values (n, k) of one segment to slopes (n, k)."""


def by_segment(problem: Problem, values: FloatArray, slopes: Slopes) -> FloatArray:
    """Differentiate segment by segment, never across a join.

    Parameters
    ----------
    problem : Problem
        Times and segments.
    values : ndarray, shape (n, k)
        What to differentiate.
    slopes : callable
        The derivative of one segment.

    Returns
    -------
    slopes : ndarray, shape (n, k)
        In the unit of the values per second.
    """
    result = np.empty_like(values)
    for start, stop in problem.segments.tolist():
        result[start:stop] = slopes(problem.inputs.time[start:stop], values[start:stop])
    return result


def seen_through(problem: Problem, slopes: Slopes) -> Problem:
    """Return the problem with held inputs as a derivative of velocities sees them.

    Parameters
    ----------
    problem : Problem
        Its channels, and the speed u_c of a propeller, are held between samples;
        a recorded wrench, attitude or propulsion ratio is not.
    slopes : callable
        The derivative of one segment.

    Returns
    -------
    problem : Problem
        The same but for those inputs; itself where nothing is held.
    """
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

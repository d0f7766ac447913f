"""Equation 3 from sample to sample: momentum gained against the mean of what acted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IndexArray
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True, eq=False)
class Steps:
    """Some steps of one segment, a row each."""

    design: FloatArray
    target: FloatArray


def steps_between(
    problem: Problem, start: int, stop: int, velocity: FloatArray | None = None
) -> Steps:
    """Return the steps between the samples of a stretch of one segment."""
    mass, part, n_known = problem.vehicle.mass_matrix, slice(start, stop), problem.columns.n_known
    inputs = problem.inputs.part(part, None if velocity is None else velocity[part])
    regressor = _mean_regressor(problem.columns.plant.factors, inputs)
    acting = kernels.coriolis(mass, inputs.velocity) + inputs.wrench
    step = np.diff(inputs.time)[:, None]
    gained = np.diff(problem.inputs.velocity[part], axis=0) / step @ mass
    known = _mean(acting) + regressor[:, :n_known] @ problem.columns.known
    return Steps(regressor[:, n_known:], (gained - known) * problem.vehicle.free)


def _mean_regressor(factors: IndexArray, inputs: Inputs) -> FloatArray:
    """Return the mean columns of each step: evaluated once a sample where nothing is held."""
    opening, closing = inputs.propulsion.T
    velocity, down, held = inputs.velocity, inputs.down, inputs.channels[:-1]
    if not inputs.n_channels and np.array_equal(opening, closing):
        return _mean(kernels.regressor(factors, velocity, down, inputs.channels, opening))
    ends = kernels.regressor(factors, velocity[:-1], down[:-1], held, opening[:-1])
    ends += kernels.regressor(factors, velocity[1:], down[1:], held, closing[1:])
    ends *= 0.5
    return ends


def _mean(values: FloatArray) -> FloatArray:
    return 0.5 * (values[:-1] + values[1:])

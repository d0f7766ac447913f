"""Equation 3 from sample to sample: momentum gained against the mean of what acted.

Over the step from sample k to k + 1, with ξ, H(Mν)ν and a recorded wrench taken as the
mean of both ends,

    M (ν_{k+1} − ν_k) / h  =  mean(H(Mν)ν + G + u)  +  K mean(ξ)

and held channels keep their value of sample k at both ends. The adaptive identifier and
the replay have the same rule, so that fit and replay agree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp import kernels
from hydrodamp.arrays import FloatArray, IndexArray
from hydrodamp.kernels.inputs import Inputs
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True, eq=False)
class Steps:
    """Some steps of one segment, a row each.

    Attributes
    ----------
    design : ndarray, shape (m, n_terms)
        Mean of the unknown columns at both ends.
    target : ndarray, shape (m, 6)
        The mean wrench left over when everything known is subtracted, X Y Z [N] and
        K M N [N m], body frame, on the right-hand side of equation 1: against the
        motion. Zero on locked axes.
    """

    design: FloatArray
    target: FloatArray


def steps_between(
    problem: Problem, start: int, stop: int, velocity: FloatArray | None = None
) -> Steps:
    """Return the steps between the samples of a stretch of one segment.

    Parameters
    ----------
    problem : Problem
        Samples and terms.
    start, stop : int
        First sample and one past the last, at least two samples.
    velocity : ndarray, shape (n, 6), optional
        Of all samples, to evaluate everything but the momentum gained at [m/s, rad/s]; as
        measured by default.

    Returns
    -------
    steps : Steps
        ``stop - start - 1`` of them.
    """
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

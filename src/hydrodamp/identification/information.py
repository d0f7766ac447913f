"""Fisher information of the windows of a log, with initial states eliminated.

With the Jacobians A of the residuals on the parameters and B on the initial state of window w, both
over the standard deviation of the residuals, and the prior covariance P of the initial state,

    I = Σ_w AᵀA − AᵀB (BᵀB + P⁻¹)⁻¹ BᵀA

bounds the covariance of unbiased estimates from below by I⁻¹ (Cramér-Rao). Windows, steps of the
integration and averages are those of output error.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, factorisation
from hydrodamp.identification.continuation import RELATIVE_LENGTHS, admissible_lengths
from hydrodamp.identification.gauss_newton import ShootingObjective
from hydrodamp.identification.multiple_shooting import Windows
from hydrodamp.simulation.problem import Problem

#: Weak prior of a coefficient over its scale.
PRIOR_FACTOR = 1e3


def window_lengths(problem: Problem, time_scale: float, interval: float = 0.0) -> list[float]:
    """Return the window lengths of output error [s], none below a sampling interval."""
    lengths = [max(each * time_scale, interval) for each in RELATIVE_LENGTHS]
    return admissible_lengths(problem, lengths)


def fisher_information(
    windows: Windows, theta: FloatArray, residual_std: FloatArray, block_of_window: IntArray
) -> FloatArray:
    """Return the information (n_blocks, q, q) in successive blocks of windows."""
    normals = windows.block_normal_matrices(theta, residual_std, block_of_window)
    return normals[:, :-1, :-1]


@factorisation("Fisher information of the sensors")
def fisher_standard_errors(
    objective: ShootingObjective, windows: Windows, theta: FloatArray, residuals: FloatArray
) -> FloatArray:
    """Return the bound (p,) with independent residuals of a standard deviation and a weak prior."""
    p = objective.n_coefficients
    one_block = np.zeros(len(windows.bounds), dtype=np.intp)
    (information,) = fisher_information(windows, theta, residuals, one_block)
    prior = np.full(len(theta), PRIOR_FACTOR**-2.0)
    prior[p:] = 1.0
    scaled = information * objective.scale[:, None] * objective.scale
    covariance = np.linalg.inv(scaled + np.diag(prior))
    return np.asarray(np.sqrt(np.diag(covariance))[:p] * objective.scale[:p])

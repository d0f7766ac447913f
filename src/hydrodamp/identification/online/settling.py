"""Whether an adaptive identifier has settled, or its coefficients are still on their way."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.online.adaptation import Adaptation
from hydrodamp.simulation.problem import Problem

#: Share of an axis's damping wrench that may still be missing.
SETTLED = 0.1

#: Samples of the log looked at; the shares are ratios of two means.
_LOOK = 4096


def missing_share(
    problem: Problem, bound: Adaptation, matrix: FloatArray, moved: FloatArray, duration: float
) -> FloatArray:
    """Estimate what share of the damping wrench the coefficients still lack."""
    rows, axes = bound.entries
    share = np.zeros(6)
    xi = looked_at(problem)
    for axis in np.unique(axes):
        own = rows[(axes == axis) & (bound.gamma[rows, axes] > 0.0)]
        correlation = -moved[own, axis] / (bound.gamma[own, axis] * duration)
        share[axis] = bound.a[axis] * _missing(xi[:, own], matrix[own, axis], correlation)
    return share


def looked_at(problem: Problem) -> FloatArray:
    """Return the terms at some thousand samples of a log."""
    return problem.regressor(step=max(problem.n_samples // _LOOK, 1))


def _missing(xi: FloatArray, coefficients: FloatArray, correlation: FloatArray) -> float:
    """Turn the mean of ``d ξᵀ`` into a velocity error, over the wrench of the terms."""
    root = np.sqrt(len(xi))
    size = np.linalg.norm(xi @ coefficients) / root
    _, singular, right = np.linalg.svd(xi / root, full_matrices=False)
    kept = singular > 1e-6 * singular.max(initial=0.0)
    missing = np.linalg.norm(right[kept] @ correlation / singular[kept])
    return float(missing / size if size > 0.0 else missing > 0.0)

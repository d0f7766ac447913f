"""Whether an adaptive identifier has settled, or its coefficients are still on their way.

A coefficient moves as long as the velocity error correlates with its term
(equation 16). Where the error follows slowly, feedback ``a d`` balances the
wrench that wrong coefficients leave over, ``a d ≈ ΔK ξ``. So the movement of
the last stretch, divided by its gain and duration, gives the mean of ``d ξᵀ``
and from it the wrench that is still missing: a measure that slow gains cannot
flatter. Noise and a wrong model average out of the correlation.
"""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.adaptation import Adaptation
from hydrodamp.simulation.problem import Problem

SETTLED = 0.1
"""Share of an axis's damping wrench that may still be missing."""

_LOOK = 4096
"""Samples of the log looked at; the shares are ratios of two means."""


def missing_share(
    problem: Problem, bound: Adaptation, matrix: FloatArray, moved: FloatArray, duration: float
) -> FloatArray:
    """Estimate what share of the damping wrench the coefficients still lack.

    Parameters
    ----------
    problem : Problem
        Samples the wrench is evaluated at.
    bound : Adaptation
        Gains and entries.
    matrix : ndarray, shape (n_columns, 6)
        The last estimate.
    moved : ndarray, shape (n_columns, 6)
        Its change over the last stretch.
    duration : float
        How long that stretch was [s].

    Returns
    -------
    share : ndarray, shape (6,)
        Root mean square of the missing over that of the estimated wrench, an
        axis; zero where the model has no term.
    """
    every = max(problem.n_samples // _LOOK, 1)
    xi = problem.regressor(step=every)
    rows, axes = bound.entries
    share = np.zeros(6)
    for axis in np.unique(axes):
        own = rows[(axes == axis) & (bound.gamma[rows, axes] > 0.0)]
        size = np.linalg.norm(xi[:, own] @ matrix[own, axis]) / np.sqrt(len(xi))
        correlation = -moved[own, axis] / (bound.gamma[own, axis] * duration)
        _, singular, right = np.linalg.svd(xi[:, own] / np.sqrt(len(xi)), full_matrices=False)
        kept = singular > 1e-6 * singular.max(initial=0.0)
        missing = bound.a[axis] * np.linalg.norm(right[kept] @ correlation / singular[kept])
        share[axis] = missing / size if size > 0.0 else float(missing > 0.0)
    return share

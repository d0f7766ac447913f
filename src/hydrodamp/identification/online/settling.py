"""Whether an adaptive identifier has settled, or its coefficients are still on their way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.online.adaptation import Adaptation, RobustAdaptation
from hydrodamp.simulation.problem import Problem

SETTLED = 0.1
"""Share of an axis's damping wrench that may still be missing."""

_LOOK = 4096
"""Samples of the log looked at; the shares are ratios of two means."""


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


@dataclass(frozen=True)
class Stretch:
    """The last stretch of a run: the last pass, or the later half of a single one."""

    half: int
    duration: float

    @classmethod
    def of(cls, problem: Problem, passes: int) -> Stretch:
        """Return the last stretch of some passes over a log."""
        bounds = problem.segments
        steps = int((np.diff(bounds) - 1).sum())
        ends, starts = problem.inputs.time[bounds[:, 1] - 1], problem.inputs.time[bounds[:, 0]]
        duration = float((ends - starts).sum())
        return cls(steps // 2, duration / 2.0) if passes == 1 else cls(0, duration)


def share_missing(
    problem: Problem,
    adaptation: RobustAdaptation,
    coefficients: FloatArray,
    moved: FloatArray,
    duration: float,
) -> FloatArray:
    """Estimate what share of the damping wrench a robust identifier still lacks."""
    robustness = adaptation.robustness
    entries, xi, share = robustness.entries, looked_at(problem), np.zeros(6)
    returned = robustness.leakage * duration * (coefficients - robustness.led_to)
    driven = moved + returned
    for axis, gain in enumerate(entries.squares(robustness.gains)):
        part = entries.of(axis)
        live = np.diag(gain) > 0.0
        if not live.any():
            continue
        own = entries.rows[part][live]
        push = np.asarray(np.linalg.solve(gain[np.ix_(live, live)], driven[part][live]))
        lacking = _missing(xi[:, own], coefficients[part][live], -push / duration)
        share[axis] = robustness.a[axis] * lacking
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

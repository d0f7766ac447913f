"""Central differences for a batch of vehicles, and steady states by Gauss-Newton steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray

DIFFERENCE, FIRST_DIFFERENCE = 1e-5, 0.1
"""Steps of central differences over the scale of a variable, the second at the start of a trim."""

MAX_STEPS, TOLERANCE = 50, 1e-7
"""Gauss-Newton steps; last step and residual over their scales."""


def differences(
    function: Callable[[FloatArray], FloatArray],
    point: FloatArray,
    scale: FloatArray,
    columns: slice | list[int] = slice(None),
    share: float = DIFFERENCE,
) -> FloatArray:
    """Return central differences (n, m, k) of a function at points, by columns, times scales."""
    step = share * np.diag(scale)[columns, None, :]
    change = function(point + step) - function(point - step)
    return np.asarray(np.moveaxis(change / (2.0 * share), 0, 2))


def solve_steady_states(
    residual: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    scale: FloatArray,
    columns: list[int],
    first_share: float = DIFFERENCE,
) -> tuple[FloatArray, BoolArray]:
    """Return points (n, k) without residual, and which are; columns vary, by least steps."""
    point, change = start.copy(), np.empty(0)
    for number in range(MAX_STEPS):
        # secants first: a thrust of n|n| has no slope at rest
        share = max(first_share / 2.0**number, DIFFERENCE)
        slopes = differences(residual, point, scale, columns, share)
        inverse = np.linalg.pinv(np.nan_to_num(slopes, posinf=0.0, neginf=0.0), rcond=TOLERANCE)
        change = (inverse @ residual(point[None])[0][:, :, None])[:, :, 0]
        point[:, columns] -= change * scale[columns]
        if np.all((np.abs(change).max(axis=1) < TOLERANCE) | np.isnan(change[:, 0])):
            break
    errors = np.hstack([change, residual(point[None])[0]])
    return point, np.asarray(np.abs(errors).max(axis=1) < TOLERANCE)

"""What every method that solves a triangle turns down first."""

from __future__ import annotations

import numpy as np

from hydrodamp.identification.fit import Fit, empty_fit
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status


def refused(problem: Problem, model: DampingModel, key: str, triangle: Triangle) -> Fit | None:
    """Return the empty fit of a problem that cannot be solved, or None."""
    problem.columns.require(model)
    status = _status(model, triangle)
    return None if status is None else empty_fit(problem, model, key, status)


def _status(model: DampingModel, triangle: Triangle) -> Status | None:
    if not model.n_coefficients:
        return Status.EMPTY
    if not np.all(np.isfinite(triangle.r)):
        return Status.FAILED
    if triangle.n_samples < max(len(terms) for terms in model.terms):
        return Status.TOO_FEW_SAMPLES
    return None

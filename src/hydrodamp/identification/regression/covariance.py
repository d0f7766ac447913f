"""How far to trust the coefficients of a linear estimate on coloured, overlapping rows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.regression.attenuation import NOISY_TERMS, attenuation
from hydrodamp.identification.regression.influence import (
    Influence,
    directions,
    least_squares_influence,
)
from hydrodamp.identification.rows.equations import Equations, Rows
from hydrodamp.identification.rows.reference import with_reference
from hydrodamp.identification.uncertainty.intervals import Uncertainty
from hydrodamp.identification.uncertainty.long_run import block_length
from hydrodamp.identification.uncertainty.tapered_blocks import Blocks, blocks_of
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

_OUTSIDE = 1e-6
"""A direction that lies outside others by less than this share is within them."""


def rows_covariance(
    rows: Rows,
    influence: Influence,
    model: DampingModel,
    reference: DampingModel | None = None,
    block: float | None = None,
) -> Uncertainty:
    """Return the covariance of a linear estimate, all axes together."""
    if not influence.axes:
        return Uncertainty(np.zeros((0, 0)), np.inf, "no coefficients")
    own = _on_reference(rows, influence, model)
    errors = _left_over(rows, own)
    length = block or block_length(own.scores(errors), rows.segment, rows.time)
    blocks = blocks_of(rows.segment, rows.time, length)
    covariance = _restored(own, errors, blocks)
    if reference is not None:
        wide = _on_reference(rows, influence, reference)
    return Uncertainty(
        covariance=covariance,
        noise=None if reference is None else _restored(wide, _left_over(rows, wide), blocks),
        degrees_of_freedom=blocks.degrees_of_freedom,
        method="the scores of the model's residuals",
        block=blocks.length,
        n_blocks=blocks.n,
    )


def reference_rows(
    problem: Problem, equations: Equations, model: DampingModel
) -> tuple[Rows, DampingModel]:
    """Return rows with the columns of a model and of its reference."""
    wide = with_reference(problem, model)
    return equations.rows(wide), wide.models[1]


def least_squares_uncertainty(
    problem: Problem, equations: Equations, model: DampingModel, block: float | None = None
) -> Uncertainty:
    """Return how far to trust ordinary least squares on some rows."""
    free = model.restricted_to(problem.vehicle.axes)
    rows, reference = reference_rows(problem, equations, free)
    return rows_covariance(rows, least_squares_influence(rows, free), free, reference, block)


def linear_uncertainty(
    problem: Problem,
    equations: Equations,
    model: DampingModel,
    influence: Callable[[Rows, DampingModel], Influence],
) -> Uncertainty | None:
    """Return how far to trust any linear estimate, or None where its rows cannot tell."""
    rows, reference = reference_rows(problem, equations, model)
    return _unless_too_few(rows, influence(rows, model), model, reference)


def noise_uncertainty(
    problem: Problem, equations: Equations, model: DampingModel
) -> Uncertainty | None:
    """Return how far to trust least squares on noisy velocities."""
    free = model.restricted_to(problem.vehicle.axes)
    rows, reference = reference_rows(problem, equations, free)
    found = _unless_too_few(rows, least_squares_influence(rows, free), free, reference)
    return None if found is None else found.widened(attenuation(rows, free), NOISY_TERMS)


def _unless_too_few(
    rows: Rows, influence: Influence, model: DampingModel, reference: DampingModel
) -> Uncertainty | None:
    try:
        return rows_covariance(rows, influence, model, reference)
    except MethodError:
        return None


def _on_reference(rows: Rows, influence: Influence, reference: DampingModel) -> Influence:
    """Return the influence on all directions of the reference, and on its own where it has more."""
    pairs = zip(directions(rows, reference, influence.axes), influence.directions, strict=True)
    return influence.on([_joined(wide, own) for wide, own in pairs])


def _joined(wide: FloatArray, own: FloatArray) -> FloatArray:
    """Return orthonormal directions of both; the first where it holds the second."""
    rest = own - wide @ (wide.T @ own)
    left, singular, _ = np.linalg.svd(rest, full_matrices=False)
    return np.hstack([wide, left[:, singular > _OUTSIDE]])


def _left_over(rows: Rows, influence: Influence) -> FloatArray:
    errors = rows.target.copy()
    for axis, unit in zip(influence.axes, influence.directions, strict=True):
        if rows.n <= unit.shape[1]:
            raise MethodError(
                f"{rows.n} rows are too few for a reference regression of {unit.shape[1]} terms, "
                "so there is no noise to measure: give a longer log"
            )
        errors[:, axis] -= unit @ (unit.T @ errors[:, axis])
    return errors


def _restored(influence: Influence, errors: FloatArray, blocks: Blocks) -> FloatArray:
    return blocks.covariance(influence.scores(errors, blocks))

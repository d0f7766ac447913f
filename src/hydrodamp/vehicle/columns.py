"""Everything known of a vehicle as columns of one regressor."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.vehicle.actuation import Column
from hydrodamp.vehicle.mass import cross_matrix

DOWN = ("down_x", "down_y", "down_z")
"""The terms of restoring: R^T e3, the downward unit vector seen in the body frame."""


@dataclass(frozen=True, eq=False)
class KnownColumns:
    """The known wrench as a matrix times terms."""

    terms: tuple[Term, ...]
    matrix: FloatArray


def gather(columns: Iterable[Column]) -> KnownColumns:
    """Sum columns of the same term and axis into one matrix."""
    sums: dict[Term, FloatArray] = {}
    for axis, term, value in columns:
        sums.setdefault(term, np.zeros(6))[AXES.index(axis)] += value
    kept = {term: column for term, column in sums.items() if column.any()}
    matrix = np.column_stack([*kept.values()]) if kept else np.zeros((6, 0))
    return KnownColumns(tuple(kept), frozen(matrix))


def restoring_matrix(
    weight: float,
    buoyancy: float,
    center_of_gravity: npt.ArrayLike,
    center_of_buoyancy: npt.ArrayLike,
) -> FloatArray:
    """Return the matrix that turns the downward unit vector into the restoring wrench."""
    lever = weight * np.asarray(center_of_gravity, dtype=np.float64)
    lever = lever - buoyancy * np.asarray(center_of_buoyancy, dtype=np.float64)
    return np.vstack([(weight - buoyancy) * np.eye(3), cross_matrix(lever)]) + 0.0


def restoring_columns(matrix: npt.ArrayLike) -> tuple[Column, ...]:
    """Return a restoring matrix as columns on ``down_x``, ``down_y``, ``down_z``."""
    return tuple(
        Column(axis, Term.parse(name), float(value))
        for name, column in zip(DOWN, np.asarray(matrix).T, strict=True)
        for axis, value in zip(AXES, column, strict=True)
    )

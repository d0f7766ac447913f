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
    """The known wrench as a matrix times terms.

    Attributes
    ----------
    terms : tuple of Term
        Each once; those that add nothing are left out.
    matrix : ndarray, shape (6, len(terms))
        N and N m per unit of the term, rows X Y Z K M N, body frame; on the
        right-hand side of equation 1.
    """

    terms: tuple[Term, ...]
    matrix: FloatArray


def gather(columns: Iterable[Column]) -> KnownColumns:
    """Sum columns of the same term and axis into one matrix.

    Parameters
    ----------
    columns : iterable of Column
        In the order wanted; a term stays where it comes first.

    Returns
    -------
    known : KnownColumns
        Without columns of zeros.

    Examples
    --------
    >>> rudder = Term.parse("rudder")
    >>> gather([Column("Y", rudder, 1.0), Column("Y", rudder, 2.0)]).matrix[1].tolist()
    [3.0]
    """
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
    """Return the matrix that turns the downward unit vector into the restoring wrench.

    The force is (W - B) d and the moment (W r_G - B r_B) x d with d = R^T e3:
    the term G(R) of equation 1, whose b is the negative of ``buoyancy``.

    Parameters
    ----------
    weight, buoyancy : float
        Both positive [N].
    center_of_gravity, center_of_buoyancy : array_like, shape (3,)
        r_G and r_B, body frame (z down) [m].

    Returns
    -------
    matrix : ndarray, shape (6, 3)
        Rows X Y Z [N] and K M N [N m].

    Examples
    --------
    >>> restoring_matrix(100.0, 90.0, (0, 0, 0.02), (0, 0, 0))[:, 2].tolist()
    [0.0, 0.0, 10.0, 0.0, 0.0, 0.0]
    """
    lever = weight * np.asarray(center_of_gravity, dtype=np.float64)
    lever = lever - buoyancy * np.asarray(center_of_buoyancy, dtype=np.float64)
    return np.vstack([(weight - buoyancy) * np.eye(3), cross_matrix(lever)]) + 0.0


def restoring_columns(matrix: npt.ArrayLike) -> tuple[Column, ...]:
    """Return a restoring matrix as columns on ``down_x``, ``down_y``, ``down_z``.

    Parameters
    ----------
    matrix : array_like, shape (6, 3)
        As :func:`restoring_matrix` gives it.

    Returns
    -------
    columns : tuple of Column
        Eighteen, zeros included.

    Examples
    --------
    >>> len(restoring_columns(restoring_matrix(1, 1, (0, 0, 0), (0, 0, 0))))
    18
    """
    return tuple(
        Column(axis, Term.parse(name), float(value))
        for name, column in zip(DOWN, np.asarray(matrix).T, strict=True)
        for axis, value in zip(AXES, column, strict=True)
    )

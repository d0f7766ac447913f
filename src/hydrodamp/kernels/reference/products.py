"""Terms as products of atoms: the regressor of eq. 4 in blocks that stay in cache."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray, IndexArray
from hydrodamp.kernels.arguments import destination, floats, rows_of
from hydrodamp.kernels.plant import checked_factors
from hydrodamp.kernels.reference.atoms import atoms

BLOCK = 2048
"""Samples filled at a time."""


def regressor(
    factors: IndexArray,
    velocity: FloatArray,
    down: FloatArray,
    channels: FloatArray,
    propulsion_speed: FloatArray,
    out: FloatArray | None = None,
) -> FloatArray:
    """Return the value of every term at every sample.

    Parameters
    ----------
    factors : ndarray of int32, shape (n_terms, 4)
        The atoms of every term; see :class:`hydrodamp.kernels.plant.Plant`.
    velocity : ndarray, shape (n, 6)
        u v w [m/s], p q r [rad/s], body frame.
    down : ndarray, shape (n, 3)
        The world's down direction in the body frame.
    channels : ndarray, shape (n, m)
        Command channels.
    propulsion_speed : ndarray, shape (n,)
        Surge speed u_c [m/s].
    out : ndarray, shape (n, n_terms), optional
        Float64 array of any strides to fill; by default a new one whose
        columns are contiguous.

    Returns
    -------
    xi : ndarray, shape (n, n_terms)
        One column a term. In the paper this is xi, transposed.

    Raises
    ------
    ProblemError
        If a shape does not agree or a factor does not exist.

    Examples
    --------
    >>> surge = np.array([[-2.0, 0, 0, 0, 0, 0]])
    >>> down = np.array([[0.0, 0.0, 1.0]])
    >>> table = np.array([[1, 7, 0, 0]], dtype=np.int32)
    >>> regressor(table, surge, down, np.zeros((1, 0)), np.zeros(1))
    array([[-4.]])
    """
    n = len(velocity)
    velocity, down = floats(velocity, (n, 6), "velocity"), floats(down, (n, 3), "down")
    channels = rows_of(channels, n, "channels")
    propulsion_speed = floats(propulsion_speed, (n,), "propulsion_speed")
    table = checked_factors(factors, channels.shape[1])
    out = destination(out, n, len(table))
    plan = [[int(atom) for atom in row if atom] for row in table]
    for start in range(0, n, BLOCK):
        rows = slice(start, start + BLOCK)
        values = atoms(velocity[rows], down[rows], channels[rows], propulsion_speed[rows])
        for column, factors_of_term in enumerate(plan):
            _fill(out[rows, column], values, factors_of_term)
    return out


def products(factors: IndexArray, values: FloatArray) -> FloatArray:
    """Return the value of every term from the atoms of one sample.

    Parameters
    ----------
    factors : ndarray of int32, shape (n_terms, 4)
        The atoms of every term.
    values : ndarray, shape (21 + 2 m,)
        Every atom.

    Returns
    -------
    xi : ndarray, shape (n_terms,)
        In the paper this is xi.
    """
    chosen = values[factors.T]
    xi: FloatArray = chosen[0] * chosen[1] * chosen[2] * chosen[3]
    return xi


def _fill(column: FloatArray, values: FloatArray, term: list[int]) -> None:
    if len(term) < 2:
        column[:] = values[term[0]] if term else 1.0
        return
    np.multiply(values[term[0]], values[term[1]], out=column)
    for atom in term[2:]:
        column *= values[atom]

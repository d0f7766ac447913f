"""Gains of the adaptive identifier, term by term and axis by axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IndexArray
from hydrodamp.errors import MethodError
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.problem import Problem

_BLOCK = 4096


@dataclass(frozen=True)
class ByInertia:
    """Error gains ``a_i = bandwidth · M_ii``: the same bandwidth on every axis.

    A low bandwidth pays on noisy velocities: their noise stands in the error and
    in the terms alike, and the bias that this correlation leaves in the
    coefficients grows with ``a``.

    Parameters
    ----------
    bandwidth : float
        How fast the velocity error is pulled in [1/s].

    Raises
    ------
    MethodError
        If it is not positive.
    """

    bandwidth: float = 0.2

    def __post_init__(self) -> None:
        """Refuse what the proof does not cover."""
        per_axis(self.bandwidth, "bandwidth")


@dataclass(frozen=True)
class ByTerm:
    """Adaptation gains ``γ_ij = rate · M_ii / (n_i mean ξ_j²)``, n_i terms on axis i.

    Every coefficient moves at a like pace, whatever its unit, and every model,
    whatever its size. The proof of the paper holds for any positive diagonal
    gains.

    Parameters
    ----------
    rate : float
        How fast coefficients move [1/s^2].

    Raises
    ------
    MethodError
        If it is not positive.
    """

    rate: float = 0.003

    def __post_init__(self) -> None:
        """Refuse what the proof does not cover."""
        per_axis(self.rate, "rate")


Numbers = float | tuple[float, ...]
"""One gain for all axes, or six in the order X Y Z K M N."""


def per_axis(gain: Numbers, name: str) -> FloatArray:
    """Return six positive gains from one or six.

    Parameters
    ----------
    gain : float or tuple of 6 floats
        One for all axes, or one an axis in the order X Y Z K M N.
    name : str
        How the message calls it.

    Returns
    -------
    gains : ndarray, shape (6,)
        All positive.

    Raises
    ------
    MethodError
        If there are neither one nor six, or one is not positive.

    Examples
    --------
    >>> per_axis(20.0, "a")
    array([20., 20., 20., 20., 20., 20.])
    """
    gains = np.asarray(gain, dtype=np.float64)
    if gains.shape not in ((), (6,)) or not np.all(np.isfinite(gains)) or np.any(gains <= 0.0):
        raise MethodError(
            f"`{name}` must be one positive number or six, one an axis X Y Z K M N; got {gain!r}"
        )
    return np.broadcast_to(gains, (6,)).copy()


def error_gains(a: Numbers | ByInertia, columns: Columns) -> FloatArray:
    """Return the error gain of each axis.

    Parameters
    ----------
    a : float, tuple of 6 floats or ByInertia
        What was asked for.
    columns : Columns
        Names the vehicle.

    Returns
    -------
    gains : ndarray, shape (6,)
        [kg/s] on X Y Z, [kg m^2/s] on K M N.
    """
    if isinstance(a, ByInertia):
        return a.bandwidth * np.diag(columns.vehicle.mass_matrix)
    return per_axis(a, "a")


def adaptation_gains(
    gamma: Numbers | ByTerm,
    source: Problem | Columns,
    entries: tuple[IndexArray, IndexArray],
) -> FloatArray:
    """Return the adaptation gain of each coefficient.

    Parameters
    ----------
    gamma : float, tuple of 6 floats or ByTerm
        What was asked for.
    source : Problem or Columns
        A problem where gains by term need the size of each term.
    entries : tuple of ndarray
        Rows and axes of the table where the coefficients stand.

    Returns
    -------
    gains : ndarray, shape (n_coefficients,)
        Zero for a term that is zero throughout.

    Raises
    ------
    MethodError
        If gains by term are asked for without a log to take the sizes from.
    """
    rows, axes = entries
    if not isinstance(gamma, ByTerm):
        return per_axis(gamma, "gamma")[axes]
    if not isinstance(source, Problem):
        raise MethodError(
            "gains by term take the size of each term from a log: bind the identifier to a "
            "problem prepared from one, such as last week's dive."
        )
    inertia = np.diag(source.vehicle.mass_matrix)[axes]
    size = mean_square(source)[rows - source.columns.n_known]
    terms = np.bincount(axes, minlength=6)[axes]
    seen = size > 0.0
    return np.where(seen, gamma.rate * inertia / (terms * np.where(seen, size, 1.0)), 0.0)


def mean_square(problem: Problem) -> FloatArray:
    """Return the mean square of every unknown column over a log.

    Parameters
    ----------
    problem : Problem
        Samples and terms.

    Returns
    -------
    mean_square : ndarray, shape (n_terms,)
        In the squared unit of each term.
    """
    total = np.zeros(len(problem.columns.basis))
    for start in range(0, problem.n_samples, _BLOCK):
        stop = min(start + _BLOCK, problem.n_samples)
        xi = problem.regressor(start, stop)[:, problem.columns.n_known :]
        total += np.einsum("nj,nj->j", xi, xi)
    return total / problem.n_samples

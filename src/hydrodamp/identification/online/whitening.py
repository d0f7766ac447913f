"""Gain matrices that make all directions of the coefficients settle alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.online.gains import (
    ByTerm,
    Numbers,
    adaptation_gains,
    per_axis,
    with_log,
)
from hydrodamp.kernels.entries import Entries
from hydrodamp.simulation.columns import Columns
from hydrodamp.simulation.problem import Problem

_BLOCK = 4096


@dataclass(frozen=True)
class ByExcitation:
    """Gain matrices ``Γ_i = a_i / settling · (C_i + ridge diag C_i)⁻¹``, C_i = mean ξ ξᵀ.

    With one gain a coefficient, terms that rise and fall together settle at once in
    their sum and hardly ever in their difference. This matrix whitens them: each
    direction that the log excites settles in some ``settling`` seconds. The proof of
    the paper holds for any symmetric positive-definite gain.

    Parameters
    ----------
    settling : float
        How long a direction takes [s].
    ridge : float
        Share of the terms' own mean square below which a direction counts as barely
        excited and settles more slowly: there noise would lead it.

    Raises
    ------
    MethodError
        If either is not positive.
    """

    settling: float = 100.0
    ridge: float = 0.01

    def __post_init__(self) -> None:
        """Refuse what the proof does not cover."""
        per_axis(self.settling, "settling")
        per_axis(self.ridge, "ridge")


Gains = Numbers | ByTerm | ByExcitation
"""One number, six, or by what the log has."""


def gain_matrices(
    gains: Gains, source: Problem | Columns, entries: Entries, a: FloatArray
) -> FloatArray:
    """Return the gain matrices that were asked for."""
    if not isinstance(gains, ByExcitation):
        each = adaptation_gains(gains, source, (entries.rows, entries.axes), a)
        return entries.packed(np.diag(each[entries.of(axis)]) for axis in range(6))
    moments = second_moments(with_log(source, "size and correlation of the terms"))
    matrices = []
    for axis in range(6):
        rows = entries.rows[entries.of(axis)]
        whitened = _whitened(moments[np.ix_(rows, rows)], gains.ridge)
        matrices.append(a[axis] / gains.settling * whitened)
    return entries.packed(matrices)


def second_moments(problem: Problem) -> FloatArray:
    """Return the mean of ``ξ ξᵀ`` over a log, known columns included."""
    size = problem.columns.plant.n_terms
    total = np.zeros((size, size))
    for start in range(0, problem.n_samples, _BLOCK):
        xi = problem.regressor(start, min(start + _BLOCK, problem.n_samples))
        total += xi.T @ xi
    return total / problem.n_samples


def _whitened(moments: FloatArray, ridge: float) -> FloatArray:
    """Invert, in units of each term's root mean square; zero where a term is zero."""
    size = np.sqrt(np.diag(moments))
    if not np.all(np.isfinite(size)):
        raise MethodError("a term's mean square is not finite: look for absurd numbers in the log.")
    live = size > 0.0
    unit = np.where(live, size, 1.0)
    inverse = np.linalg.inv(moments / np.outer(unit, unit) + ridge * np.eye(len(unit)))
    inverse = 0.5 * (inverse + inverse.T)
    return np.asarray(np.where(np.outer(live, live), inverse / np.outer(unit, unit), 0.0))

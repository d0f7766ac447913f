"""Gains of the adaptive identifier, term by term and axis by axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, IndexArray, IntArray
from hydrodamp.errors import MethodError
from hydrodamp.identification.noise import mean_square, signal_to_noise
from hydrodamp.identification.online import with_log
from hydrodamp.simulation.problem import Columns, Problem


@dataclass(frozen=True)
class ByNoise:
    """Error gains ``a_i = share · SNR_i · M_ii``, SNR_i of the velocity on axis i.

    Noise of a measured velocity stands in the error and in the terms alike, and
    the bias that this correlation leaves in the coefficients is some ``a_i``
    over SNR_i. A clean velocity is therefore followed fast, a noisy one slowly:
    ``share`` bounds the bias, as a share of ``M_ii`` per second.

    Parameters
    ----------
    share : float
        Bandwidth over signal-to-noise ratio (of powers) [1/s].

    Raises
    ------
    MethodError
        If it is not positive.
    """

    share: float = 0.02

    def __post_init__(self) -> None:
        """Refuse what the proof does not cover."""
        per_axis(self.share, "share")


@dataclass(frozen=True)
class ByTerm:
    """Adaptation gains ``γ_ij = a_i / (settling · n_i mean ξ_j²)``, n_i terms on axis i.

    Every coefficient moves at a like pace, whatever its unit, the inertia of its
    axis and the size of the model: a well excited one settles in some
    ``settling`` seconds. The proof of the paper holds for any positive diagonal
    gains.

    Parameters
    ----------
    settling : float
        How long a coefficient takes [s].

    Raises
    ------
    MethodError
        If it is not positive.
    """

    settling: float = 100.0

    def __post_init__(self) -> None:
        """Refuse what the proof does not cover."""
        per_axis(self.settling, "settling")


#: One gain for all axes, or six in the order X Y Z K M N.
Numbers = float | tuple[float, ...]


def per_axis(gain: Numbers, name: str) -> FloatArray:
    """Return six positive gains from one or six."""
    gains = np.asarray(gain, dtype=np.float64)
    if gains.shape not in ((), (6,)) or not np.all(np.isfinite(gains)) or np.any(gains <= 0.0):
        raise MethodError(
            f"`{name}` must be one positive number or six, one an axis X Y Z K M N; got {gain!r}"
        )
    return np.broadcast_to(gains, (6,)).copy()


def error_gains(a: Numbers | ByNoise, source: Problem | Columns) -> FloatArray:
    """Return the error gain of each axis."""
    if not isinstance(a, ByNoise):
        return per_axis(a, "a")
    problem = with_log(source, "noise of each velocity")
    return a.share * signal_to_noise(problem) * np.diag(problem.vehicle.mass_matrix)


def adaptation_gains(
    gamma: Numbers | ByTerm,
    source: Problem | Columns,
    entries: tuple[IndexArray | IntArray, IndexArray | IntArray],
    a: FloatArray,
) -> FloatArray:
    """Return the adaptation gain of each coefficient."""
    rows, axes = entries
    if not isinstance(gamma, ByTerm):
        return per_axis(gamma, "gamma")[axes]
    problem = with_log(source, "size of each term")
    size = mean_square(problem)[rows - problem.columns.n_known]
    terms = np.bincount(axes, minlength=6)[axes]
    seen = size > 0.0
    return np.where(seen, a[axes] / (gamma.settling * terms * np.where(seen, size, 1.0)), 0.0)

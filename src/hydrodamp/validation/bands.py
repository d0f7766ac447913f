"""Prediction bands of a replay by linear propagation of the coefficient covariance, ``J C Jᵀ``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, factorisation, freeze
from hydrodamp.data.log import Log
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import critical_value
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.replay import DIVERGENCE_LIMIT

#: Numbers of the sensitivities in memory at a time: 64 MB.
_CHUNK_SIZE = 8_000_000


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """A replay and its prediction band.

    Attributes
    ----------
    log : Log
        The log that was replayed.
    velocity, lower, upper : ndarray, shape (n, 6)
        The replay and the bounds of its band, linear [m/s] and angular [rad/s], body frame;
        NaN after divergence.
    level : float
        Confidence level of the band.
    """

    log: Log
    velocity: FloatArray
    lower: FloatArray
    upper: FloatArray
    level: float

    def __post_init__(self) -> None:
        """Copy and freeze the arrays."""
        shape = (self.log.n, 6)
        freeze(self, velocity=shape, lower=shape, upper=shape)


def prediction_band(
    problem: Problem, damping: Damping, level: float = 0.95, *, degrees_of_freedom: float = np.inf
) -> PredictionBand:
    """Return the prediction band of a replay, to first order in the coefficients.

    The covariance C of the coefficients gives ``J C Jᵀ`` with the sensitivities J of
    every sample. Gravity and buoyancy act along the measured attitude.

    Parameters
    ----------
    problem : Problem
        Prepared for (at least) the terms of the damping.
    damping : Damping
        With covariance.
    level : float
        Confidence level at each sample separately.
    degrees_of_freedom : float
        Of the covariance.

    Returns
    -------
    band : PredictionBand
        Sensitivities are propagated chunk by chunk, so memory does not grow with the log.

    Raises
    ------
    MethodError
        If the damping has no covariance, or a setting is out of range.
    """
    half = critical_value(level, degrees_of_freedom)
    if damping.covariance is None:
        raise MethodError(
            f"the coefficients of '{damping.model.key}' have no covariance, hence no band: "
            "use a method that estimates one"
        )
    free = damping.model.restricted_to(problem.vehicle.axes)
    indices = [damping.model.index(label) for label in free.labels]
    root = _root(damping.covariance[np.ix_(indices, indices)])
    entries, n = problem.equations.entries(free), free.n_coefficients
    matrix, length = problem.matrix(damping), max(_CHUNK_SIZE // (6 * (n + 6)), 2)
    velocity = np.full((problem.n_samples, 6), np.nan)
    width = velocity.copy()
    for start, stop in problem.segments.tolist():
        initial, deviation = problem.inputs.velocity[start], np.zeros((6, root.shape[1]))
        for first in range(start, stop - 1, length - 1):
            chunk = slice(first, min(first + length, stop))
            measured = problem.inputs.velocity[chunk].copy()
            measured[0] = initial
            inputs, span = problem.inputs.select(chunk, measured), np.array([[0, len(measured)]])
            arguments = problem.equations.plant, matrix, inputs, span, entries
            velocity[chunk], _, jacobian = core.replay(*arguments, limit=DIVERGENCE_LIMIT)
            on_coefficients, on_initial = np.split(jacobian, [n], axis=2)
            total = on_initial @ deviation + on_coefficients @ root
            width[chunk] = half * np.sqrt((total**2).sum(axis=2))
            initial, deviation = velocity[chunk][-1], total[-1]
            if not np.isfinite(initial).all():
                break
    return PredictionBand(problem.log, velocity, velocity - width, velocity + width, level)


@factorisation("covariance")
def _root(covariance: FloatArray) -> FloatArray:
    """Return R with ``R Rᵀ`` the covariance, by an eigendecomposition of the correlation."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(unit, unit))
    return np.asarray(unit[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))

"""Recursive least squares with directional forgetting in information form, without wind-up.

A row y = κ·φ, a momentum balance over two blocks of time, removes the share r of the information S
along φ and adds its own, S ← S − r Sφφᵀ S / (φᵀSφ) + φφᵀ, κ ← κ + (I + S)⁻¹ φ (y − κ·φ)
(decomposition of the information matrix of Cao and Schwartz, Automatica 36, 2000; r is bounded by
the information that the row adds, ``kernels/csrc/recursive.c``). Standard errors follow the
autocorrelation of the innovations and include a bias allowance from instrumental variables.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import BoolArray, FloatArray, factorisation
from hydrodamp.errors import demand
from hydrodamp.identification.fit import Fit, Uncertainty, empty_fit, make_fit
from hydrodamp.identification.online import (
    TYPICAL_TIME,
    Adaptation,
    Entries,
    OnlineIdentifier,
    OnlineState,
    check_typical_velocity,
    find_scales,
)
from hydrodamp.identification.regression import column_span
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Estimate, Recursion
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import EquationTable, Problem
from hydrodamp.status import Status

#: Length of a block over the correlation time of the velocities.
RELATIVE_BLOCK = 0.25

#: Default time constant of forgetting [blocks].
MEMORY_BLOCKS = 600.0


@dataclass(eq=False)
class RecursiveState(OnlineState[Recursion]):
    """State of recursive least squares.

    Attributes
    ----------
    adaptation : Adaptation
        Plant, model and settings.
    last : Sample
        The last sample.
    estimate : Estimate
        Coefficients, information and noise; it changes when a block is complete.
    block : ndarray
        The current block of time.
    """

    estimate: Estimate
    block: FloatArray

    @property
    def coefficients(self) -> FloatArray:
        """The present estimate, in the order of the model's labels."""
        return self.estimate.coefficients

    def advance(self, sample: Sample) -> RecursiveState:
        """Return the state one sample later."""
        recursion, estimate = self.adaptation.settings, self.estimate
        block, row = core.block_step(recursion, self.block, self.last, sample)
        if row is not None:
            estimate = core.absorb(recursion, estimate, row)
        return RecursiveState(self.adaptation, sample, estimate, block)

    def restart(self, sample: Sample) -> RecursiveState:
        """Return the state at the first sample after a gap: a new block, the same estimate."""
        recursion = self.adaptation.settings
        estimate = core.begin_segment(recursion, self.estimate)
        return RecursiveState(self.adaptation, sample, estimate, core.new_block(recursion.plant))


@dataclass(frozen=True)
class RecursiveLeastSquares(OnlineIdentifier[Recursion, RecursiveState]):
    """Recursive least squares with directional forgetting.

    The ``rank`` of a fit counts the directions in which the information of the data exceeds the
    prior's. Its status is ``BY_PRIOR`` where these are not all, ``TOO_FEW_SAMPLES`` where no
    segment has two blocks.

    Parameters
    ----------
    block : float, optional
        Length of a block of time [s]; a row spans two. Longer blocks average more noise,
        shorter ones resolve faster motions. By default 0.25 times the correlation time of the
        velocities of the log, and 1 s with a ``typical_velocity``.
    memory : float, optional
        Time constant of forgetting along a continuously excited direction [s]; infinite for a
        vehicle that does not change. By default 600 blocks.
    prior : float
        Weight of the prior, in rows of typical size.
    start : Damping, optional
        Initial coefficients, such as a published set; those of the paper by default.
    typical_velocity : tuple of 6 floats, optional
        Typical u v w [m/s] p q r [rad/s] that scale the terms, with channels of 1, where there is
        no log to take the scales from.

    Raises
    ------
    MethodError
        If a setting is out of range.

    Examples
    --------
    >>> RecursiveLeastSquares().key
    'rls'
    """

    block: float | None = None
    memory: float | None = None
    prior: float = 1.0
    start: Damping | None = None
    typical_velocity: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the settings."""
        check_typical_velocity(self.typical_velocity)
        for name in ("block", "prior"):
            value = getattr(self, name)
            demand(value is None or 0.0 < value < np.inf, name, "positive and finite", value)
        block = RELATIVE_BLOCK * TYPICAL_TIME if self.block is None else self.block
        valid = self.memory is None or self.memory >= block
        demand(valid, "memory", f"at least one block of {block} s", self.memory)

    key = "rls"

    def _settings(
        self, source: Problem | EquationTable, equations: EquationTable, entries: Entries
    ) -> Recursion:
        """Return the settings with scales from the log or the typical velocity."""
        rows, axes = entries
        time, square = find_scales(source, equations, self.typical_velocity)
        block = self.block or RELATIVE_BLOCK * time
        size = block * np.sqrt(self.prior * square[rows - equations.n_known])
        known = equations.with_unknown(entries, np.zeros(len(rows)))
        unit = np.divide(1.0, size, out=np.zeros(len(size)), where=size > 0.0)
        forgetting = -float(np.expm1(-block / (self.memory or MEMORY_BLOCKS * block)))
        return Recursion(equations.plant, rows, axes, known, unit, block, forgetting)

    def _initial_state(self, bound: Adaptation[Recursion], sample: Sample) -> RecursiveState:
        recursion = bound.settings
        estimate = recursion.initial_estimate(bound.start)
        return RecursiveState(bound, sample, estimate, core.new_block(recursion.plant))

    def _estimate(self, problem: Problem, bound: Adaptation[Recursion]) -> Fit:
        recursion, start = bound.settings, bound.settings.initial_estimate(bound.start)
        estimate = core.recur(recursion, start, problem.inputs, problem.segments)
        if not estimate.rows.any():
            return empty_fit(problem, bound.model, self.key, Status.TOO_FEW_SAMPLES)
        axes = _estimate_axes(bound, estimate)
        exceeds_prior = axes.values >= 1.0  # along these eigenvectors, the data do
        aliased: list[tuple[str, ...]] = []
        for axis, first in enumerate(recursion.starts[:-1].tolist()):
            labels = bound.model.labels[first : recursion.starts[axis + 1]]
            directions = axes.vectors[axis][: len(labels), exceeds_prior[axis]].T
            design = directions if len(directions) else np.zeros((1, len(labels)))
            aliased += column_span(design, labels, np.ones(len(labels))).aliased
        sizes = np.diff(recursion.starts).tolist()
        covariance = block_diag(*[c[:n, :n] for c, n in zip(axes.covariance, sizes, strict=True)])
        rank = int(exceeds_prior.sum())
        return make_fit(
            problem,
            bound.model,
            self,
            estimate.coefficients,
            uncertainty=Uncertainty(covariance, np.inf, _METHOD, bias_allowance=_ALLOWANCE),
            rank=rank,
            aliased=tuple(aliased),
            status=Status.OK if rank == bound.model.n_coefficients else Status.BY_PRIOR,
        )


class EstimateUncertainty(NamedTuple):
    """Standard errors and excitation of an estimate of recursive least squares."""

    standard_errors: FloatArray  # by coefficient, as all but the last
    is_estimated: BoolArray  # the data halve the variance of the prior at least
    persistent_leverage_share: FloatArray  # from regressors correlated over three rows
    excitation: FloatArray  # by axis: least eigenvalue of the information over that of the prior


def estimate_uncertainty(state: RecursiveState) -> EstimateUncertainty:
    """Return standard errors and excitation of the estimate of a state.

    Noise is uncorrelated over three rows, so leverage that does not persist may be noise.
    """
    (mask, _), axes = (
        _masks(state.adaptation.settings),
        _estimate_axes(state.adaptation, state.estimate),
    )
    inverse, moments = axes.inverse, axes.iv_moments
    symmetric = 0.25 * (moments + moments.swapaxes(1, 2))
    prior_share = _diagonals(inverse)
    persistent = np.sum(inverse @ symmetric * inverse, axis=2) / prior_share
    n = mask.sum(axis=1)
    smallest = axes.values[range(6), mask.shape[1] - np.maximum(n, 1)]  # zeros of padding first
    return EstimateUncertainty(
        np.sqrt(_diagonals(axes.covariance)[mask]),
        prior_share[mask] <= _MAX_PRIOR_SHARE,
        persistent[mask],
        np.where(n > 0, np.maximum(0.0, smallest), np.inf),
    )


def relative_wrench_difference(state: RecursiveState, coefficients: FloatArray) -> FloatArray:
    """Return the share of each axis's damping wrench by which other coefficients differ."""
    recursion, estimate = state.adaptation.settings, state.estimate
    mask, block_mask = _masks(recursion)
    information, unit = _pad(estimate.information, block_mask), recursion.unit
    scale = np.divide(1.0, unit, out=np.zeros(len(unit)), where=unit > 0.0)
    pair = [scale * (estimate.coefficients - coefficients), scale * coefficients]
    missing, size = (
        np.einsum("ai,aij,aj->a", x, information, x) for x in (_pad(x, mask) for x in pair)
    )
    share = np.divide(missing, size, out=np.full(6, np.inf), where=size > 0.0)
    return np.asarray(np.sqrt(share))


_METHOD = "residuals with correlation over four blocks of time"
_ALLOWANCE = (
    "the difference from an instrumental-variable estimate with instruments three blocks away, "
    "its standard error, and the bias towards the initial coefficients"
)

# Weights of products at lags of one row and more: W. Newey and K. West, Econometrica 55 (1987) 703.
_TAPER = 1.0 - np.arange(1, 5) / 5.0

# Largest share of the prior variance that remains of a coefficient estimated from data.
_MAX_PRIOR_SHARE = 0.5


class _AxisEstimates(NamedTuple):
    """Eigenvalues of the information S of each axis, (I + S)⁻¹, and the covariance.

    Vectors and matrices of an axis are padded with zeros to the largest number of terms.
    """

    values: FloatArray
    vectors: FloatArray
    inverse: FloatArray
    covariance: FloatArray
    iv_moments: FloatArray


def _masks(recursion: Recursion) -> tuple[BoolArray, BoolArray]:
    """Return which elements of padded vectors and matrices belong to coefficients."""
    sizes = np.diff(recursion.starts)
    mask = np.arange(sizes.max(initial=1)) < sizes[:, None]
    return mask, mask[:, :, None] & mask[:, None]


def _pad(packed: FloatArray, mask: BoolArray) -> FloatArray:
    padded = np.zeros(mask.shape)
    padded[mask] = packed
    return padded


def _diagonals(matrices: FloatArray) -> FloatArray:
    return np.diagonal(matrices, axis1=1, axis2=2)


@factorisation("information matrix")
def _estimate_axes(bound: Adaptation[Recursion], estimate: Estimate) -> _AxisEstimates:
    """Return information and covariance of all axes, including bias terms."""
    recursion = bound.settings
    mask, block_mask = _masks(recursion)
    information, unit = _pad(estimate.information, block_mask), _pad(recursion.unit, mask)
    values, vectors = np.linalg.eigh(information)
    inverse = (vectors / (1.0 + np.maximum(values, 0.0))[:, None]) @ vectors.swapaxes(1, 2)
    instruments = [recursion.iv_statistics(axis, estimate.iv_state) for axis in range(6)]
    iv_estimate = _pad(np.concatenate([each.estimate for each in instruments]), mask)
    iv_moments = _pad(np.concatenate([each.moments.ravel() for each in instruments]), block_mask)
    correlated = np.array([each.lag_products for each in instruments]) @ _TAPER
    noise = (estimate.noise + 2.0 * np.maximum(0.0, correlated))[:, None]
    coefficients = _pad(estimate.coefficients, mask)
    change = coefficients - _pad(bound.start, mask)
    change = np.divide(change, unit, out=np.zeros(unit.shape), where=unit > 0.0)
    iv_bias = coefficients - unit * iv_estimate
    prior_bias = unit * np.einsum("aij,aj->ai", inverse, change)
    covariance = (noise * unit)[:, :, None] * unit[:, None] * inverse
    # A bias estimate may be small by chance: all coefficients of an axis get at least the mean
    # ratio of squared bias to variance (R. Birge, Physical Review 40 (1932) 207).
    variance = _diagonals(covariance).copy()
    free = variance > 0.0
    ratio = np.divide(iv_bias**2, variance, out=np.zeros(unit.shape), where=free)
    birge = ratio.sum(axis=1, keepdims=True) / np.maximum(free.sum(axis=1, keepdims=True), 1)
    bias = np.maximum(0.0, birge * variance - iv_bias**2)
    # Variance of the difference of both estimates: agreement by chance proves nothing. The
    # correlation of a regressor over six blocks is taken as the square of that over three.
    moments = np.linalg.inv(np.eye(unit.shape[1]) + iv_moments)
    difference = 2.0 * np.sum(moments @ information * moments, 2) - 0.5 * _diagonals(inverse)
    diagonal = bias + noise * unit**2 * np.maximum(0.0, difference)
    covariance += iv_bias[:, :, None] * iv_bias[:, None]
    covariance += prior_bias[:, :, None] * prior_bias[:, None]
    covariance += diagonal[:, :, None] * np.eye(unit.shape[1])
    return _AxisEstimates(values, vectors, inverse, covariance, iv_moments)

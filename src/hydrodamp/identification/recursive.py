"""Recursive least squares with directional forgetting, without wind-up or bursting.

Each row y = κ·φ, a momentum balance over two blocks of time, updates the information S and κ;
the equations are in ``kernels/csrc/recursive.c``. Covariances include a bias term from
instrumental variables (``instrumental_variables.c``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import BoolArray, FloatArray, factorisation, frozen
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.adaptive import initial_coefficients, require_problem
from hydrodamp.identification.differentiation import regressor_mean_square
from hydrodamp.identification.fit import Fit, Uncertainty, empty_fit, make_fit
from hydrodamp.identification.regression import column_span
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Estimate, Recursion
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem, vehicle_stamp
from hydrodamp.simulation.status import Status

#: u v w [m/s] p q r [rad/s]; scales of the terms on board, where there is no log.
TYPICAL_VELOCITY = (1.0, 0.1, 0.1, 0.1, 0.1, 0.1)


class RecursiveAdaptation(NamedTuple):
    """Recursive least squares bound to a plant and a model."""

    equations: EquationTable
    model: DampingModel
    recursion: Recursion
    start: Estimate


class RecursiveState(NamedTuple):
    """State of recursive least squares.

    Attributes
    ----------
    adaptation : RecursiveAdaptation
        Plant, model and settings.
    estimate : Estimate
        Coefficients, information and noise.
    block : ndarray
        The current block of time.
    last : Sample
        The last sample.
    """

    adaptation: RecursiveAdaptation
    estimate: Estimate
    block: FloatArray
    last: Sample

    @property
    def damping(self) -> Damping:
        """The present estimate, with the vehicle stamp."""
        bound = self.adaptation
        vehicle = vehicle_stamp(bound.equations.vehicle)
        return Damping(bound.model, self.estimate.coefficients, vehicle=vehicle)

    def restart(self, sample: Sample) -> RecursiveState:
        """Return the state at the first sample after a gap: a new block, the same estimate.

        Parameters
        ----------
        sample : Sample
            The first sample after the gap.

        Returns
        -------
        state : RecursiveState
            The new state.
        """
        empty = frozen(np.zeros_like(self.block))
        estimate = core.begin_segment(self.adaptation.recursion, self.estimate)
        return RecursiveState(self.adaptation, estimate, empty, sample)


@dataclass(frozen=True)
class RecursiveLeastSquares:
    """Recursive least squares with directional forgetting.

    Parameters
    ----------
    block : float
        Length of a block of time [s]; a row spans two. Longer blocks average more noise,
        shorter ones resolve faster motions.
    memory : float
        Time constant of forgetting along a continuously excited direction [s]; infinite for a
        vehicle that does not change.
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

    block: float = 1.0
    memory: float = 600.0
    prior: float = 1.0
    start: Damping | None = None
    typical_velocity: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        """Check the settings."""
        typical = TYPICAL_VELOCITY if self.typical_velocity is None else self.typical_velocity
        valid = len(typical) == 6 and all(0.0 < value < np.inf for value in typical)
        demand(valid, "typical_velocity", "six positive numbers", self.typical_velocity)
        for name in ("block", "prior"):
            value = getattr(self, name)
            demand(0.0 < value < np.inf, name, "positive and finite", value)
        minimum = f"at least one block of {self.block} s"
        demand(self.memory >= self.block, "memory", minimum, self.memory)

    key = "rls"

    def bind(self, source: Problem | EquationTable, model: DampingModel) -> RecursiveAdaptation:
        """Bind the settings to a plant and a model; scales from the log or the typical velocity."""
        equations = source if isinstance(source, EquationTable) else source.equations
        free = model.restricted_to(equations.vehicle.axes)
        rows, axes = equations.entries(free)
        if self.typical_velocity is None:
            square = regressor_mean_square(require_problem(source, "size of each term"))
        else:
            square = _typical_square(equations, self.typical_velocity)
        size = self.block * np.sqrt(self.prior * square[rows - equations.n_known])
        if not np.all(np.isfinite(size)):
            raise MethodError(
                "the mean square of a term is not finite: check the log for outliers."
            )
        known = equations.with_unknown((rows, axes), np.zeros(len(rows)))
        unit = np.divide(1.0, size, out=np.zeros(len(size)), where=size > 0.0)
        forgetting = -float(np.expm1(-self.block / self.memory))
        recursion = Recursion(equations.plant, rows, axes, known, unit, self.block, forgetting)
        start = recursion.initial_estimate(initial_coefficients(free, self.start))
        return RecursiveAdaptation(equations, free, recursion, start)

    def init(
        self, source: Problem | EquationTable, model: DampingModel, sample: Sample
    ) -> RecursiveState:
        """Return the initial state at the first sample of a run.

        Parameters
        ----------
        source : Problem or EquationTable
            Equation 1; a problem from an earlier log where there is no ``typical_velocity``.
        model : DampingModel
            The terms.
        sample : Sample
            The first one; see :func:`hydrodamp.identification.adaptive.observe`.

        Returns
        -------
        state : RecursiveState
            The initial coefficients, without information.
        """
        bound = self.bind(source, model)
        block = core.new_block(bound.equations.plant)
        return RecursiveState(bound, bound.start, block, sample)

    def step(self, state: RecursiveState, sample: Sample) -> RecursiveState:
        """Return the state after one sample; the argument is not modified.

        Parameters
        ----------
        state : RecursiveState
            From :meth:`init`, an earlier step, or ``state.restart(sample)``
            after a gap.
        sample : Sample
            The next sample.

        Returns
        -------
        state : RecursiveState
            The new state; its estimate changes when a block is complete.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        bound, estimate, block, last = state
        block, row = core.block_step(bound.recursion, block, last, sample)
        if row is not None:
            estimate = core.absorb(bound.recursion, estimate, row)
        return RecursiveState(bound, estimate, block, sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Process the log once and return the final estimate.

        ``rank`` counts the directions in which the information of the data exceeds the prior's.
        The status is ``BY_PRIOR`` where these are not all, ``TOO_FEW_SAMPLES`` where no segment has
        two blocks.
        """
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        estimate = core.recur(bound.recursion, bound.start, problem.inputs, problem.segments)
        if not estimate.rows.any():
            return empty_fit(problem, bound.model, self.key, Status.TOO_FEW_SAMPLES)
        axes = [_axis_estimate(bound, estimate, axis) for axis in range(6)]
        rank = sum(int(axis.exceeds_prior.sum()) for axis in axes)
        covariance = block_diag(*(axis.covariance for axis in axes))
        return make_fit(
            problem,
            bound.model,
            self,
            estimate.coefficients,
            uncertainty=Uncertainty(covariance, np.inf, _METHOD, bias_allowance=_ALLOWANCE),
            rank=rank,
            aliased=tuple(group for axis in axes for group in axis.aliased),
            status=Status.OK if rank == bound.model.n_coefficients else Status.BY_PRIOR,
        )


class EstimateUncertainty(NamedTuple):
    """Covariance and excitation of an estimate of recursive least squares."""

    covariance: FloatArray  # of all coefficients
    is_estimated: BoolArray  # by coefficient: the data halve the variance of the prior at least
    excitation: FloatArray  # by axis: least eigenvalue of the information over that of the prior


def estimate_uncertainty(state: RecursiveState) -> EstimateUncertainty:
    """Return covariance and excitation of the estimate of a state."""
    axes = [_axis_estimate(state.adaptation, state.estimate, axis) for axis in range(6)]
    return EstimateUncertainty(
        block_diag(*(axis.covariance for axis in axes)),
        np.concatenate([axis.inverse.diagonal() for axis in axes]) <= _MAX_PRIOR_SHARE,
        np.array([max(0.0, axis.values.min(initial=np.inf)) for axis in axes]),
    )


def persistent_leverage_share(state: RecursiveState) -> FloatArray:
    """Return the share of each coefficient's leverage from regressors correlated over three rows.

    Noise is uncorrelated over three rows, so the remainder may be noise.
    """
    recursion, estimate, shares = state.adaptation.recursion, state.estimate, []
    for axis in range(6):
        _, information = recursion.axis_block(axis, estimate.information)
        moments = recursion.iv_statistics(axis, estimate.iv_state).moments
        inverse = np.linalg.inv(np.eye(len(information)) + information)
        persistent = inverse @ (0.25 * (moments + moments.T)) @ inverse
        shares.append(persistent.diagonal() / inverse.diagonal())
    return np.concatenate(shares)


def missing_wrench_share(state: RecursiveState, coefficients: FloatArray) -> FloatArray:
    """Return the share of each axis's damping wrench by which other coefficients differ."""
    recursion, estimate, share = state.adaptation.recursion, state.estimate, np.zeros(6)
    unit = recursion.unit
    scale = np.divide(1.0, unit, out=np.zeros(len(unit)), where=unit > 0.0)
    for axis in range(6):
        block, information = recursion.axis_block(axis, estimate.information)
        scaled = scale[block] * coefficients[block]
        difference = scale[block] * estimate.coefficients[block] - scaled
        missing, size = difference @ information @ difference, scaled @ information @ scaled
        share[axis] = np.sqrt(missing / size) if size > 0.0 else np.inf
    return share


_METHOD = "residuals with correlation over four blocks of time"
_ALLOWANCE = (
    "the difference from an instrumental-variable estimate with instruments three blocks away, "
    "its standard error, and the bias towards the initial coefficients"
)

# Weights of products at lags of one row and more: W. Newey and K. West, Econometrica 55 (1987) 703.
_TAPER = 1.0 - np.arange(1, 5) / 5.0

# Largest share of the prior variance that remains of a coefficient estimated from data.
_MAX_PRIOR_SHARE = 0.5

# Down vector and propulsion ratio that make no term zero.
_TYPICAL_DOWN, _TYPICAL_PROPULSION_RATIO = (0.3, 0.3, 0.9), 1.3


def _typical_square(equations: EquationTable, velocity: tuple[float, ...]) -> FloatArray:
    """Return the square of every unknown term at a typical velocity."""
    plant = equations.plant
    nu = np.array([velocity])
    propulsion = _TYPICAL_PROPULSION_RATIO * guarded_speed(nu)
    channels = np.ones((1, plant.n_channels))
    terms = core.regressor(plant.factors, nu, np.array([_TYPICAL_DOWN]), channels, propulsion)
    return np.asarray(terms[0, equations.n_known :] ** 2)


class _AxisEstimate(NamedTuple):
    """Eigenvalues of the information S of an axis, (I + S)⁻¹, and the covariance."""

    labels: tuple[str, ...]
    values: FloatArray
    vectors: FloatArray
    inverse: FloatArray
    covariance: FloatArray

    @property
    def exceeds_prior(self) -> BoolArray:
        """Eigenvectors along which the data have more information than the prior, which has 1."""
        return np.asarray(self.values >= 1.0)

    @property
    def aliased(self) -> tuple[tuple[str, ...], ...]:
        """Groups of labels that are aliased in these directions."""
        n, mask = len(self.labels), self.exceeds_prior
        directions = self.vectors[:, mask].T if mask.any() else np.zeros((1, n))
        return column_span(directions, self.labels, np.ones(n)).aliased


@factorisation("information matrix")
def _axis_estimate(bound: RecursiveAdaptation, estimate: Estimate, axis: int) -> _AxisEstimate:
    """Return information and covariance of one axis, including bias terms."""
    recursion = bound.recursion
    block, information = recursion.axis_block(axis, estimate.information)
    unit = recursion.unit[block]
    values, vectors = np.linalg.eigh(information)
    inverse = (vectors / (1.0 + np.maximum(values, 0.0))) @ vectors.T
    instruments = recursion.iv_statistics(axis, estimate.iv_state)
    noise = estimate.noise[axis] + 2.0 * max(0.0, float(_TAPER @ instruments.lag_products))
    coefficients = estimate.coefficients[block]
    change = coefficients - bound.start.coefficients[block]
    change = np.divide(change, unit, out=np.zeros(len(unit)), where=unit > 0.0)
    iv_bias = coefficients - unit * instruments.estimate
    prior_bias = unit * (inverse @ change)
    covariance = noise * np.outer(unit, unit) * inverse
    # A bias estimate may be small by chance: all coefficients of an axis get at least the mean
    # ratio of squared bias to variance (R. Birge, Physical Review 40 (1932) 207).
    variance = covariance.diagonal()
    free = variance > 0.0
    birge = np.mean(iv_bias[free] ** 2 / variance[free]) if free.any() else 0.0
    covariance += np.diag(np.maximum(0.0, birge * variance - iv_bias**2))
    covariance += np.outer(iv_bias, iv_bias) + np.outer(prior_bias, prior_bias)
    # Variance of the difference of both estimates: agreement by chance proves nothing. The
    # correlation of a regressor over six blocks is taken as the square of that over three.
    moments = np.linalg.inv(np.eye(len(unit)) + instruments.moments)
    difference = 2.0 * moments @ information @ moments.T - 0.5 * inverse
    covariance += np.diag(noise * unit**2 * np.maximum(0.0, difference.diagonal()))
    return _AxisEstimate(bound.model.labels[block], values, vectors, inverse, covariance)

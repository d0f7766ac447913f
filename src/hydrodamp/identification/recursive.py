"""Recursive least squares that neither winds up nor bursts when nothing is excited."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import BoolArray, FloatArray, factorisation, frozen
from hydrodamp.basis.basis import guarded_speed
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differentiation import regressor_mean_square
from hydrodamp.identification.fit import Fit, Uncertainty, empty_fit, make_fit
from hydrodamp.identification.online import initial_coefficients, require_problem
from hydrodamp.identification.qr_factor import column_span
from hydrodamp.kernels import core
from hydrodamp.kernels.core import Estimate, Recursion
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem, vehicle_stamp
from hydrodamp.simulation.status import Status

#: Velocities that terms are scaled by on board, where no log tells their sizes.
TYPICAL_VELOCITY = (1.0, 0.1, 0.1, 0.1, 0.1, 0.1)


class RecursiveAdaptation(NamedTuple):
    """Recursive least squares bound to a plant and a model: all that a step needs."""

    equations: EquationTable
    model: DampingModel
    recursion: Recursion
    start: Estimate


class RecursiveState(NamedTuple):
    """Where recursive least squares stands.

    Attributes
    ----------
    adaptation : RecursiveAdaptation
        Plant, model and settings.
    estimate : Estimate
        Coefficients, information and noise.
    block : ndarray
        The block of time under way.
    last : Sample
        The sample it was made with.
    """

    adaptation: RecursiveAdaptation
    estimate: Estimate
    block: FloatArray
    last: Sample

    @property
    def damping(self) -> Damping:
        """The present estimate, with the vehicle it belongs to."""
        bound = self.adaptation
        vehicle = vehicle_stamp(bound.equations.vehicle)
        return Damping(bound.model, self.estimate.coefficients, vehicle=vehicle)

    def restart(self, sample: Sample) -> RecursiveState:
        """Return the state at the first sample after a gap: a new block, all that was known.

        Parameters
        ----------
        sample : Sample
            The first one after the gap.

        Returns
        -------
        state : RecursiveState
            A new one.
        """
        empty = frozen(np.zeros_like(self.block))
        estimate = core.begin_segment(self.adaptation.recursion, self.estimate)
        return RecursiveState(self.adaptation, estimate, empty, sample)


@dataclass(frozen=True)
class RecursiveLeastSquares:
    """Least squares sample by sample, with directional forgetting.

    Parameters
    ----------
    block : float
        Length of a block of time [s]; a row spans two. Longer ones average more noise
        away, shorter ones keep quicker motions.
    memory : float
        Time after which most of what was known along a direction is replaced, if that
        is excited all the while [s]; infinite for a vehicle that does not change.
    prior : float
        How many rows of each term's usual size the start is worth.
    start : Damping, optional
        Coefficients to start from, such as a published set; the paper's start by
        default.
    usual : tuple of 6 floats, optional
        Velocities u v w [m/s] p q r [rad/s] that give each term its usual size, with channels of
        one, where there is no log to take it from.

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
        """Refuse settings that make no sense."""
        if self.typical_velocity is not None:
            demand(
                _is_usual(self.typical_velocity),
                "usual",
                "six positive numbers",
                self.typical_velocity,
            )
        for name in ("block", "prior"):
            given = getattr(self, name)
            demand(0.0 < given < np.inf, name, "positive and finite", given)
        least = f"at least one block of {self.block} s"
        demand(self.memory >= self.block, "memory", least, self.memory)

    key = "rls"

    def bind(self, source: Problem | EquationTable, model: DampingModel) -> RecursiveAdaptation:
        """Bind the settings to a plant and a model; sizes follow the log, or what is usual."""
        columns = source if isinstance(source, EquationTable) else source.equations
        free = model.restricted_to(columns.vehicle.axes)
        rows, axes = columns.entries(free)
        if self.typical_velocity is None:
            square = regressor_mean_square(require_problem(source, "size of each term"))
        else:
            square = _usual_square(columns, self.typical_velocity)
        size = self.block * np.sqrt(self.prior * square[rows - columns.n_known])
        if not np.all(np.isfinite(size)):
            raise MethodError(
                "a term's mean square is not finite: look for absurd numbers in the log."
            )
        current_estimate = columns.with_unknown((rows, axes), np.zeros(len(rows)))
        unit = np.divide(1.0, size, out=np.zeros(len(size)), where=size > 0.0)
        forgetting = -float(np.expm1(-self.block / self.memory))
        recursion = Recursion(
            columns.plant, rows, axes, current_estimate, unit, self.block, forgetting
        )
        start = recursion.initial_estimate(initial_coefficients(free, self.start))
        return RecursiveAdaptation(columns, free, recursion, start)

    def init(
        self, source: Problem | EquationTable, model: DampingModel, sample: Sample
    ) -> RecursiveState:
        """Start online at the first sample of a run.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; without ``usual`` a problem, such as one of last week's dive.
        model : DampingModel
            Which terms.
        sample : Sample
            The first one; see :func:`hydrodamp.identification.online.observe`.

        Returns
        -------
        state : RecursiveState
            At the start, nothing known.
        """
        bound = self.bind(source, model)
        block = core.new_block(bound.equations.plant)
        return RecursiveState(bound, bound.start, block, sample)

    def step(self, state: RecursiveState, sample: Sample) -> RecursiveState:
        """Return the state one sample later; the given one stays as it is.

        Parameters
        ----------
        state : RecursiveState
            From :meth:`init`, an earlier step, or ``state.restart(sample)``
            after a gap.
        sample : Sample
            The next one.

        Returns
        -------
        state : RecursiveState
            A new one; its estimate is the same until a block is full.

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
        """Go through the log once and return the last estimate.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            With covariance; its rank counts the directions the data tell more of than
            the prior. ``BY_PRIOR`` where that is not all of them, ``TOO_FEW_SAMPLES``
            where no segment has two blocks.
        """
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        estimate = core.recur(bound.recursion, bound.start, problem.inputs, problem.segments)
        if not estimate.rows.any():
            return empty_fit(problem, bound.model, self.key, Status.TOO_FEW_SAMPLES)
        axes = [_axis_knowledge(bound, estimate, axis) for axis in range(6)]
        rank = sum(int(one.is_told.sum()) for one in axes)
        return make_fit(
            problem,
            bound.model,
            self,
            estimate.coefficients,
            uncertainty=Uncertainty(
                block_diag(*(one.covariance for one in axes)),
                degrees_of_freedom=np.inf,
                method=_METHOD,
                bias_allowance=_ALLOWANCE,
            ),
            rank=rank,
            aliased=tuple(group for one in axes for group in one.aliased),
            status=Status.OK if rank == bound.model.n_coefficients else Status.BY_PRIOR,
        )


class EstimateUncertainty(NamedTuple):
    """How far an estimate can be trusted as it goes."""

    covariance: FloatArray  # of all coefficients
    is_estimated: BoolArray  # by coefficient: the data tell more of it than the prior
    excitation: FloatArray  # by axis: along the direction told least, data over prior


def estimate_uncertainty(state: RecursiveState) -> EstimateUncertainty:
    """Return what is known of each coefficient at a state."""
    axes = [_axis_knowledge(state.adaptation, state.estimate, axis) for axis in range(6)]
    return EstimateUncertainty(
        block_diag(*(one.covariance for one in axes)),
        np.concatenate([one.inverse.diagonal() for one in axes]) <= _TOLD,
        np.array([max(0.0, one.values.min(initial=np.inf)) for one in axes]),
    )


def persistent_leverage_share(state: RecursiveState) -> FloatArray:
    """Return the share of each coefficient's leverage that lasts: terms three rows apart.

    Noise does not last so long, so that what is left of the leverage may be noise.
    """
    recursion, estimate, shares = state.adaptation.recursion, state.estimate, []
    for axis in range(6):
        _, information = recursion.axis_block(axis, estimate.information)
        crossed = recursion.iv_statistics(axis, estimate.iv_state).moments
        inverse = np.linalg.inv(np.eye(len(information)) + information)
        lasting = inverse @ (0.25 * (crossed + crossed.T)) @ inverse
        shares.append(lasting.diagonal() / inverse.diagonal())
    return np.concatenate(shares)


def missing_wrench_share(state: RecursiveState, coefficients: FloatArray) -> FloatArray:
    """Return the share of each axis's damping wrench that the data miss in other coefficients."""
    recursion, estimate, share = state.adaptation.recursion, state.estimate, np.zeros(6)
    unit = recursion.unit
    scale = np.divide(1.0, unit, out=np.zeros(len(unit)), where=unit > 0.0)
    for axis in range(6):
        part, information = recursion.axis_block(axis, estimate.information)
        given, wanted = scale[part] * coefficients[part], scale[part] * estimate.coefficients[part]
        missing, size = ((one @ information @ one) for one in (wanted - given, given))
        share[axis] = np.sqrt(missing / size) if size > 0.0 else np.inf
    return share


_METHOD = "residuals correlated over four blocks of time"
_ALLOWANCE = (
    "how far an estimate by instruments three blocks away is off and may be by chance, and the "
    "start's pull"
)

# Weights of products at lags of one row and more: W. Newey and K. West, Econometrica 55 (1987) 703.
_TAPER = 1.0 - np.arange(1, 5) / 5.0

# Of the prior's variance, what may be left of a coefficient that the data tell.
_TOLD = 0.5

# A tilt and a propeller's pull that make no term zero.
_DOWN, _PULL = (0.3, 0.3, 0.9), 1.3


def _is_usual(velocity: tuple[float, ...]) -> bool:
    return len(velocity) == 6 and all(0.0 < one < np.inf for one in velocity)


def _usual_square(columns: EquationTable, velocity: tuple[float, ...]) -> FloatArray:
    """Return the square of every unknown term at usual velocities."""
    plant = columns.plant
    moving = np.array([velocity])
    pull = _PULL * guarded_speed(moving)
    channels = np.ones((1, plant.n_channels))
    terms = core.regressor(plant.factors, moving, np.array([_DOWN]), channels, pull)
    return np.asarray(terms[0, columns.n_known :] ** 2)


class _AxisKnowledge(NamedTuple):
    """Of an axis: its information by eigenvalues, its inverse with the prior's, covariance."""

    labels: tuple[str, ...]
    values: FloatArray
    vectors: FloatArray
    inverse: FloatArray
    covariance: FloatArray

    @property
    def is_told(self) -> BoolArray:
        """Of which directions the data tell more than the prior, whose information is one."""
        return np.asarray(self.values >= 1.0)

    @property
    def aliased(self) -> tuple[tuple[str, ...], ...]:
        """Labels that the directions of the data do not tell apart."""
        n, is_told = len(self.labels), self.is_told
        directions = self.vectors[:, is_told].T if is_told.any() else np.zeros((1, n))
        return column_span(directions, self.labels, np.ones(n)).aliased


@factorisation("information matrix")
def _axis_knowledge(bound: RecursiveAdaptation, estimate: Estimate, axis: int) -> _AxisKnowledge:
    """Return what is known of one axis."""
    recursion = bound.recursion
    part, information = recursion.axis_block(axis, estimate.information)
    unit = recursion.unit[part]
    values, vectors = np.linalg.eigh(information)
    inverse = (vectors / (1.0 + np.maximum(values, 0.0))) @ vectors.T
    instruments = recursion.iv_statistics(axis, estimate.iv_state)
    noise = estimate.noise[axis] + 2.0 * max(0.0, float(_TAPER @ instruments.lag_products))
    found = estimate.coefficients[part]
    moved = np.divide(
        found - bound.start.coefficients[part], unit, out=np.zeros(len(unit)), where=unit > 0.0
    )
    off, pulled = found - unit * instruments.estimate, unit * (inverse @ moved)
    covariance = noise * np.outer(unit, unit) * inverse
    # Bias that is small in one coefficient by chance is not small in it: all of an axis have at
    # least the same ratio of it to noise (R. Birge, Physical Review 40 (1932) 207).
    variance = covariance.diagonal()
    moves = variance > 0.0
    birge = np.mean(off[moves] ** 2 / variance[moves]) if moves.any() else 0.0
    covariance += np.diag(np.maximum(0.0, birge * variance - off**2))
    covariance += np.outer(off, off) + np.outer(pulled, pulled)
    # How far apart both estimates may be by chance: one that is near by chance proves nothing. The
    # correlation of a term over six blocks counts as the square of that over three.
    moments = np.linalg.inv(np.eye(len(unit)) + instruments.moments)
    spread = 2.0 * moments @ information @ moments.T - 0.5 * inverse
    covariance += np.diag(noise * unit**2 * np.maximum(0.0, spread.diagonal()))
    return _AxisKnowledge(bound.model.labels[part], values, vectors, inverse, covariance)

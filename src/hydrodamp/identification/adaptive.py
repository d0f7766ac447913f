"""Section IV: the adaptive identifier, which needs no acceleration, and its gains."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import demand
from hydrodamp.identification.differentiation import regressor_mean_square, signal_to_noise
from hydrodamp.identification.fit import Fit, empty_fit, make_fit
from hydrodamp.identification.online import initial_coefficients, require_problem
from hydrodamp.identification.qr_factor import BLOCK, Triangle
from hydrodamp.identification.weak_form import step_equations
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem, vehicle_stamp
from hydrodamp.simulation.status import Status


@dataclass(frozen=True)
class NoiseScaledGain:
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
        axis_gains(self.share, "share")


@dataclass(frozen=True)
class TermScaledGain:
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
        axis_gains(self.settling, "settling")


#: One gain for all axes, or six in the order X Y Z K M N.
AxisGains = float | tuple[float, ...]


def axis_gains(gain: AxisGains, name: str) -> FloatArray:
    """Return six positive gains from one or six."""
    gains = np.asarray(gain, dtype=np.float64)
    fits = gains.shape in ((), (6,)) and bool(np.all((gains > 0.0) & (gains < np.inf)))
    demand(fits, name, "one positive number or six, one an axis X Y Z K M N", gain)
    return np.broadcast_to(gains, (6,)).copy()


#: Share of an axis's damping wrench that may still be missing from settled coefficients.
SETTLED = 0.1


@dataclass(frozen=True)
class History:
    """How the estimate came about, at every ``every``-th step.

    Attributes
    ----------
    time : ndarray, shape (k,)
        Clock of the log [s].
    velocity_error : ndarray, shape (k, 6)
        Estimated minus measured velocity; in the paper Delta v.
    coefficients : ndarray, shape (k, n_coefficients)
        In the order of the model's labels.
    labels : tuple of str
        Those labels.
    """

    time: FloatArray
    velocity_error: FloatArray
    coefficients: FloatArray
    labels: tuple[str, ...]


class Adaptation(NamedTuple):
    """The identifier bound to a plant and a model: all that a step needs."""

    columns: EquationTable
    model: DampingModel
    entries: tuple[np.ndarray, np.ndarray]
    gains: core.Gains

    def start(self) -> FloatArray:
        """Return the table to start from."""
        return self.columns.with_unknown(self.entries, initial_coefficients(self.model))


class State(NamedTuple):
    """Where an adaptive identifier stands.

    Attributes
    ----------
    adaptation : Adaptation
        Plant, model and gains.
    table : ndarray, shape (n_columns + 1, 6)
        All coefficients of equation 1, in the paper K-hat, transposed; the last row is the
        velocity error.
    last : Sample
        The sample it was made with.
    """

    adaptation: Adaptation
    table: FloatArray
    last: Sample

    @property
    def matrix(self) -> FloatArray:
        """All coefficients of equation 1, shape (n_columns, 6)."""
        return self.table[:-1]

    @property
    def velocity_error(self) -> FloatArray:
        """Estimated minus measured velocity [m/s, rad/s]; in the paper Delta v."""
        error: FloatArray = self.table[-1]
        return error

    @property
    def damping(self) -> Damping:
        """The present estimate, with the vehicle it belongs to."""
        bound = self.adaptation
        return Damping(
            bound.model, self.matrix[bound.entries], vehicle=vehicle_stamp(bound.columns.vehicle)
        )

    def restart(self, sample: Sample) -> State:
        """Return the state at the first sample after a gap: no error, same coefficients.

        Parameters
        ----------
        sample : Sample
            The first one after the gap.

        Returns
        -------
        state : State
            A new one.
        """
        return State(self.adaptation, frozen(np.vstack([self.matrix, np.zeros(6)])), sample)


@dataclass(frozen=True)
class AdaptiveIdentifier:
    """The paper's adaptive identifier with gains ``a`` and ``gamma``.

    Parameters
    ----------
    a : float, tuple of 6 floats or NoiseScaledGain
        Error gain, one or one an axis X Y Z K M N; 20 in the paper, whose
        section V calls it alpha.
    gamma : float, tuple of 6 floats or TermScaledGain
        Adaptation gain, one, one an axis or by term; 20 in the paper.
    passes : int
        How often the log is gone through.

    Raises
    ------
    MethodError
        If a gain is not positive or there is no pass.

    Examples
    --------
    >>> AdaptiveIdentifier(a=20, gamma=20).key
    'ai'
    >>> AdaptiveIdentifier(a=NoiseScaledGain(), gamma=TermScaledGain(), passes=30).key
    'ai-scaled'
    """

    a: AxisGains | NoiseScaledGain = 20.0
    gamma: AxisGains | TermScaledGain = 20.0
    passes: int = 1

    def __post_init__(self) -> None:
        """Refuse gains the proof does not cover."""
        if not isinstance(self.a, NoiseScaledGain):
            axis_gains(self.a, "a")
        if not isinstance(self.gamma, TermScaledGain):
            axis_gains(self.gamma, "gamma")
        fits = isinstance(self.passes, int | np.integer) and self.passes >= 1
        demand(fits, "passes", "a whole number, at least 1", self.passes)

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ai-scaled" if isinstance(self.gamma, TermScaledGain) else "ai"

    def bind(self, source: Problem | EquationTable, model: DampingModel) -> Adaptation:
        """Bind the gains to a plant and a model."""
        columns = source if isinstance(source, EquationTable) else source.equations
        free = model.restricted_to(columns.vehicle.axes)
        rows, axes = entries = columns.entries(free)
        if isinstance(self.a, NoiseScaledGain):
            problem = require_problem(source, "noise of each velocity")
            a = self.a.share * signal_to_noise(problem) * np.diag(problem.vehicle.mass_matrix)
        else:
            a = axis_gains(self.a, "a")
        if isinstance(self.gamma, TermScaledGain):
            size = regressor_mean_square(require_problem(source, "size of each term"))[
                rows - columns.n_known
            ]
            time = self.gamma.settling * np.bincount(axes, minlength=6)[axes] * size
            gamma = np.divide(a[axes], time, out=np.zeros(len(rows)), where=size > 0.0)
        else:
            gamma = axis_gains(self.gamma, "gamma")[axes]
        gains = core.Gains(columns.plant, a, columns.scatter(entries, gamma))
        return Adaptation(columns, free, entries, gains)

    def init(self, source: Problem | EquationTable, model: DampingModel, sample: Sample) -> State:
        """Start online at the first sample of a run.

        Parameters
        ----------
        source : Problem or Columns
            Equation 1 as one table; gains by noise or term need a problem.
        model : DampingModel
            Which terms.
        sample : Sample
            The first one; see :func:`hydrodamp.identification.online.observe`.

        Returns
        -------
        state : State
            Diagonal linear coefficients at -1, the others at 0, no error.
        """
        bound = self.bind(source, model)
        return State(bound, frozen(np.vstack([bound.start(), np.zeros(6)])), sample)

    def step(self, state: State, sample: Sample) -> State:
        """Return the state one sample later; the given one stays as it is.

        Parameters
        ----------
        state : State
            From :meth:`init`, an earlier step, or ``state.restart(sample)``
            after a gap.
        sample : Sample
            The next one.

        Returns
        -------
        state : State
            Made in a few microseconds by the compiled core.

        Raises
        ------
        ProblemError
            If time does not advance.
        """
        bound, table, last = state
        return State(bound, core.adapt_step(bound.gains, table, last, sample), sample)

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Go through the log and return the last estimate.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            ``NOT_CONVERGED`` where the terms still find more than a tenth of the damping wrench
            of an axis in what the coefficients leave of the steps.
        """
        bound = self.bind(problem, model)
        if not bound.model.n_coefficients:
            return empty_fit(problem, bound.model, self.key, Status.EMPTY)
        matrix = self._run(problem, bound).matrix
        coefficients = matrix[bound.entries]
        if not np.all(np.isfinite(coefficients)):
            return empty_fit(problem, bound.model, self.key, Status.FAILED)
        settled = np.all(_missing_share(problem, bound, matrix) <= SETTLED)
        status = Status.CONVERGED if settled else Status.NOT_CONVERGED
        return make_fit(problem, bound.model, self, coefficients, status=status)

    def history(self, problem: Problem, model: DampingModel, every: int = 1) -> History:
        """Go through the log and return how the estimate came about.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.
        every : int
            Keep one step in this many.

        Returns
        -------
        history : History
            Velocity errors and coefficients over time.

        Raises
        ------
        MethodError
            If ``every`` is less than one.
        """
        demand(every >= 1, "every", "at least 1", every)
        bound = self.bind(problem, model)
        run = self._run(problem, bound, every)
        rows, axes = bound.entries
        return History(
            time=frozen(run.history_time),
            velocity_error=frozen(run.history_error),
            coefficients=frozen(run.history_matrix[:, rows, axes]),
            labels=bound.model.labels,
        )

    def _run(self, problem: Problem, bound: Adaptation, every: int = 0) -> core.AdaptationRun:
        inputs, segments, passes = problem.inputs, problem.segments, self.passes
        return core.adapt(bound.gains, bound.start(), inputs, segments, passes=passes, every=every)


def scaled_identifier() -> AdaptiveIdentifier:
    """Return the identifier with gains from the whole log and thirty passes."""
    return AdaptiveIdentifier(a=NoiseScaledGain(), gamma=TermScaledGain(), passes=30)


def _missing_share(problem: Problem, bound: Adaptation, matrix: FloatArray) -> FloatArray:
    """Return the share of each axis's damping wrench that the terms find in the step residuals."""
    unknown, share = matrix[problem.equations.n_known :], np.zeros(6)

    def left() -> Iterator[FloatArray]:
        for start, stop in problem.segments.tolist():
            for first in range(start, stop - 1, BLOCK):
                end = min(first + BLOCK, stop - 1) + 1
                design, target = step_equations(problem, first, end, problem.inputs.velocity)
                yield np.hstack([design, target - design @ unknown])

    triangle = Triangle.of(problem.equations.basis, left())
    for axis, terms in enumerate(bound.model.terms):
        missing = np.linalg.norm(triangle.span(terms).directions.T @ triangle.target(axis))
        size = np.linalg.norm(triangle.r[:, :-6] @ unknown[:, axis])
        share[axis] = missing / size if size > 0.0 else missing > 0.0
    return share

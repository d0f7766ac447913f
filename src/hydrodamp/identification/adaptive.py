"""Adaptive identifier (section IV of the paper): estimation without acceleration.

The error dynamics are ``M Δν̇ = −a Δν + (K̂ − K) ξ(ν)`` with the velocity error Δν = ν̂ − ν; the
coefficients follow the gradient law ``dK̂_ij/dt = −γ_i Δν_i ξ_j``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.errors import demand
from hydrodamp.identification.fit import Fit, empty_fit, make_fit
from hydrodamp.identification.online import (
    Adaptation,
    Entries,
    OnlineIdentifier,
    OnlineState,
)
from hydrodamp.identification.regression import BLOCK, Triangle
from hydrodamp.identification.weak_form import step_equations
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, Problem
from hydrodamp.status import Status

#: One gain for all axes, or six in the order X Y Z K M N.
AxisGains = float | tuple[float, ...]


def axis_gains(gain: AxisGains, name: str) -> FloatArray:
    """Return the positive gains of six axes from one gain or six."""
    gains = np.asarray(gain, dtype=np.float64)
    fits = gains.shape in ((), (6,)) and bool(np.all((gains > 0.0) & (gains < np.inf)))
    demand(fits, name, "one positive number or six, one an axis X Y Z K M N", gain)
    return np.broadcast_to(gains, (6,)).copy()


#: Share [1] of the damping wrench of an axis that the residuals of a converged estimate contain.
MAX_RESIDUAL_SHARE = 0.1


@dataclass(frozen=True)
class History:
    """Estimates over time, at every ``every``-th step.

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


@dataclass(eq=False)
class State(OnlineState[core.Gains]):
    """State of an adaptive identifier.

    Attributes
    ----------
    adaptation : Adaptation
        Plant, model and gains.
    last : Sample
        The sample of the last step.
    values : ndarray, shape (n_columns + 1, 6)
        All coefficients of equation 1, in the paper K-hat, transposed; the last row is the
        velocity error.
    """

    values: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """All coefficients of equation 1, shape (n_columns, 6)."""
        return self.values[:-1]

    @property
    def velocity_error(self) -> FloatArray:
        """Estimated minus measured velocity [m/s, rad/s]; in the paper Delta v."""
        return np.asarray(self.values[-1])

    @property
    def coefficients(self) -> FloatArray:
        """The present estimate, in the order of the model's labels."""
        return np.asarray(self.matrix[self.adaptation.entries])

    def advance(self, sample: Sample) -> State:
        """Return the state one sample later."""
        values = core.adapt_step(self.adaptation.settings, self.values, self.last, sample)
        return State(self.adaptation, sample, values)

    def restart(self, sample: Sample) -> State:
        """Return the state at the first sample after a gap: zero error, same coefficients."""
        return without_error(self.adaptation, sample, self.matrix)


def without_error(bound: Adaptation[core.Gains], sample: Sample, matrix: FloatArray) -> State:
    """Return the state at the first sample of a segment."""
    return State(bound, sample, frozen(np.vstack([matrix, np.zeros(6)])))


@dataclass(frozen=True)
class AdaptiveIdentifier(OnlineIdentifier[core.Gains, State]):
    """The paper's adaptive identifier with gains ``a`` and ``gamma``.

    The status of a fit is ``NOT_CONVERGED`` if the terms explain residuals of more than a tenth of
    the damping wrench of an axis.

    Parameters
    ----------
    a : float or tuple of 6 floats
        Error gain, common or one for each axis X Y Z K M N; 20 in the paper, whose
        section V calls it alpha.
    gamma : float or tuple of 6 floats
        Adaptation gain, common or one for each axis; 20 in the paper.
    passes : int
        Number of passes over the log.

    Raises
    ------
    MethodError
        If a gain is not positive or ``passes`` is less than one.

    Examples
    --------
    >>> AdaptiveIdentifier(a=20, gamma=20).key
    'ai'
    """

    a: AxisGains = 20.0
    gamma: AxisGains = 20.0
    passes: int = 1

    def __post_init__(self) -> None:
        """Check the gains."""
        axis_gains(self.a, "a")
        axis_gains(self.gamma, "gamma")
        fits = isinstance(self.passes, int | np.integer) and self.passes >= 1
        demand(fits, "passes", "a whole number, at least 1", self.passes)

    key = "ai"

    def _settings(
        self, source: Problem | EquationTable, equations: EquationTable, entries: Entries
    ) -> core.Gains:
        a, gamma = axis_gains(self.a, "a"), axis_gains(self.gamma, "gamma")[entries[1]]
        return core.Gains(equations.plant, a, equations.scatter(entries, gamma))

    def _initial_state(self, bound: Adaptation[core.Gains], sample: Sample) -> State:
        return without_error(bound, sample, bound.table)

    def _estimate(self, problem: Problem, bound: Adaptation[core.Gains]) -> Fit:
        matrix = self._run(problem, bound).matrix
        coefficients = matrix[bound.entries]
        if not np.all(np.isfinite(coefficients)):
            return empty_fit(problem, bound.model, self.key, Status.FAILED)
        converged = np.all(_residual_share(problem, bound.model, matrix) <= MAX_RESIDUAL_SHARE)
        status = Status.CONVERGED if converged else Status.NOT_CONVERGED
        return make_fit(problem, bound.model, self, coefficients, status=status)

    def history(self, problem: Problem, model: DampingModel, every: int = 1) -> History:
        """Process the log and return the estimates over time.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Damping model to identify.
        every : int
            Interval of the stored steps.

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
        arrays = run.history_time, run.history_error, run.history_matrix[:, rows, axes]
        time, error, coefficients = map(frozen, arrays)
        return History(time, error, coefficients, bound.model.labels)

    def _run(
        self, problem: Problem, bound: Adaptation[core.Gains], every: int = 0
    ) -> core.AdaptationRun:
        gains, inputs, segments = bound.settings, problem.inputs, problem.segments
        return core.adapt(gains, bound.table, inputs, segments, self.passes, every)


def _residual_share(problem: Problem, model: DampingModel, matrix: FloatArray) -> FloatArray:
    """Return the part of the residuals that the terms explain, over the damping wrench, by axis."""
    unknown, share = matrix[problem.equations.n_known :], np.zeros(6)

    def residual_rows() -> Iterator[FloatArray]:
        for start, stop in problem.segments.tolist():
            for first in range(start, stop - 1, BLOCK):
                end = min(first + BLOCK, stop - 1) + 1
                design, target = step_equations(problem, first, end, problem.inputs.velocity)
                yield np.hstack([design, target - design @ unknown])

    triangle = Triangle.of(problem.equations.basis, residual_rows())
    for axis, terms in enumerate(model.terms):
        explained = np.linalg.norm(triangle.span(terms).directions.T @ triangle.target(axis))
        size = np.linalg.norm(triangle.r[:, :-6] @ unknown[:, axis])
        share[axis] = explained / size if size > 0.0 else explained > 0.0
    return share

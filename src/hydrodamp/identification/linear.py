"""Linear estimators: rows made and folded once, every model solved from their triangle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.identification.covariance import BlockGrams, reference
from hydrodamp.identification.differences import Derivative, SavitzkyGolay
from hydrodamp.identification.fit import Fit, Method, empty_fit, fitted
from hydrodamp.identification.rows import Differenced, Equations, Rows, accumulate
from hydrodamp.identification.triangle import AxisSolution, Triangle, group_labels, solve_axis
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.status import Status

Solver = Callable[[DampingModel], Fit]

# Samples up to which `ls` keeps its rows for the covariance of coloured noise.
MOST_ROWS = 100_000


@dataclass(frozen=True, eq=False)
class Regression:
    """The triangle of a problem, and the rows it was made of where they were kept."""

    problem: Problem
    triangle: Triangle
    rows: Rows | None = None

    @classmethod
    def of(cls, problem: Problem, equations: Equations) -> Regression:
        """Make the rows, with columns for the reference of the noise, and fold them."""
        if isinstance(equations, Differenced) and problem.n_samples > MOST_ROWS:
            return cls(problem, accumulate(problem, equations.derivative))
        rows = equations.rows(problem.covering(reference(problem.vehicle.axes)))
        return cls(problem, rows.triangle(), rows)

    @cached_property
    def grams(self) -> BlockGrams | None:
        """What the rows tell of coloured noise."""
        return None if self.rows is None else BlockGrams.of(self.rows, self.triangle)

    def fit(
        self,
        method: Method,
        model: DampingModel,
        solved: Sequence[AxisSolution],
        remarks: tuple[str, ...] = (),
        *,
        noisy_terms: bool = False,
    ) -> Fit:
        """Put together the fit of six separately solved axes."""
        rows, rich = self.rows, reference(self.problem.vehicle.axes)
        uncertainty = None
        if self.grams is not None:
            uncertainty = self.grams.uncertainty(solved, rich, noisy_terms=noisy_terms)
        white = block_diag(*[one.covariance for one in solved])
        return fitted(
            self.problem,
            model,
            method,
            np.concatenate([one.coefficients for one in solved]),
            covariance=white * (1.0 if rows is None else rows.likeness),
            uncertainty=uncertainty,
            rank=sum(one.span.rank for one in solved),
            aliased=group_labels(enumerate(one.span.aliased for one in solved)),
            n_samples=self.triangle.n_samples if rows is None else rows.n_samples,
            remarks=(() if rows is None else rows.remarks) + remarks,
        )


class LinearEstimator(ABC):
    """What the linear estimators share."""

    equations: Equations

    @property
    @abstractmethod
    def key(self) -> str:
        """The key on the command line."""

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            With rank, aliased labels, and standard errors for coloured noise where the rows
            suffice for those; else residuals count as white. Remarks say what was chosen.
        """
        return self.identify_all(problem, (model,))[0]

    def identify_all(self, problem: Problem, models: Iterable[DampingModel]) -> tuple[Fit, ...]:
        """Identify several models from one triangle.

        Parameters
        ----------
        problem : Problem
            Prepared for the terms of all models.
        models : iterable of DampingModel
            Which terms.

        Returns
        -------
        fits : tuple of Fit
            In the order of the models.
        """
        regression = Regression.of(problem, self.equations)
        solver = self._solver(regression)
        return tuple(self._unless_refused(solver, regression, model) for model in models)

    def solve(self, triangle: Triangle, problem: Problem, model: DampingModel) -> Fit:
        """Solve one model from a triangle, without the data.

        Parameters
        ----------
        triangle : Triangle
            Of the problem, or merged from parts of it.
        problem : Problem
            Names the vehicle and the log.
        model : DampingModel
            Which terms; restricted to the vehicle's free axes.

        Returns
        -------
        fit : Fit
            As :meth:`identify`, with residuals taken as white.
        """
        regression = Regression(problem, triangle)
        return self._unless_refused(self._solver(regression), regression, model)

    def _unless_refused(self, solver: Solver, regression: Regression, model: DampingModel) -> Fit:
        problem, triangle = regression.problem, regression.triangle
        free = model.restricted_to(problem.vehicle.axes)
        status = refused(problem, free, triangle)
        if status is not None:
            return empty_fit(problem, free, self.key, status)
        return solver(free)

    def _solver(self, regression: Regression) -> Solver:
        """Return what solves a model that can be solved, restricted to the free axes."""

        def solve(model: DampingModel) -> Fit:
            rows = enumerate(model.terms)
            solved = [solve_axis(regression.triangle, terms, axis) for axis, terms in rows]
            return regression.fit(self, model, solved, noisy_terms=True)

        return solve


def refused(problem: Problem, model: DampingModel, triangle: Triangle) -> Status | None:
    """Return why a model cannot be solved from a triangle, or None."""
    problem.columns.require(model)
    if not model.n_coefficients:
        return Status.EMPTY
    if not np.all(np.isfinite(triangle.r)):
        return Status.FAILED
    if triangle.n_samples < max(len(terms) for terms in model.terms):
        return Status.TOO_FEW_SAMPLES
    return None


@dataclass(frozen=True)
class LeastSquares(LinearEstimator):
    """Ordinary least squares on equation 3, as in section III of the paper.

    The stack ``(I₆ ⊗ ξᵀ) M_mᵀ`` of equation 12 is block-diagonal, so it is six
    small problems, one an axis. Columns are scaled, the rank is revealed, the
    smallest-norm solution (of the scaled coefficients) is returned and what
    the data cannot distinguish is named.

    Parameters
    ----------
    derivative : Derivative, optional
        Where the acceleration comes from: the recorded one where the log has
        it, else finite differences as in the paper. ``SavitzkyGolay()`` is the
        better choice on noisy velocities; the key is then ``ls-smoothed``.

    Examples
    --------
    >>> LeastSquares().key
    'ls'
    """

    derivative: Derivative | None = None

    @property
    def equations(self) -> Differenced:  # type: ignore[override]
        """One row a sample."""
        return Differenced(self.derivative)

    @property
    def key(self) -> str:
        """The key on the command line, and beside the paper's column, of what is the paper's."""
        return "ls-smoothed" if isinstance(self.derivative, SavitzkyGolay) else "ls"


@dataclass(frozen=True)
class WeakForm(LinearEstimator):
    """Least squares on the weak form, axis by axis.

    Parameters
    ----------
    equations : WeakEquations
        Length and overlap of the test functions.

    Examples
    --------
    >>> WeakForm().key
    'weak'
    """

    equations: WeakEquations = field(default_factory=WeakEquations)

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "weak"

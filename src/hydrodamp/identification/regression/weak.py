"""Least squares on the weak form of equation 3, which needs no acceleration."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.refusal import refused
from hydrodamp.identification.regression.covariance import noise_uncertainty
from hydrodamp.identification.regression.least_squares import assembled
from hydrodamp.identification.rows.rank import AxisSolution, solve_axis
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.identification.rows.weak_equations import WeakEquations, WeakProblem
from hydrodamp.identification.rows.weak_functions import likeness
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem


@dataclass(frozen=True)
class WeakForm:
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
            With rank, aliased labels and standard errors for coloured noise; where the
            rows are too few for those, overlapping rows count by what they share. Remarks
            say which test functions were used.
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
        settled = self.equations.on(problem)
        triangle = settled.triangle()
        return tuple(self._solve(triangle, settled, model) for model in models)

    def _solve(self, triangle: Triangle, settled: WeakProblem, model: DampingModel) -> Fit:
        problem = settled.problem
        free = model.restricted_to(problem.vehicle.axes)
        refusal = refused(problem, free, self.key, triangle)
        if refusal is not None:
            return refusal
        solutions = [
            _counted(solve_axis(triangle, terms, axis), settled.overlap)
            for axis, terms in enumerate(free.terms)
        ]
        same = replace(self.equations, support=settled.support.length)
        return assembled(
            problem,
            free,
            self,
            solutions,
            settled.n_samples,
            settled.remarks,
            noise_uncertainty(problem, same, free),
        )


def _counted(solution: AxisSolution, overlap: int) -> AxisSolution:
    """Widen the covariance by the number of overlapping rows that count as one."""
    return replace(solution, covariance=likeness(overlap) * solution.covariance)

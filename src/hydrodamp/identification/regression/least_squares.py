"""Section III: least squares, axis by axis, through a mergeable triangle."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.identification.fit import Fit, Method, fitted, trusted
from hydrodamp.identification.refusal import refused
from hydrodamp.identification.regression.covariance import noise_uncertainty
from hydrodamp.identification.rows.derivative import Derivative
from hydrodamp.identification.rows.equations import Differenced
from hydrodamp.identification.rows.rank import AxisSolution, group_labels, solve_axis
from hydrodamp.identification.rows.triangle import Triangle, accumulate
from hydrodamp.identification.uncertainty.intervals import Uncertainty
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

MOST_ROWS = 100_000
"""Samples up to which rows are gone through again for the covariance of coloured noise."""


@dataclass(frozen=True)
class LeastSquares:
    """Ordinary least squares on equation 3, as in section III of the paper.

    The stack ``(I₆ ⊗ ξᵀ) M_mᵀ`` of equation 12 is block-diagonal, so it is six
    small problems, one an axis. Columns are scaled, the rank is revealed, the
    smallest-norm solution (of the scaled coefficients) is returned and what
    the data cannot tell apart is named.

    Parameters
    ----------
    derivative : Derivative, optional
        Where the acceleration comes from: the recorded one where the log has
        it, else finite differences as in the paper. ``SavitzkyGolay()`` is the
        better choice on noisy velocities.

    Examples
    --------
    >>> LeastSquares().key
    'ls'
    """

    derivative: Derivative | None = None

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ls"

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
            With rank and aliased labels. Its covariance allows for coloured noise up to
            ``MOST_ROWS`` samples; beyond, and from :meth:`solve`, residuals count as white.
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
        triangle = accumulate(problem, self.derivative)
        fits = tuple(self.solve(triangle, problem, model) for model in models)
        if problem.n_samples > MOST_ROWS:
            return fits
        equations = Differenced(self.derivative)
        return tuple(
            trusted(fit, noise_uncertainty(problem, equations, fit.model))
            if fit.status.usable
            else fit
            for fit in fits
        )

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
            As :meth:`identify`.
        """
        free = model.restricted_to(problem.vehicle.axes)
        refusal = refused(problem, free, self.key, triangle)
        if refusal is not None:
            return refusal
        solutions = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(free.terms)]
        return assembled(problem, free, self, solutions, triangle.n_samples)


def assembled(
    problem: Problem,
    model: DampingModel,
    method: Method,
    solutions: list[AxisSolution],
    n_samples: int,
    remarks: tuple[str, ...] = (),
    uncertainty: Uncertainty | None = None,
) -> Fit:
    """Put together the fit of six separately solved axes."""
    return fitted(
        problem,
        model,
        method,
        np.concatenate([solution.coefficients for solution in solutions]),
        covariance=block_diag(*[solution.covariance for solution in solutions]),
        uncertainty=uncertainty,
        rank=sum(solution.rank for solution in solutions),
        aliased=group_labels(enumerate(solution.aliased for solution in solutions)),
        n_samples=n_samples,
        remarks=remarks,
    )

"""Section III: least squares, axis by axis, through a mergeable triangle."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.identification.derivative import Derivative, SavitzkyGolay
from hydrodamp.identification.fit import Fit, empty_fit, provenance
from hydrodamp.identification.rank import AxisSolution, solve_axis
from hydrodamp.identification.triangle import Triangle, accumulate
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.stamp import stamp
from hydrodamp.simulation.status import Status


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
    >>> LeastSquares().key, LeastSquares(SavitzkyGolay()).key
    ('ls', 'ls-sg')
    """

    derivative: Derivative | None = None

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ls-sg" if isinstance(self.derivative, SavitzkyGolay) else "ls"

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
            With rank, aliased labels and the covariance of white residuals.
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
        return tuple(self.solve(triangle, problem, model) for model in models)

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
        problem.columns.require(free)
        if not free.n_coefficients:
            return empty_fit(problem, free, self.key, Status.EMPTY)
        if triangle.n_samples < max(len(terms) for terms in free.terms):
            return empty_fit(problem, free, self.key, Status.TOO_FEW_SAMPLES)
        if not np.all(np.isfinite(triangle.r)):
            return empty_fit(problem, free, self.key, Status.FAILED)
        solutions = [solve_axis(triangle, terms, axis) for axis, terms in enumerate(free.terms)]
        return _assembled(problem, free, self, solutions, triangle.n_samples)


def _assembled(
    problem: Problem,
    model: DampingModel,
    method: LeastSquares,
    solutions: list[AxisSolution],
    n_samples: int,
) -> Fit:
    aliased = tuple(
        tuple(f"{AXES[axis]}_{term}" for term in group)
        for axis, solution in enumerate(solutions)
        for group in solution.aliased
    )
    damping = Damping(
        model,
        np.concatenate([solution.coefficients for solution in solutions]),
        covariance=_block_diagonal([solution.covariance for solution in solutions]),
        vehicle=stamp(problem.vehicle),
    )
    return Fit(
        damping=damping,
        method=method.key,
        status=Status.RANK_DEFICIENT if aliased else Status.OK,
        rank=sum(solution.rank for solution in solutions),
        aliased=aliased,
        n_samples=n_samples,
        provenance=provenance(problem, method),
    )


def _block_diagonal(blocks: list[FloatArray]) -> FloatArray:
    sizes = [len(block) for block in blocks]
    ends = np.cumsum(sizes)
    whole = np.zeros((int(ends[-1]), int(ends[-1])))
    for block, size, end in zip(blocks, sizes, ends.tolist(), strict=True):
        whole[end - size : end, end - size : end] = block
    return whole

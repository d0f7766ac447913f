"""Ridge regression: axis by axis, columns scaled, strength by cross-validation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.refusal import refused
from hydrodamp.identification.regression.covariance import linear_uncertainty
from hydrodamp.identification.regression.influence import ridge_influence
from hydrodamp.identification.regression.least_squares import assembled
from hydrodamp.identification.regression.shrinkage import (
    CrossValidated,
    Validation,
    column_size,
    largest_strength,
    least_strength,
    shrunk,
)
from hydrodamp.identification.rows.equations import Equations
from hydrodamp.identification.rows.rank import AxisSolution, spanned
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem

Strengths = float | tuple[float, ...]
"""One strength for all axes, or six in the order X Y Z K M N."""


@dataclass(frozen=True)
class Ridge:
    """Least squares that prefers small coefficients.

    Minimises ``|Ξ κ − σ|² / n + strength · |S κ|²`` on each axis, S the root mean
    square of each column: a strength has no unit and does not depend on the length of
    the log or the unit of a column. Directions the data hardly determine shrink to
    zero, the others stay.

    Parameters
    ----------
    equations : Equations, optional
        Where the rows come from.
    strength : float, tuple of 6 floats or CrossValidated
        One for all axes, one an axis X Y Z K M N, or chosen by cross-validation.

    Raises
    ------
    MethodError
        If a strength is negative, or there are too few rows for the folds.

    Examples
    --------
    >>> Ridge().key, Ridge(strength=1e-3).strength
    ('ridge', 0.001)
    """

    equations: Equations = field(default_factory=WeakEquations)
    strength: Strengths | CrossValidated = field(default=CrossValidated())

    def __post_init__(self) -> None:
        """Refuse strengths that are none."""
        if not isinstance(self.strength, CrossValidated):
            _per_axis(self.strength)

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "ridge"

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
            With the strength, the error on the folds and the effective number of
            coefficients of each axis as remarks. Standard errors are for coloured noise
            and say nothing of what shrinking hides.
        """
        return self.identify_all(problem, (model,))[0]

    def identify_all(self, problem: Problem, models: Iterable[DampingModel]) -> tuple[Fit, ...]:
        """Identify several models from the same triangles.

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
        if isinstance(self.strength, CrossValidated):
            choice: Validation | _Given = Validation(self.equations.rows(problem), self.strength)
        else:
            choice = _Given(self.equations.triangle(problem), _per_axis(self.strength))
        return tuple(self._chosen(choice, problem, model) for model in models)

    def _chosen(self, choice: Validation | _Given, problem: Problem, model: DampingModel) -> Fit:
        free = model.restricted_to(problem.vehicle.axes)
        refusal = refused(problem, free, self.key, choice.triangle)
        if refusal is not None:
            return refusal
        strength, error = choice.strengths(free)
        solved = [
            solve_ridge(choice.triangle, terms, axis, strength[axis])
            for axis, terms in enumerate(free.terms)
        ]
        said = [
            _said(axis, terms, float(strength[axis]), float(error[axis]), effective)
            for axis, (terms, (_, effective)) in enumerate(zip(free.terms, solved, strict=True))
            if terms
        ]
        solutions = [solution for solution, _ in solved]
        n = choice.triangle.n_samples
        influence = partial(ridge_influence, strength=strength)
        uncertainty = linear_uncertainty(problem, self.equations, free, influence)
        said = [*choice.made, *said]
        return assembled(problem, free, self, solutions, n, tuple(said), uncertainty)


@dataclass(frozen=True, eq=False)
class _Given:
    """Strengths that need no choosing."""

    triangle: Triangle
    strength: FloatArray
    made: tuple[str, ...] = ()

    def strengths(self, model: DampingModel) -> tuple[FloatArray, FloatArray]:
        """Return the strengths, and no error on any fold, for any model."""
        return self.strength, np.full(6, np.nan)


def solve_ridge(
    triangle: Triangle, terms: Sequence[Term], axis: int, strength: float
) -> tuple[AxisSolution, float]:
    """Solve one axis with a ridge of given strength."""
    size = column_size(triangle, terms)
    design = triangle.r[:, [triangle.basis.index(term) for term in terms]]
    span = spanned(design, terms, size)
    target = triangle.r[:, len(triangle.basis) + axis]
    share = shrunk(span.singular, strength, triangle.n_samples)
    amounts = share * (span.directions.T @ target)
    left_over = target - span.directions @ amounts
    effective = float(share.sum())
    variance = float(left_over @ left_over) / max(triangle.n_samples - effective, 1.0)
    solution = AxisSolution(
        coefficients=span.coefficients @ amounts,
        covariance=(span.coefficients * share) @ span.coefficients.T * variance,
        rank=span.rank,
        aliased=span.aliased,
        residual=float(np.linalg.norm(left_over) / np.sqrt(triangle.n_samples)),
    )
    return solution, effective


def _said(axis: int, terms: Sequence[Term], strength: float, error: float, used: float) -> str:
    """Return what became of an axis, as one sentence."""
    unit = "N" if axis < 3 else "N m"
    at_edge = ""
    if np.isfinite(error) and strength >= largest_strength:
        at_edge = ", the largest tried: nothing the axis has predicts it"
    elif np.isfinite(error) and strength <= least_strength:
        at_edge = ", the least tried: no ridge predicts better"
    folds = f", {error:.3g} {unit} not predicted on the folds" if np.isfinite(error) else ""
    return (
        f"{AXES[axis]}: ridge strength {strength:.2g}{at_edge}{folds}; {used:.1f} effective of "
        f"{len(terms)} coefficients."
    )


def _per_axis(strength: Strengths) -> FloatArray:
    values = np.asarray(strength, dtype=np.float64)
    if values.shape not in ((), (6,)) or not np.all(np.isfinite(values)) or np.any(values < 0.0):
        raise MethodError(
            "`strength` must be zero or positive, one number or six, one an axis X Y Z K M N; "
            f"got {strength!r}"
        )
    return np.broadcast_to(values, (6,)).copy()

"""The linear estimator: rows folded once into a triangle; every model solved from it, or shrunk."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differentiation import Derivative, SavitzkyGolay
from hydrodamp.identification.fit import Fit, Method, empty_fit, make_fit
from hydrodamp.identification.har_covariance import HarCovariance, reference_model
from hydrodamp.identification.qr_factor import (
    AxisSolution,
    Triangle,
    column_span,
    group_labels,
    solve_axis,
)
from hydrodamp.identification.regression_rows import (
    PointwiseRegression,
    RegressionForm,
    Rows,
    Split,
    accumulate,
    folds,
    residuals,
)
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, vehicle_stamp
from hydrodamp.simulation.status import Status

# Samples up to which `ls` keeps its rows for the covariance of coloured noise.
MAX_ROWS = 100_000


@dataclass(frozen=True, eq=False)
class Regression:
    """The triangle of a problem, and the rows it was made of where they were kept."""

    problem: Problem
    triangle: Triangle
    rows: Rows | None = None

    @classmethod
    def of(cls, problem: Problem, equations: RegressionForm) -> Regression:
        """Make the rows, with columns for the reference of the noise, and fold them."""
        if isinstance(equations, PointwiseRegression) and problem.n_samples > MAX_ROWS:
            return cls(problem, accumulate(problem, equations.derivative))
        rows = equations.rows(problem.extend_to(reference_model(problem.vehicle.axes)))
        return cls(problem, rows.triangle(), rows)

    @cached_property
    def grams(self) -> HarCovariance | None:
        """What the rows tell of coloured noise."""
        return None if self.rows is None else HarCovariance.of(self.rows, self.triangle)

    @cached_property
    def splits(self) -> tuple[str, tuple[Split, ...]]:
        """How the rows are folded for cross-validation, and the triangles of each fold."""
        if self.rows is None:
            raise MethodError("cross-validation needs the rows: give the `strength` itself")
        made = folds(self.rows)
        return made.description, made.splits(self.rows)

    def subtract(self, damping: Damping) -> Regression:
        """Take what a damping makes off the targets."""
        made = self.triangle.columns(damping.model.basis.terms) @ damping.matrix.T
        r = self.triangle.r.copy()
        r[:, -6:] -= made
        rows = self.rows and replace(self.rows, target=residuals(self.rows, damping))
        return Regression(self.problem, replace(self.triangle, r=r), rows)

    def fit(
        self,
        method: Method,
        model: DampingModel,
        solved: Sequence[AxisSolution],
        remarks: tuple[str, ...] = (),
        *,
        about: FloatArray | float = 0.0,
        noisy_terms: bool = False,
    ) -> Fit:
        """Put together the fit of six separately solved axes."""
        rows, rich = self.rows, reference_model(self.problem.vehicle.axes)
        uncertainty = None
        if self.grams is not None:
            uncertainty = self.grams.uncertainty(solved, rich, noisy_terms=noisy_terms)
        white = block_diag(*[one.covariance for one in solved])
        return make_fit(
            self.problem,
            model,
            method,
            about + np.concatenate([one.coefficients for one in solved]),
            covariance=white * (1.0 if rows is None else rows.variance_inflation),
            uncertainty=uncertainty,
            rank=sum(one.span.rank for one in solved),
            aliased=group_labels(one.span.aliased for one in solved),
            n_samples=self.triangle.n_samples if rows is None else rows.n_samples,
            remarks=(() if rows is None else rows.remarks) + remarks,
        )


class LinearEstimator(ABC):
    """What the linear estimators share."""

    equations: RegressionForm

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
        return tuple(self._identified(regression, model) for model in models)

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
        return self._identified(Regression(problem, triangle), model)

    def _identified(self, regression: Regression, model: DampingModel) -> Fit:
        problem = regression.problem
        free = model.restricted_to(problem.vehicle.axes)
        status = rank_status(problem, free, regression.triangle)
        if status is not None:
            return empty_fit(problem, free, self.key, status)
        return self._solved(regression, free)

    def _solved(self, regression: Regression, model: DampingModel) -> Fit:
        """Solve a model that can be solved, restricted to the free axes."""
        rows = enumerate(model.terms)
        solved = [solve_axis(regression.triangle, terms, axis) for axis, terms in rows]
        return regression.fit(self, model, solved, noisy_terms=True)


def rank_status(problem: Problem, model: DampingModel, triangle: Triangle) -> Status | None:
    """Return why a model cannot be solved from a triangle, or None."""
    problem.equations.require(model)
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
    def equations(self) -> PointwiseRegression:  # type: ignore[override]
        """One row a sample."""
        return PointwiseRegression(self.derivative)

    @property
    def key(self) -> str:
        """The key on the command line, and beside the paper's column, of what is the paper's."""
        return "ls-smoothed" if isinstance(self.derivative, SavitzkyGolay) else "ls"


@dataclass(frozen=True)
class WeakForm(LinearEstimator):
    """Least squares on the weak form, axis by axis.

    Parameters
    ----------
    equations : WeakRegression
        Length and overlap of the test functions.

    Examples
    --------
    >>> WeakForm().key
    'weak'
    """

    equations: WeakRegression = field(default_factory=WeakRegression)
    key = "weak"


# Strengths tried, forty a decade, from none that matters to all but zero.
_GRID = np.logspace(-12.0, 2.0, 561)


@dataclass(frozen=True)
class Ridge(LinearEstimator):
    """Least squares that prefers small coefficients, or those near known ones.

    Minimises ``|Ξ κ − σ|² / n + strength · |S (κ − κ₀)|²`` on each axis, S the root mean
    square of each column: a strength has no unit and does not depend on the length of
    the log or the unit of a column. Directions the data hardly determine shrink to
    κ₀, the others stay. Standard errors say nothing of what shrinking hides.

    Parameters
    ----------
    equations : Equations, optional
        Where the rows come from.
    strength : float, optional
        By default that of each axis is chosen by cross-validation over segments, see
        :func:`hydrodamp.folds`.
    prior : Damping, optional
        κ₀: a published set or an earlier fit. A coefficient that it lacks, and every one by
        default, is zero.

    Raises
    ------
    MethodError
        If a strength is negative, or there are too few rows for the folds.

    Examples
    --------
    >>> Ridge().key, Ridge(strength=1e-3).strength
    ('ridge', 0.001)
    """

    equations: RegressionForm = field(default_factory=WeakRegression)
    strength: float | None = None
    prior: Damping | None = None
    key = "ridge"

    def __post_init__(self) -> None:
        """Refuse a strength that is none."""
        fits = self.strength is None or 0.0 <= self.strength < np.inf
        demand(fits, "strength", "zero or positive", self.strength)

    def _solved(self, regression: Regression, model: DampingModel) -> Fit:
        remarks, about = [], np.zeros(model.n_coefficients)
        if self.prior is not None:
            warn_if_foreign(self.prior, vehicle_stamp(regression.problem.vehicle))
            about = np.nan_to_num(self.prior.onto(model))
            regression = regression.subtract(Damping(model, about))
            remarks.append(
                f"Prior '{self.prior.model.key}' has {np.count_nonzero(about)} of "
                f"{model.n_coefficients} coefficients; the others are drawn to zero."
            )
        chosen = [(self.strength or 0.0, "")] * 6
        if self.strength is None:
            made, chosen = _cross_validated(regression, model)
            remarks.append(made)
        solved = []
        for axis, (terms, (strength, said)) in enumerate(zip(model.terms, chosen, strict=True)):
            solved.append(solve_axis(regression.triangle, terms, axis, strength))
            if terms:
                remarks.append(
                    f"{AXES[axis]}: ridge strength {strength:.2g}{said}; "
                    f"{solved[-1].share.sum():.1f} effective of {len(terms)} coefficients."
                )
        return regression.fit(self, model, solved, tuple(remarks), about=about)


def _cross_validated(
    regression: Regression, model: DampingModel
) -> tuple[str, list[tuple[float, str]]]:
    """Choose a strength for each axis; say how, and what is not predicted on the folds."""
    made, splits = regression.splits
    fewest = min(split.train.n_samples for split in splits)
    axis = int(np.argmax([len(row) for row in model.terms]))
    if fewest < (needed := len(model.terms[axis])):
        raise MethodError(
            f"cross-validation ({made}) leaves {fewest} rows to learn from where "
            f"axis {AXES[axis]} of model '{model.key}' has {needed} terms: give a longer log, "
            "or the strength itself."
        )
    whole = regression.triangle
    chosen = [_strength(whole, splits, terms, axis) for axis, terms in enumerate(model.terms)]
    return f"Ridge strengths by cross-validation: {made}.", chosen


def _strength(
    whole: Triangle, splits: Sequence[Split], terms: Sequence[Term], axis: int
) -> tuple[float, str]:
    """Return the strength of one axis, and what is not predicted with it."""
    if not terms:
        return 0.0, ""
    size = np.linalg.norm(whole.columns(terms), axis=0) / np.sqrt(whole.n_samples)
    lost = np.sum([_lost(split, terms, axis, size) for split in splits], axis=0)
    best, unit = int(lost.argmin()), "N" if axis < 3 else "N m"
    missed = np.sqrt(lost[best] / sum(split.test.n_samples for split in splits))
    edges = {
        0: ", the least tried: no ridge predicts better",
        len(_GRID) - 1: ", the largest tried: nothing the axis has predicts it",
    }
    said = f"{edges.get(best, '')}, {missed:.3g} {unit} not predicted on the folds"
    return float(_GRID[best]), said


def _lost(split: Split, terms: Sequence[Term], axis: int, size: FloatArray) -> FloatArray:
    """Return the squares not predicted on one fold, one sum a strength."""
    train, test = (part.columns(terms) for part in (split.train, split.test))
    span = column_span(train, terms, size)
    square = span.singular**2
    kept = square / (square + _GRID[:, None] * split.train.n_samples)
    amounts = kept * (span.directions.T @ split.train.target(axis))
    rest = split.test.target(axis)[:, None] - test @ (span.coefficients @ amounts.T)
    squares: FloatArray = np.sum(rest * rest, axis=0)
    return squares

"""Linear least squares and ridge regression on the axis equations, from one R factor.

Minimises ``|Ξ κ − σ|²`` (equation 12) or ``|Ξ κ − σ|² / n + λ |S (κ − κ₀)|²`` (ridge) per axis.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import AXES, Term
from hydrodamp.errors import MethodError, demand
from hydrodamp.identification.differentiation import Derivative, SavitzkyGolay
from hydrodamp.identification.fit import Fit, Method, empty_fit, make_fit
from hydrodamp.identification.har_covariance import HarCovariance, reference_model
from hydrodamp.identification.regression import (
    AxisSolution,
    PointwiseRegression,
    RegressionForm,
    Rows,
    Split,
    Triangle,
    accumulate,
    column_span,
    folds,
    group_labels,
    residuals,
    solve_axis,
)
from hydrodamp.identification.weak_form import WeakRegression
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem, vehicle_stamp
from hydrodamp.status import Status

# samples; up to this number `ls` stores its rows for the covariance under coloured noise
MAX_ROWS = 100_000


@dataclass(frozen=True, eq=False)
class Regression:
    """The R factor of a problem, and its rows where they are stored."""

    problem: Problem
    triangle: Triangle
    rows: Rows | None = None

    @classmethod
    def of(cls, problem: Problem, equations: RegressionForm) -> Regression:
        """Build the rows, with the terms of the noise reference, and factorise them."""
        if isinstance(equations, PointwiseRegression) and problem.n_samples > MAX_ROWS:
            return cls(problem, accumulate(problem, equations.derivative))
        rows = equations.rows(problem.extend_to(reference_model(problem.vehicle.axes)))
        return cls(problem, rows.triangle(), rows)

    @cached_property
    def har_covariance(self) -> HarCovariance | None:
        """Estimator of the covariance under coloured residuals; None without rows."""
        return None if self.rows is None else HarCovariance.of(self.rows, self.triangle)

    @cached_property
    def splits(self) -> tuple[str, tuple[Split, ...]]:
        """Description of the cross-validation folds, and the R factors of each."""
        if self.rows is None:
            raise MethodError("cross-validation needs the rows: set `strength`")
        divided = folds(self.rows)
        return divided.description, divided.splits(self.rows)

    def subtract(self, damping: Damping) -> Regression:
        """Subtract the wrench of a damping from the targets."""
        wrench = self.triangle.columns(damping.model.basis.terms) @ damping.matrix.T
        r = self.triangle.r.copy()
        r[:, -6:] -= wrench
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
        errors_in_variables: bool = False,
    ) -> Fit:
        """Build the fit of six separately solved axes, with coefficients relative to ``about``."""
        rows, extended = self.rows, reference_model(self.problem.vehicle.axes)
        uncertainty = None
        if self.har_covariance is not None:
            uncertainty = self.har_covariance.uncertainty(
                solved, extended, errors_in_variables=errors_in_variables
            )
        white = block_diag(*[solution.covariance for solution in solved])
        return make_fit(
            self.problem,
            model,
            method,
            about + np.concatenate([solution.coefficients for solution in solved]),
            covariance=white * (1.0 if rows is None else rows.variance_inflation),
            uncertainty=uncertainty,
            rank=sum(solution.span.rank for solution in solved),
            aliased=group_labels(solution.span.aliased for solution in solved),
            n_samples=self.triangle.n_samples if rows is None else rows.n_samples,
            remarks=(() if rows is None else rows.remarks) + remarks,
        )


class LinearEstimator(ABC):
    """Base class of the estimators that solve each axis from one R factor."""

    equations: RegressionForm

    @property
    @abstractmethod
    def key(self) -> str:
        """The key on the command line."""

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model, with rank, aliased labels and HAR covariance.

        Without rows (a long log) the covariance assumes white residuals.
        """
        return self.identify_all(problem, (model,))[0]

    def identify_all(self, problem: Problem, models: Iterable[DampingModel]) -> tuple[Fit, ...]:
        """Identify several models from one R factor; fits in the order of the models."""
        regression = Regression.of(problem, self.equations)
        return tuple(self._identified(regression, model) for model in models)

    def solve(self, triangle: Triangle, problem: Problem, model: DampingModel) -> Fit:
        """Solve one model from an R factor, without the data.

        Parameters
        ----------
        triangle : Triangle
            Of the problem, or merged from several.
        problem : Problem
            Gives vehicle and log.
        model : DampingModel
            The terms; restricted to the vehicle's free axes.

        Returns
        -------
        fit : Fit
            As :meth:`identify`, with a covariance that assumes white residuals.
        """
        return self._identified(Regression(problem, triangle), model)

    def _identified(self, regression: Regression, model: DampingModel) -> Fit:
        problem = regression.problem
        free = model.restricted_to(problem.vehicle.axes)
        status = rank_status(problem, free, regression.triangle)
        if status is not None:
            return empty_fit(problem, free, self.key, status)
        return self._solve_model(regression, free)

    def _solve_model(self, regression: Regression, model: DampingModel) -> Fit:
        """Solve a model that is restricted to the free axes."""
        rows = enumerate(model.terms)
        solved = [solve_axis(regression.triangle, terms, axis) for axis, terms in rows]
        return regression.fit(self, model, solved, errors_in_variables=True)


def rank_status(problem: Problem, model: DampingModel, triangle: Triangle) -> Status | None:
    """Return the status of a model that cannot be solved from an R factor, else None."""
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

    The stack ``(I₆ ⊗ ξᵀ) M_mᵀ`` of equation 12 is block-diagonal: six independent
    regressions, one per axis. Columns are scaled, the rank is determined by singular
    values, and the minimum-norm solution (of the scaled coefficients) is returned;
    aliased coefficients are listed.

    Parameters
    ----------
    derivative : Derivative, optional
        Source of the acceleration: by default the recorded one where the log has
        it, else finite differences as in the paper. ``SavitzkyGolay()`` is better
        for noisy velocities; the key is then ``ls-smoothed``.

    Examples
    --------
    >>> LeastSquares().key
    'ls'
    """

    derivative: Derivative | None = None

    @property
    def equations(self) -> PointwiseRegression:  # type: ignore[override]
        """One row per sample."""
        return PointwiseRegression(self.derivative)

    @property
    def key(self) -> str:
        """The key on the command line; ``ls`` is the method of the paper."""
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


# Candidate strengths, forty per decade, from negligible to almost complete shrinkage.
_STRENGTHS = np.logspace(-12.0, 2.0, 561)


@dataclass(frozen=True)
class Ridge(LinearEstimator):
    """Ridge regression: least squares with a quadratic penalty towards zero or a prior.

    Minimises ``|Ξ κ − σ|² / n + strength · |S (κ − κ₀)|²`` on each axis, S the root mean
    square of each column: a strength is dimensionless and independent of the length of
    the log and the unit of a column. Poorly determined directions shrink to κ₀.
    Standard errors do not include the bias due to shrinkage.

    Parameters
    ----------
    equations : Equations, optional
        Rows of the regression; the weak form by default.
    strength : float, optional
        By default chosen per axis by cross-validation over segments, see
        :func:`~hydrodamp.identification.regression.folds`.
    prior : Damping, optional
        κ₀: a published set or an earlier fit. Missing coefficients are zero; all of them by
        default.

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
        """Check the strength."""
        valid = self.strength is None or 0.0 <= self.strength < np.inf
        demand(valid, "strength", "zero or positive", self.strength)

    def _solve_model(self, regression: Regression, model: DampingModel) -> Fit:
        remarks, about = [], np.zeros(model.n_coefficients)
        if self.prior is not None:
            warn_if_foreign(self.prior, vehicle_stamp(regression.problem.vehicle))
            about = np.nan_to_num(self.prior.onto(model))
            regression = regression.subtract(Damping(model, about))
            remarks.append(
                f"Prior '{self.prior.model.key}' has {np.count_nonzero(about)} of "
                f"{model.n_coefficients} coefficients; the others shrink to zero."
            )
        strengths = [(self.strength or 0.0, "")] * 6
        if self.strength is None:
            remark, strengths = _cross_validate_strengths(regression, model)
            remarks.append(remark)
        solved = []
        for axis, (terms, (strength, note)) in enumerate(zip(model.terms, strengths, strict=True)):
            solved.append(solve_axis(regression.triangle, terms, axis, strength))
            if terms:
                remarks.append(
                    f"{AXES[axis]}: ridge strength {strength:.2g}{note}; "
                    f"{solved[-1].share.sum():.1f} effective of {len(terms)} coefficients."
                )
        return regression.fit(self, model, solved, tuple(remarks), about=about)


def _cross_validate_strengths(
    regression: Regression, model: DampingModel
) -> tuple[str, list[tuple[float, str]]]:
    """Return the strength of each axis, with a remark on the folds and notes on the errors."""
    description, splits = regression.splits
    fewest = min(split.train.n_samples for split in splits)
    axis = int(np.argmax([len(row) for row in model.terms]))
    if fewest < (needed := len(model.terms[axis])):
        raise MethodError(
            f"cross-validation ({description}) leaves {fewest} rows for training where "
            f"axis {AXES[axis]} of model '{model.key}' has {needed} terms: use a longer log, "
            "or set `strength`."
        )
    strengths = [
        _choose_strength(regression.triangle, splits, terms, axis)
        for axis, terms in enumerate(model.terms)
    ]
    return f"Ridge strengths by cross-validation: {description}.", strengths


def _choose_strength(
    triangle: Triangle, splits: Sequence[Split], terms: Sequence[Term], axis: int
) -> tuple[float, str]:
    """Return the strength of one axis with the least prediction error, and a note on the error."""
    if not terms:
        return 0.0, ""
    size = np.linalg.norm(triangle.columns(terms), axis=0) / np.sqrt(triangle.n_samples)
    errors = np.sum([_squared_errors(split, terms, axis, size) for split in splits], axis=0)
    best, unit = int(errors.argmin()), "N" if axis < 3 else "N m"
    rms = np.sqrt(errors[best] / sum(split.test.n_samples for split in splits))
    edges = {
        0: ", the smallest candidate: no ridge predicts better",
        len(_STRENGTHS) - 1: ", the largest candidate: no term of the axis predicts it",
    }
    note = f"{edges.get(best, '')}, RMS prediction error {rms:.3g} {unit} on the folds"
    return float(_STRENGTHS[best]), note


def _squared_errors(split: Split, terms: Sequence[Term], axis: int, size: FloatArray) -> FloatArray:
    """Return the sum of squared prediction errors on one fold for each strength."""
    train, test = split.train.columns(terms), split.test.columns(terms)
    span = column_span(train, terms, size)
    square = span.singular**2
    shrinkage = square / (square + _STRENGTHS[:, None] * split.train.n_samples)
    amounts = shrinkage * (span.directions.T @ split.train.target(axis))
    error = split.test.target(axis)[:, None] - test @ (span.coefficients @ amounts.T)
    return np.asarray(np.sum(error * error, axis=0))

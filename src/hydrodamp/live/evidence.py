"""Running moments of regression rows and innovations, and the grades of coefficients from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, frozen
from hydrodamp.basis.term import Term
from hydrodamp.identification import recursive
from hydrodamp.identification.identifiability import (
    MIN_MOTION_LEVERAGE,
    MIN_R_SQUARED,
    Cause,
    Grade,
    grade_coefficients,
)
from hydrodamp.identification.recursive import RecursiveState
from hydrodamp.kernels.core import N_LAGS, Estimate, Recursion

CRITICAL_VALUE = 1.959964  # of a 95 % interval of the normal distribution

FADING_ROWS = 3.0  # weights grow as the square of the count, as in csrc/recursive.c

# Mean correlation of innovations at lags of two to four rows, above which they persist: below 0.1
# with the right terms and white noise, 0.2 to 0.7 with missing terms (studies/live_alarm.py).
MAX_PERSISTENCE = 0.15


class Evidence(NamedTuple):
    """Exponentially weighted moments of the rows of an axis; columns in units of the prior."""

    rows: int = 0
    mean: float = 0.0  # of the target, [N s] or [N m s]
    square: float = 0.0  # of the target
    error: float = 0.0  # mean square of the innovation over 1 + leverage
    product: float = 0.0  # mean product of innovations at lags two to four
    columns: FloatArray | None = None  # mean square of each column

    def absorb(
        self, terms: FloatArray, target: float, innovation: float, earlier: float
    ) -> Evidence:
        """Return the moments after a row; ``earlier``: mean innovation at lags two to four."""
        weight = FADING_ROWS / (self.rows + FADING_ROWS)
        columns = np.zeros(len(terms)) if self.columns is None else self.columns
        return Evidence(
            self.rows + 1,
            self.mean + weight * (target - self.mean),
            self.square + weight * (target * target - self.square),
            self.error + weight * (innovation * innovation - self.error),
            self.product + weight * (innovation * earlier - self.product),
            frozen(columns + weight * (terms * terms - columns)),
        )

    @property
    def variance(self) -> float:
        """Variance of the target."""
        return max(0.0, self.square - self.mean * self.mean)

    @property
    def share(self) -> float:
        """Share of the target's variance that the estimate before each row predicts."""
        return max(0.0, 1.0 - self.error / self.variance) if self.variance > 0.0 else 0.0

    @property
    def is_excited(self) -> bool:
        """Whether the predicted share reaches the limit of `identify`."""
        return self.share >= MIN_R_SQUARED

    @property
    def response(self) -> float:
        """Root mean square of the predicted target."""
        return float(np.sqrt(self.share * self.variance))

    @property
    def persistence(self) -> float:
        """Mean correlation of innovations at lags two to four, at least 0."""
        return max(0.0, self.product / self.error) if self.error > 0.0 else 0.0

    @property
    def inflation(self) -> float:
        """Long-run variance of the residual over its variance, from lags two to four."""
        return 1.0 + 6.0 * self.persistence

    @property
    def is_model_form(self) -> bool:
        """Whether the innovations persist: terms are missing, or an unmodelled force acts."""
        return self.persistence > MAX_PERSISTENCE


def innovations_of(
    recursion: Recursion, axis: int, before: Estimate, after: Estimate
) -> tuple[float, float]:
    """Return the innovation of the last row of an axis, and the mean of those at lags two to four.

    Each is divided by √(1 + leverage), as the C core stores them.
    """
    previous = recursion.iv_statistics(axis, before.iv_state).innovations
    earlier = previous[1:].mean() if len(previous) == N_LAGS else 0.0
    return float(recursion.iv_statistics(axis, after.iv_state).innovations[0]), float(earlier)


class Grading(NamedTuple):
    """Grades of all coefficients, and the excitation of each axis."""

    grades: tuple[Grade, ...]
    causes: tuple[Cause | None, ...]
    errors: FloatArray  # standard errors; NaN on an axis with a model-form error
    excitation: FloatArray  # shape (6,)


def grade_axes(
    state: RecursiveState,
    coefficients: FloatArray,
    evidence: Sequence[Evidence],
    converged: BoolArray,
    model_form: BoolArray,
) -> Grading:
    """Grade coefficients as `identify` does, from running moments.

    ``converged`` and ``model_form`` hold for each axis whether the estimate has converged, and
    whether it has a model-form error; shape (6,).
    """
    current = recursive.estimate_uncertainty(state)
    errors = np.sqrt(current.covariance.diagonal())
    sound = recursive.persistent_leverage_share(state)
    model, recursion = state.adaptation.model, state.adaptation.recursion
    grades, causes = list[Grade](), list[Cause | None]()
    quiet = {
        velocity
        for velocity, moments, terms in zip("uvwpqr", evidence, model.terms, strict=True)
        if terms and not moments.is_excited
    }
    for axis, terms in enumerate(model.terms):
        columns = slice(*recursion.starts[axis : axis + 2].tolist())
        moments, unit = evidence[axis], recursion.unit[columns]
        squares = np.zeros(len(unit)) if moments.columns is None else moments.columns
        axis_grades, axis_causes = grade_coefficients(
            coefficients[columns],
            CRITICAL_VALUE * errors[columns],
            np.sqrt(squares) / np.where(unit > 0.0, unit, np.inf),
            np.array([not quiet & _velocities(term) for term in terms], dtype=np.float64),
            ~current.is_estimated[columns],
            response=moments.response,
            excited=moments.is_excited and bool(converged[axis]),
        )
        # A leverage that does not last may be noise: such a coefficient is weak at best.
        axis_grades = tuple(
            Grade.WEAK if grade is Grade.DETERMINED and share < MIN_MOTION_LEVERAGE else grade
            for grade, share in zip(axis_grades, sound[columns], strict=True)
        )
        if model_form[axis]:
            errors[columns] = np.nan
            axis_grades = (Grade.NOT_DETERMINED,) * len(terms)
            axis_causes = (Cause.MODEL_FORM,) * len(terms)
        grades += axis_grades
        causes += axis_causes
    return Grading(tuple(grades), tuple(causes), errors, current.excitation)


def _velocities(term: Term) -> set[str]:
    return {factor.strip("|") for factor in term.factors}

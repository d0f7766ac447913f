"""Running moments of regression rows and innovations, and the grades of coefficients from them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
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
    model, recursion = state.adaptation.model, state.adaptation.recursion
    axes, unit = recursion.axes, recursion.unit
    excited = np.array([moments.is_excited for moments in evidence])
    quiet = {
        v for v, terms, x in zip("uvwpqr", model.terms, excited, strict=True) if terms and not x
    }
    squares = [
        np.zeros(len(terms)) if moments.columns is None else moments.columns
        for moments, terms in zip(evidence, model.terms, strict=True)
    ]
    grades, causes = grade_coefficients(
        coefficients,
        CRITICAL_VALUE * current.standard_errors,
        np.sqrt(np.concatenate(squares)) / np.where(unit > 0.0, unit, np.inf),
        np.array([not quiet & _velocities(term) for terms in model.terms for term in terms], float),
        ~current.is_estimated,
        response=np.array([moments.response for moments in evidence])[axes],
        excited=(excited & converged)[axes],
    )
    # A leverage that does not last may be noise: such a coefficient is weak at best.
    is_noise = (current.persistent_leverage_share < MIN_MOTION_LEVERAGE).tolist()
    has_model_form = model_form[axes].tolist()
    grades = tuple(
        Grade.NOT_DETERMINED if k else Grade.WEAK if grade is Grade.DETERMINED and weak else grade
        for grade, weak, k in zip(grades, is_noise, has_model_form, strict=True)
    )
    causes = tuple(
        Cause.MODEL_FORM if k else cause for cause, k in zip(causes, has_model_form, strict=True)
    )
    errors = np.where(model_form[axes], np.nan, current.standard_errors)
    return Grading(grades, causes, errors, current.excitation)


@lru_cache
def _velocities(term: Term) -> set[str]:
    return {factor.strip("|") for factor in term.factors}

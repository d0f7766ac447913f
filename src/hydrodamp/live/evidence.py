"""Running moments of the rows of recursive least squares, and the grades that follow from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

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

# Standard errors from the middle of a 95 % interval to its ends.
_WIDTH = 1.959964

_FADING = 3.0  # rows; weights grow as the square of the count, as in csrc/recursive.c

# Mean correlation of residuals two to four rows apart from which they persist: with the right
# terms and white noise it stays below 0.1, with terms missing it is 0.2 to 0.7
# (studies/live_alarm.py).
_PERSISTENT = 0.15


class Evidence(NamedTuple):
    """Running moments of the rows of an axis; columns in units of their prior."""

    rows: int = 0
    mean: float = 0.0  # of the target, [N s] or [N m s]
    square: float = 0.0  # of the target
    error: float = 0.0  # mean square of the innovation over 1 + leverage
    product: float = 0.0  # mean product of innovations two to four rows apart
    columns: FloatArray | None = None  # mean square of each column

    def absorb(
        self, terms: FloatArray, target: float, innovation: float, earlier: float
    ) -> Evidence:
        """Return the moments after a row: its innovation, and the mean of those 2 to 4 earlier."""
        weight = _FADING / (self.rows + _FADING)
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
        """Of the target."""
        return max(0.0, self.square - self.mean * self.mean)

    @property
    def share(self) -> float:
        """Share of the target's variance that was predicted before each row was taken in."""
        return max(0.0, 1.0 - self.error / self.variance) if self.variance > 0.0 else 0.0

    @property
    def is_excited(self) -> bool:
        """Whether that is enough, by the limit of `identify`."""
        return self.share >= MIN_R_SQUARED

    @property
    def response(self) -> float:
        """Root mean square of the predicted target."""
        return float(np.sqrt(self.share * self.variance))

    @property
    def persistence(self) -> float:
        """Mean correlation of innovations two to four rows apart, 0 where it is negative."""
        return max(0.0, self.product / self.error) if self.error > 0.0 else 0.0

    @property
    def inflation(self) -> float:
        """Long-run variance of the residual over its variance, lags two to four alone."""
        return 1.0 + 6.0 * self.persistence

    @property
    def is_model_form(self) -> bool:
        """Whether the residual persists: terms are missing, or something pushes."""
        return self.persistence > _PERSISTENT


def innovations_of(
    recursion: Recursion, axis: int, before: Estimate, after: Estimate
) -> tuple[float, float]:
    """Return the innovation of an axis's last row, and the mean of those two to four rows before.

    Each over the root of 1 + leverage.
    """
    previous = recursion.iv_statistics(axis, before.iv_state).innovations
    earlier = previous[1:].mean() if len(previous) == N_LAGS else 0.0
    return float(recursion.iv_statistics(axis, after.iv_state).innovations[0]), float(earlier)


def restore_evidence(values: list[Any]) -> Evidence:
    """Return what JSON made of the moments of an axis."""
    columns = values[-1]
    return Evidence(*values)._replace(
        columns=None if columns is None else frozen(np.array(columns))
    )


class Grading(NamedTuple):
    """What an estimate line says of all coefficients, and how each axis is excited."""

    grades: tuple[Grade, ...]
    causes: tuple[Cause | None, ...]
    errors: FloatArray  # standard errors; NaN where terms are missing on an axis
    excitation: FloatArray  # shape (6,)


def grade_axes(
    state: RecursiveState,
    coefficients: FloatArray,
    evidence: Sequence[Evidence],
    converged: BoolArray,
    model_form: BoolArray,
) -> Grading:
    """Grade coefficients as `identify` does, from running moments.

    ``converged`` and ``model_form`` say of each axis whether the estimate is where the data want
    it, and whether terms are missing.
    """
    known = recursive.estimate_uncertainty(state)
    errors = np.sqrt(known.covariance.diagonal())
    sound = recursive.persistent_leverage_share(state)
    bound, grades, causes = state.adaptation, list[Grade](), list[Cause | None]()
    quiet = {
        velocity
        for velocity, one, has_terms in zip("uvwpqr", evidence, bound.model.terms, strict=True)
        if has_terms and not one.is_excited
    }
    for axis, terms in enumerate(bound.model.terms):
        part = slice(*bound.recursion.starts[axis : axis + 2].tolist())
        one, unit = evidence[axis], bound.recursion.unit[part]
        columns = np.zeros(len(unit)) if one.columns is None else one.columns
        words, reasons = grade_coefficients(
            coefficients[part],
            _WIDTH * errors[part],
            np.sqrt(columns) / np.where(unit > 0.0, unit, np.inf),
            np.array([not quiet & _velocities(term) for term in terms], dtype=np.float64),
            ~known.is_estimated[part],
            response=one.response,
            excited=one.is_excited and bool(converged[axis]),
        )
        # What tells its column from others does not last, and may be noise: a sign at best.
        words = tuple(
            Grade.WEAK if word is Grade.DETERMINED and share < MIN_MOTION_LEVERAGE else word
            for word, share in zip(words, sound[part], strict=True)
        )
        if model_form[axis]:
            errors[part] = np.nan
            words = (Grade.NOT_DETERMINED,) * len(terms)
            reasons = (Cause.MODEL_FORM,) * len(terms)
        grades += words
        causes += reasons
    return Grading(tuple(grades), tuple(causes), errors, known.excitation)


def _velocities(term: Term) -> set[str]:
    return {factor.strip("|") for factor in term.factors}

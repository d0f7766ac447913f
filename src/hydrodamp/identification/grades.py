"""Grades of coefficients: how well the data determine each, from its 95 % confidence interval."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import stdtrit

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.errors import demand
from hydrodamp.status import TextEnum

#: Least cross-validated R² of the wrench of an excited axis: a correlation of one half between the
#: predicted and the measured response.
MIN_R_SQUARED = 0.25

#: A coefficient is determined where the half-width of its 95 % interval is at most this share of
#: it: the least accuracy at which damping coefficients can be compared with others.
MAX_RELATIVE_HALF_WIDTH = 0.25

#: A coefficient is minor where the half-width, times the RMS of its regressor, is at most this
#: share of the response of the axis.
MINOR_CONTRIBUTION = 0.05

#: Least share of the leverage of a coefficient that must come from excited velocities: below it,
#: more than half of the leverage may be noise, which biases the coefficient towards zero by that
#: share (Fuller, "Measurement Error Models", 1987,
#: doi:10.1002/9780470316665, section 1.1).
MIN_MOTION_LEVERAGE = 0.5


def critical_value(level: float = 0.95, degrees_of_freedom: float = np.inf) -> float:
    """Return the quantile of Student's t for a two-sided interval."""
    demand(0.0 < level < 1.0, "level", "between 0 and 1", level)
    demand(degrees_of_freedom > 0.0, "degrees_of_freedom", "positive", degrees_of_freedom)
    return float(stdtrit(degrees_of_freedom, 0.5 + level / 2.0))


class Grade(TextEnum):
    """How well the data determine a coefficient; the value says how to use it.

    Examples
    --------
    >>> Grade.NOT_DETERMINED.word
    'not determined'
    """

    DETERMINED = (
        "determined: the 95 % confidence interval is within "
        f"±{100.0 * MAX_RELATIVE_HALF_WIDTH:.0f} % of the coefficient."
    )
    MINOR = (
        f"minor: the uncertainty is less than {100.0 * MINOR_CONTRIBUTION:.0f} % of the response "
        "of the axis; in other manoeuvres the coefficient may matter."
    )
    WEAK = "weak: only sign and order of magnitude; use it with the complete model only."
    NOT_DETERMINED = (
        "not determined: not identifiable from these data; take it from another source or omit it."
    )


class Cause(TextEnum):
    """Why a coefficient is not determined: the first cause that applies, with its meaning."""

    ALIASED = "aliased: the regressor is zero or a linear combination of others."
    POORLY_EXCITED = (
        "poorly excited: the R² of the axis on held-out data is below "
        f"{MIN_R_SQUARED}, of replays or of the force by the weak form."
    )
    NOISE = "noise: more than half of the leverage of the regressor may be measurement noise."
    NOT_SIGNIFICANT = "not significant: the 95 % confidence interval contains zero."
    MODEL_FORM = "model form: the residuals of the axis are correlated, so intervals are invalid."
    NO_BLOCK = (
        "no whole block: the run has just begun, or rejected samples and restarts leave no two "
        "successive blocks of time whole; the counts say which."
    )


def count_determined(grades: Mapping[str, Grade]) -> int | None:
    """Return the number of determined coefficients; None without grades."""
    return [*grades.values()].count(Grade.DETERMINED) if grades else None


def grade_coefficients(
    coefficient: FloatArray,
    half_width: FloatArray,
    size: FloatArray,
    reliability: FloatArray,
    aliased: BoolArray,
    *,
    response: float | FloatArray,
    excited: bool | BoolArray,
) -> tuple[tuple[Grade, ...], tuple[Cause | None, ...]]:
    """Grade coefficients, with the cause of each that is not determined.

    ``half_width`` is half the 95 % interval, ``size`` the RMS of the regressor, ``reliability`` the
    share of it that excited velocities produce; ``response`` is the RMS of its predicted wrench.
    """
    value = np.abs(coefficient)
    is_narrow = half_width <= MAX_RELATIVE_HALF_WIDTH * value
    is_minor = half_width * size <= MINOR_CONTRIBUTION * response
    criteria = np.array([is_narrow, is_minor, half_width < value])
    conditions = [
        aliased | (size == 0.0),
        np.broadcast_to(np.logical_not(excited), half_width.shape),
    ]
    failed = np.array([*conditions, reliability < MIN_MOTION_LEVERAGE, ~criteria.any(axis=0)])
    grades = np.where(failed.any(axis=0), len(criteria), criteria.argmax(axis=0)).tolist()
    first = np.where(failed.any(axis=0), failed.argmax(axis=0), -1).tolist()
    all_grades, causes = tuple(Grade), (*Cause, None)
    return tuple(all_grades[k] for k in grades), tuple(causes[k] for k in first)

"""How long a dive must be for a grade, axis by axis, and what it cannot reach and why."""

from __future__ import annotations

import numpy as np

from hydrodamp.experiment_design.closed_loop import Trajectories
from hydrodamp.experiment_design.context import PlanningContext
from hydrodamp.experiment_design.result import GoalDuration, MonteCarloVerification, verify
from hydrodamp.identification.fit import critical_value as reach_of
from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH, Cause, Grade

#: Parts of a dive that are tried: a fifth of it, and so on.
_PARTS = 5


def shortest_duration(
    context: PlanningContext,
    goal: str,
    stretches: int,
    trajectories: Trajectories,
    whole: MonteCarloVerification,
) -> tuple[GoalDuration, int, MonteCarloVerification]:
    """Return how long each axis takes to a grade; of the shortest dive stretches and fits."""
    wanted, order, labels = find_grade(goal), list(Grade), context.model.labels
    fits_by_length = {stretches: whole}
    for n in sorted({max(2, -(-stretches * k // _PARTS)) for k in range(1, _PARTS)} - {stretches}):
        fits_by_length[n] = verify(context.closed_loop, trajectories.until(n * context.samples))
    there = {
        n: np.array([order.index(g) <= order.index(wanted) for g in one.grades(labels)])
        for n, one in sorted(fits_by_length.items())
    }
    can, axes = there[stretches], np.array([label[0] for label in labels])

    def shortest(own: np.ndarray) -> int:
        return next(n for n, found in there.items() if np.all(found[own]))

    by_axis: dict[str, float | None] = {}
    for axis in dict.fromkeys(axes.tolist()):
        own = can & (axes == axis)
        by_axis[axis] = shortest(own) * context.segment_duration if own.any() else None
    least = shortest(can) if can.any() else stretches
    causes, values = whole.causes(labels), context.expected_coefficients(whole)
    minutes = stretches * context.segment_duration / 60.0
    unreached = {
        label: _why(
            float(values[place]), float(whole.std_errors[place]), causes[place], minutes, wanted
        )
        for place, label in enumerate(labels)
        if not can[place]
    }
    return GoalDuration(wanted, by_axis, unreached), least, fits_by_length[least]


def find_grade(word: str) -> Grade:
    """Return the grade of a word."""
    return next(grade for grade in Grade if grade.word == word)


def _why(value: float, error: float, cause: Cause | None, minutes: float, wanted: Grade) -> str:
    """Say why a coefficient is not brought to its grade in so many minutes."""
    if cause is not None and cause is not Cause.NOT_SIGNIFICANT:
        return str(cause.value)
    half, size = reach_of() * error, max(abs(value), 1e-12)
    enough = MAX_RELATIVE_HALF_WIDTH if wanted is Grade.DETERMINED else 1.0
    said = f"its interval of +-{half:.2g} is {half / size:.0%} of {value:.3g}"
    if half <= enough * size:
        return f"{said}, which would do, but not by the weak form, which grades the log itself."
    takes = (half / enough / size) ** 2 * minutes
    long = f"{takes:.0f} min" if takes < 600.0 else "more than ten hours"
    return (
        f"{said}; at this rate it takes {long}, or more speed and larger angles than the "
        "envelope has."
    )

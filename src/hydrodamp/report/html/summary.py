"""The verdict of a comparison in three sentences: which, how good, what is not known."""

from __future__ import annotations

from collections import Counter

import numpy as np

from hydrodamp.basis.axes import AXES
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Grade, Identifiability
from hydrodamp.report.known import reach_of
from hydrodamp.report.remarks import UNFINISHED
from hydrodamp.simulation.status import Status
from hydrodamp.validation.choice import Choice
from hydrodamp.validation.comparison import Comparison, Row

_NAMED = 8
"""Coefficients that are named; of more, the number by row."""

_MEANING = {
    Grade.WEAK: "weak, to be used with the whole model only",
    Grade.NOT_DETERMINED: "not determined",
}
"""What is said of each grade but the best."""

_UNDONE = {
    Status.NOT_SETTLED: "the estimate has not settled",
    Status.STOPPED: "the search did not end at rest",
}
"""What is said of a fit that did not come to its end."""


def summary(comparison: Comparison, grades: Identifiability | None = None) -> tuple[str, str, str]:
    """Return the verdict."""
    if all(row.rms is None for row in comparison.rows):
        return _none(comparison)
    choice = comparison.choice()
    fit = choice.row.fit
    unknown = _unknown(fit) if grades is None else f"{_by_grade(grades)}{_by_method(fit)}."
    return (_which(comparison, choice), _how_good(comparison, choice.row), unknown)


def _which(comparison: Comparison, choice: Choice[Row]) -> str:
    """Say which row to take; one that is alone is nothing to choose from."""
    if len(comparison.rows) == 1 and UNFINISHED not in comparison.provenance:
        return choice.sentence
    take = "So far, take" if UNFINISHED in comparison.provenance else "Take"
    return f"{take} {choice.sentence}"


def _none(comparison: Comparison) -> tuple[str, str, str]:
    outcomes = ", ".join(dict.fromkeys(row.status.word for row in comparison.rows)) or "no rows"
    so_far = " so far" if UNFINISHED in comparison.provenance else ""
    return (
        f"No model can be recommended{so_far}: none of {len(comparison.rows)} fits has an RMS "
        "error.",
        f"Nothing can be said of how good they are; the outcomes are: {outcomes}.",
        "The log did not determine any of these models well enough to be replayed; try models "
        "with fewer terms, another method, or a log with richer manoeuvres.",
    )


def _how_good(comparison: Comparison, row: Row) -> str:
    shares = {name: value for name, value in row.score.fit_by_axis.items() if value is not None}
    shared = comparison.provenance.get("overlap")
    unseen = (
        f"data that share {shared} with the training data" if shared else "data it has not seen"
    )
    words = (
        f"Replayed open loop on {unseen}, it errs by {row.rms:.3g} "
        f"(RMS of m/s and {comparison.rate_unit}/s together)"
    )
    if not shares:
        return f"{words}."
    worst, best = min(shares, key=shares.__getitem__), max(shares, key=shares.__getitem__)
    spread = f"{shares[worst]:.0f} % for {worst}"
    if worst != best:
        spread += f" at worst and {shares[best]:.0f} % for {best} at best"
    return f"{words}; its fit is {spread}, where 100 % is exact and 0 % no better than the mean."


def _by_grade(found: Identifiability) -> str:
    """Say how many coefficients are determined, and which are not."""
    n, sure = len(found.grades), len(found.labelled(Grade.DETERMINED))
    if sure == n:
        return f"The log determined all {n} coefficients of this model"
    parts = [f"The log determined {sure or 'none'} of its {n} coefficients"]
    for grade, meaning in _MEANING.items():
        if labels := list(found.labelled(grade)):
            verb = "is" if len(labels) == 1 else "are"
            parts.append(f"{len(labels)} {verb} {meaning}{_listed(labels)}")
    quiet = [f"{one.axis} {100.0 * one.share:.0f} %" for one in found.axes if not one.excited]
    if quiet:
        parts.append(
            "axes whose response is not predicted, for want of motion or of the right terms "
            f"(share): {', '.join(quiet)}"
        )
    return "; ".join(parts)


def _by_method(fit: Fit) -> str:
    """Say what of the fit the grades do not: how its search ended, and how many may be zero."""
    tied = {label for group in fit.aliased for label in group}
    unsure = [label for label in _unsure(fit) if label not in tied]
    parts = [_UNDONE[fit.status]] if fit.status in _UNDONE else []
    if tied:
        parts.append(f"{len(tied)} coefficients cannot be told apart")
    if unsure:
        noun = "other" if tied else "coefficient"
        parts.append(
            f"the 95 % interval of 1 {noun} holds zero"
            if len(unsure) == 1
            else f"the 95 % intervals of {len(unsure)} {noun}s hold zero"
        )
    return f"; by {fit.method}, {' and '.join(parts)}" if parts else ""


def _unknown(fit: Fit) -> str:
    n = fit.model.n_coefficients
    tied = list(dict.fromkeys(label for group in fit.aliased for label in group))
    unsure = [label for label in _unsure(fit) if label not in tied]
    parts = []
    if tied:
        parts.append(f"{len(tied)} of its {n} coefficients cannot be told apart{_listed(tied)}")
    if unsure:
        which = "of the others" if tied else f"of its {n} coefficients"
        parts.append(
            f"{len(unsure)} {which} may be zero or of either sign, by their 95 % "
            f"intervals{_listed(unsure)}"
        )
    if parts:
        return f"What the log did not determine: {'; '.join(parts)}."
    if fit.damping.covariance is not None:
        return (
            f"The log determined all {n} coefficients, in that none is aliased and no 95 % "
            "interval holds zero."
        )
    if fit.rank is None:
        return (
            f"What the log did not determine is not known: {fit.method} tells neither ranks nor "
            "standard errors."
        )
    return (
        f"The log tells all {n} coefficients apart, but {fit.method} gives no standard errors to "
        "say how well."
    )


def _unsure(fit: Fit) -> list[str]:
    if fit.damping.covariance is None:
        return []
    half = reach_of(fit) * np.sqrt(np.clip(np.diag(fit.damping.covariance), 0.0, None))
    within = np.abs(fit.damping.coefficients) <= half
    return [label for label, inside in zip(fit.model.labels, within, strict=True) if inside]


def _listed(labels: list[str]) -> str:
    """Name a few; of more, say how many stand in each row."""
    if len(labels) <= _NAMED:
        return f" ({', '.join(labels)})"
    count = Counter(label.partition("_")[0] for label in labels)
    return f" ({', '.join(f'{axis} {count[axis]}' for axis in AXES if count[axis])})"

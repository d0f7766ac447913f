"""How well each coefficient of a fit is known, in a word or two."""

from __future__ import annotations

from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import CONTRIBUTION, RELATIVE, Grade, Identifiability
from hydrodamp.identification.intervals import reach

LITTLE = "matters little"
"""Said of a coefficient that is determined, but not as a number."""

LITTLE_MEANING = (
    f"{LITTLE}: on this log, what the interval leaves open is worth less than "
    f"{100.0 * CONTRIBUTION:.0f} % of the response of its axis. Where the vehicle moves otherwise "
    "it may matter more."
)
"""What is meant by that, in a sentence."""

RULE = (
    "grade, the worse of what the log and what the interval says: determined within "
    f"{100.0 * RELATIVE:.0f} % of the number, or where it matters little; not determined where the "
    "log moves or tells apart too little, or the interval leaves anything open; weak between."
)
"""How coefficients are graded, in a sentence."""


def reach_of(fit: Fit) -> float:
    """Return how many standard errors a 95 % interval reaches to either side."""
    return reach() if fit.uncertainty is None else fit.uncertainty.reach()


def how_known(fit: Fit, grades: Identifiability | None = None) -> tuple[str, dict[str, str]]:
    """Return what is said of how well each coefficient is known."""
    if grades is not None:
        wide = _wide(fit)
        return "grade", {
            label: LITTLE if grade is Grade.DETERMINED and label in wide else grade.word
            for label, grade in grades.grades.items()
        }
    tied = {label for group in fit.aliased for label in group}
    labels = () if fit.rank is None else fit.model.labels
    return "told apart", {label: "no" if label in tied else "yes" for label in labels}


def _wide(fit: Fit) -> set[str]:
    """Return the coefficients whose intervals are wide for their size."""
    covariance, values = fit.damping.covariance, fit.damping.as_dict()
    if covariance is None:
        return set()
    half = reach_of(fit) * covariance.diagonal().clip(min=0.0) ** 0.5
    pairs = zip(values.items(), half.tolist(), strict=True)
    return {label for (label, value), wide in pairs if not wide <= RELATIVE * abs(value)}

"""Test whether a coefficient changed over a season, and date one lasting change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.fit import Fit, critical_value
from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH

#: Groups on either side of a change at least, and groups in all.
_SIDE, MIN_GROUPS = 2, 5

#: Significance level of a season, over all coefficients and days: 1 of 800 quiet seasons changed,
#: every growth of 5 % was detected (studies/season_changes.py).
SIGNIFICANCE_LEVEL = 0.002


@dataclass(frozen=True)
class ChangePoint:
    """A lasting change of one coefficient.

    ``first`` is the index of the first group after it, ``chance`` the probability of so large a
    change of any coefficient on any day in a season in which nothing changes (p-value).
    """

    label: str
    first: int
    before: float
    after: float
    standard_error: float
    p_value: float

    @property
    def relative_change(self) -> float:
        """By what share of what it was the coefficient changed; positive where it grew."""
        return self.after / self.before - 1.0 if self.before else np.inf


def find_change_points(fits: Sequence[Fit]) -> tuple[ChangePoint, ...]:
    """Return the coefficients that changed, the most significant first.

    ``fits`` are in the order of time. The error is the scatter between the groups, never their
    standard errors, which few blocks know badly: Student's t with two degrees of freedom less than
    groups, and Bonferroni over all days and coefficients. Groups without an estimate, and
    coefficients that neither side of the change determines, are left out.
    """
    value, weight = _estimates(fits)
    n_coefficients, found = value.shape[1], list[ChangePoint]()
    for index, label in enumerate(fits[0].model.labels if fits else ()):
        groups = np.flatnonzero(weight[:, index] > 0.0)
        if len(groups) < MIN_GROUPS:
            continue
        day, *change = _most_significant(value[groups, index], weight[groups, index])
        before, after, error, chance = change
        n_days = len(groups) - 2 * _SIDE + 1
        chance = min(chance * n_days * n_coefficients, 1.0)
        if chance < SIGNIFICANCE_LEVEL:
            found.append(ChangePoint(label, int(groups[day]), before, after, error, chance))
    return tuple(sorted(found, key=lambda change: change.p_value))


def _estimates(fits: Sequence[Fit]) -> tuple[FloatArray, FloatArray]:
    """Return coefficients and weights, shape (groups, coefficients); weight 0 for no estimate.

    Weights are the inverse of the standard errors that white noise would leave, a compromise
    between equal weights and those of white noise: the error of a wrong model form varies less
    between manoeuvres.
    """
    n = fits[0].model.n_coefficients if fits else 0
    value, weight = np.zeros((len(fits), n)), np.zeros((len(fits), n))
    for index, fit in enumerate(fits):
        if fit.uncertainty is None:
            continue
        leverage = fit.uncertainty.leverage
        if leverage is None:
            leverage = np.full(n, 1.0 / max(fit.n_samples, 1))
        own, aliased = fit.damping.coefficients, {label for one in fit.aliased for label in one}
        used = np.isfinite(own) & np.isfinite(leverage) & (leverage > 0.0)
        used &= [label not in aliased for label in fit.model.labels]
        value[index, used], weight[index, used] = own[used], leverage[used] ** -0.5
    return value, weight


def _most_significant(
    value: FloatArray, weight: FloatArray
) -> tuple[int, float, float, float, float]:
    """Return the day of the least p-value, and means, error of their difference and p-value."""
    n = len(value)
    days = np.arange(_SIDE, n - _SIDE + 1)
    late = np.arange(n) >= days[:, None]
    sides = np.where(np.stack([~late, late]), weight, 0.0)
    total = sides.sum(axis=2)
    before, after = means = (sides @ value) / total
    residual = value - np.where(late, after[:, None], before[:, None])
    errors = np.sqrt((residual**2 @ weight) / (n - 2) / total)
    error = np.hypot(*errors)
    half = critical_value(degrees_of_freedom=n - 2) * errors
    determined = np.any(half <= MAX_RELATIVE_HALF_WIDTH * np.abs(means), axis=0)
    ratio = np.abs(after - before) / np.maximum(error, np.finfo(np.float64).tiny)
    chance = np.where(determined, 2.0 * student.sf(ratio, n - 2), 1.0)
    best = int(chance.argmin())
    before, after, error, chance = (one[best] for one in (before, after, error, chance))
    return int(days[best]), float(before), float(after), float(error), float(chance)

"""Change-point test: at most one lasting change of each coefficient in a series of groups.

A two-sample t-test between the groups before and after each day, weighted, with a Bonferroni
correction over all days and coefficients.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from hydrodamp.arrays import FloatArray
from hydrodamp.identification.fit import Fit, critical_value
from hydrodamp.identification.identifiability import MAX_RELATIVE_HALF_WIDTH

MIN_GROUPS_PER_SIDE, MIN_GROUPS = 2, 5  # before and after a change, and in all; by choice

#: Family-wise significance level over coefficients and days: a false change in 1 of 800 seasons,
#: and every growth of 5 % detected (studies/season_changes.py).
SIGNIFICANCE_LEVEL = 0.002


@dataclass(frozen=True)
class ChangePoint:
    """A lasting change of one coefficient.

    ``first`` is the index of the first group after it, ``p_value`` the family-wise probability of
    so large a change of any coefficient on any day without a change.
    """

    label: str
    first: int
    before: float
    after: float
    standard_error: float
    p_value: float

    @property
    def relative_change(self) -> float:
        """Change over the value before it; positive for growth."""
        return self.after / self.before - 1.0 if self.before else np.inf


def find_change_points(fits: Sequence[Fit]) -> tuple[ChangePoint, ...]:
    """Return the coefficients that changed, the most significant first.

    ``fits`` are in the order of time. The standard error is the scatter between n groups, with
    n − 2 degrees of freedom; the standard errors of the groups are not used, as few blocks
    determine them poorly. Groups without an estimate, and coefficients that are determined on
    neither side of the change, are omitted.
    """
    value, weight = _estimates(fits)
    n_coefficients, changes = value.shape[1], list[ChangePoint]()
    for index, label in enumerate(fits[0].model.labels if fits else ()):
        groups = np.flatnonzero(weight[:, index] > 0.0)
        if len(groups) < MIN_GROUPS:
            continue
        day, *change = _most_significant(value[groups, index], weight[groups, index])
        before, after, error, p_value = change
        n_days = len(groups) - 2 * MIN_GROUPS_PER_SIDE + 1
        p_value = min(p_value * n_days * n_coefficients, 1.0)
        if p_value < SIGNIFICANCE_LEVEL:
            changes.append(ChangePoint(label, int(groups[day]), before, after, error, p_value))
    return tuple(sorted(changes, key=lambda change: change.p_value))


def _estimates(fits: Sequence[Fit]) -> tuple[FloatArray, FloatArray]:
    """Return coefficients and weights, shape (groups, coefficients); weight 0 for no estimate.

    Weights are the inverse standard errors under white noise: a compromise between equal weights
    and inverse variances, as model-form error varies less between manoeuvres than noise.
    """
    n = fits[0].model.n_coefficients if fits else 0
    value, weight = np.zeros((len(fits), n)), np.zeros((len(fits), n))
    for index, fit in enumerate(fits):
        if fit.uncertainty is None:
            continue
        leverage = fit.uncertainty.leverage
        if leverage is None:
            leverage = np.full(n, 1.0 / max(fit.n_samples, 1))
        coefficients = fit.damping.coefficients
        aliased = {label for labels in fit.aliased for label in labels}
        used = np.isfinite(coefficients) & np.isfinite(leverage) & (leverage > 0.0)
        used &= [label not in aliased for label in fit.model.labels]
        value[index, used], weight[index, used] = coefficients[used], leverage[used] ** -0.5
    return value, weight


def _most_significant(
    value: FloatArray, weight: FloatArray
) -> tuple[int, float, float, float, float]:
    """Return the index of the least p-value, both means, the standard error and the p-value."""
    n = len(value)
    days = np.arange(MIN_GROUPS_PER_SIDE, n - MIN_GROUPS_PER_SIDE + 1)
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
    p_values = np.where(determined, 2.0 * student.sf(ratio, n - 2), 1.0)
    best = int(p_values.argmin())
    means = float(before[best]), float(after[best])
    return int(days[best]), *means, float(error[best]), float(p_values[best])

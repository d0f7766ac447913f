"""Has a coefficient changed over a season, and when: the likeliest day of one lasting change."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from hydrodamp.identification.fit import Fit

#: Groups on either side of a change that its size is told from, and groups in all.
_SIDE, FEWEST = 2, 5

#: Chance of a change found where there is none, over all coefficients and days of a season.
CHANCE = 0.01


@dataclass(frozen=True)
class Change:
    """A lasting change of one coefficient.

    ``first`` is the number of the first group after it, ``chance`` how often so much is seen where
    nothing changes.
    """

    label: str
    first: int
    before: float
    after: float
    standard_error: float
    chance: float

    @property
    def share(self) -> float:
        """By what share of what it was the coefficient changed; positive where it grew."""
        return self.after / self.before - 1.0 if self.before else np.inf


def changes(fits: Sequence[Fit]) -> tuple[Change, ...]:
    """Return the coefficients that changed, the surest first, from fits in their order of time.

    Each is held against one lasting change after any of the groups: weighted means on both sides,
    their errors raised by what groups scatter beyond their own, and the chance of the best of all
    days and coefficients (Bonferroni).
    """
    told = [(place, one) for place, fit in enumerate(fits) if (one := fit.uncertainty)]
    if len(told) < FEWEST:
        return ()
    places, known = zip(*told, strict=True)
    value = np.array([fits[place].damping.coefficients for place in places])
    weight = 1.0 / np.maximum([np.diag(one.covariance) for one in known], 1e-300)
    freedom = np.array([one.degrees_of_freedom for one in known])
    n, found = len(known), []
    days = range(_SIDE, n - _SIDE + 1)
    for place, label in enumerate(fits[0].model.labels):
        k, w = value[:, place], weight[:, place]
        tried = [_at(day, k, w, freedom) for day in days]
        day = int(np.argmin([one[-1] for one in tried]))
        before, after, error, chance = tried[day]
        chance = min(chance * len(days) * value.shape[1], 1.0)
        if chance < CHANCE:
            found.append(Change(label, places[days[day]], before, after, error, chance))
    return tuple(sorted(found, key=lambda one: one.chance))


def _at(
    day: int, value: np.ndarray, weight: np.ndarray, freedom: np.ndarray
) -> tuple[float, float, float, float]:
    """Return the means before and after a day, the error of their difference, and its chance."""
    sides = slice(None, day), slice(day, None)
    before, after = (float(np.average(value[one], weights=weight[one])) for one in sides)
    left = value - np.where(np.arange(len(value)) < day, before, after)
    scatter = max(float(np.sum(weight * left**2)) / (len(value) - 2), 1.0)
    error = float(np.sqrt(scatter * sum(1.0 / weight[one].sum() for one in sides)))
    least = float(min(freedom[one].sum() for one in sides))
    if scatter > 1.0:
        least = min(least, len(value) - 2.0)
    return before, after, error, float(2.0 * student.sf(abs(after - before) / error, least))

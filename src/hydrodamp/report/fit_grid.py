"""One fit as a table: coefficients, how sure they are, what is not told apart."""

from __future__ import annotations

from hydrodamp.basis.axes import AXES
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.grades import Identifiability
from hydrodamp.models.labels import coefficient_unit
from hydrodamp.report.grid import Grid
from hydrodamp.report.known import LITTLE, LITTLE_MEANING, RULE, how_known
from hydrodamp.report.numbers import NOTHING, coefficient

LISTED = 12
"""Groups of coefficients that are spelt out; the file has them all."""


def fit_grid(fit: Fit, grades: Identifiability | None = None) -> Grid:
    """Return the coefficients of a fit with their standard errors."""
    model = fit.model
    heading, known = how_known(fit, grades)
    units = [
        coefficient_unit(axis, t) for axis, ts in zip(AXES, model.terms, strict=True) for t in ts
    ]
    errors = _standard_errors(fit)
    rows = tuple(
        (label, coefficient(value), error, unit, *((known.get(label, NOTHING),) if known else ()))
        for (label, value), error, unit in zip(
            fit.damping.as_dict().items(), errors, units, strict=True
        )
    )
    rule = (() if grades is None else (RULE,)) + (LITTLE_MEANING,) * (LITTLE in known.values())
    rank = "" if fit.rank is None else f", rank {fit.rank}"
    return Grid(
        title=f"{model.title} by {fit.method}: {model.n_coefficients} coefficients{rank}, "
        f"{fit.n_samples} samples",
        header=("coefficient", "value", "std. error", "unit", *((heading,) if known else ())),
        rows=rows,
        align="lrrll" if known else "lrrl",
        notes=(fit.status.value, *fit.sentences, *_groups(fit), *rule),
        dim=frozenset({2, 3}),
    )


def _standard_errors(fit: Fit) -> list[str]:
    covariance = fit.damping.covariance
    if covariance is None:
        return [NOTHING] * fit.model.n_coefficients
    return [
        coefficient(float(value) ** 0.5) if value >= 0 else NOTHING
        for value in covariance.diagonal()
    ]


def _groups(fit: Fit) -> list[str]:
    groups = [
        f"{group[0]} is zero throughout or determined by nothing"
        if len(group) == 1
        else f"{' '.join(group)} are known only together"
        for group in fit.aliased
    ]
    more = len(groups) - LISTED
    return groups if more <= 0 else [*groups[:LISTED], f"and {more} more such groups"]

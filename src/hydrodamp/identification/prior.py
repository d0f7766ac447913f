"""Least squares that starts from what was known: a normal prior and the rows of a log."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.basis.term import Term
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.linear import LinearEstimator, Regression
from hydrodamp.identification.rows import Equations
from hydrodamp.identification.triangle import Triangle, solve_axis, spanned
from hydrodamp.identification.weak import WeakEquations
from hydrodamp.models.damping import Damping, warn_if_foreign
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import stamp

# Residuals below this share of the target are rounding, not noise.
_ROUNDING = 1e-9

# Prior standard deviations from which on a coefficient counts as moved by the data, the share of
# its own that it keeps where data say little, and how many labels a remark names.
_FAR, _UNTOUCHED, _NAMED = 2.0, 0.9, 8


@dataclass(frozen=True, eq=False)
class PriorLeastSquares(LinearEstimator):
    """Least squares with a normal prior from a published coefficient set or an earlier fit.

    Each axis weighs its rows by the residuals of ordinary least squares, taken as white
    in time: coloured rows count for more than they should beside the prior.

    Parameters
    ----------
    damping : Damping
        Its coefficients are the mean. One that is zero or not finite counts as lacking.
    relative : float
        Standard deviation as a share of each coefficient, such as 0.05.
    rotary : float, optional
        The same for terms with an angular velocity in them, ``relative`` by default.
        Roddy (1990, DTRC/SHD-1298-08, appendix C) states 4 to 5 % for the static and
        10 % for the rotary coefficients of a captive model test.
    wide : float
        Standard deviation of a coefficient that the set lacks, around zero: how large
        its part of the wrench may be, as a share of the root mean square on its axis.
    equations : Equations, optional
        Where the rows come from.

    Raises
    ------
    MethodError
        If a share is not positive.

    Examples
    --------
    >>> from hydrodamp.models.published import published
    >>> PriorLeastSquares(published["vt690-sname2022"], relative=0.3).key
    'prior'
    """

    damping: Damping
    relative: float
    rotary: float | None = None
    wide: float = 1.0
    equations: Equations = field(default_factory=WeakEquations)
    key = "prior"

    def __post_init__(self) -> None:
        """Refuse a prior that says nothing or is absurdly sure."""
        shares = {"relative": self.relative, "rotary": self.rotary, "wide": self.wide}
        for name, share in shares.items():
            if share is not None and not (np.isfinite(share) and share > 0.0):
                raise MethodError(f"`{name}` must be a positive share, such as 0.1; got {share}")

    def _solved(self, regression: Regression, model: DampingModel) -> Fit:
        """Return the posterior; rank and aliases are those of the data alone."""
        triangle = regression.triangle
        warn_if_foreign(self.damping, stamp(regression.problem.vehicle))
        priors = [self._belief(triangle, axis, terms) for axis, terms in enumerate(model.terms)]
        found = []
        for axis, (terms, prior) in enumerate(zip(model.terms, priors, strict=True)):
            one = solve_axis(triangle, terms, axis)
            # What the data say as white rows, one for each direction they determine.
            target, back = triangle.target(axis), one.span.directions.T
            size = np.linalg.norm(target)
            left_over = max(np.linalg.norm(target - back.T @ (back @ target)), _ROUNDING * size)
            weight = np.sqrt(max(triangle.n_samples - one.span.rank, 1.0)) / (left_over or 1.0)
            design = weight * (back @ triangle.columns(terms))
            after = posterior(design, weight * (back @ target), *prior)
            found.append(replace(one, coefficients=after[0], covariance=after[1]))
        mean, deviation = (np.concatenate(part) for part in zip(*priors, strict=True))
        moved = np.abs(np.concatenate([one.coefficients for one in found]) - mean)
        moved = moved > _FAR * deviation
        errors = np.concatenate([np.sqrt(np.diag(one.covariance)) for one in found])
        labels, known = np.array(model.labels), mean != 0.0
        kept = (errors > _UNTOUCHED * deviation) & ~moved
        remarks = (
            f"Prior '{self.damping.model.key}' has {known.sum()} of {len(labels)} "
            "coefficients; the others start at zero.",
            *_listed(f"Moved by more than {_FAR:g} prior deviations", labels[moved & known]),
            *_listed("The data say next to nothing about", labels[kept]),
        )
        return Regression(regression.problem, triangle).fit(self, model, found, remarks)

    def _belief(
        self, triangle: Triangle, axis: int, terms: tuple[Term, ...]
    ) -> tuple[FloatArray, FloatArray]:
        """Return mean and deviation of each coefficient of an axis."""
        known, wrench = self.damping.as_dict(), np.linalg.norm(triangle.target(axis))
        sizes = np.linalg.norm(triangle.columns(terms), axis=0).tolist()
        mean, deviation = np.zeros(len(terms)), np.zeros(len(terms))
        for place, (term, size) in enumerate(zip(terms, sizes, strict=True)):
            value = known.get(f"{AXES[axis]}_{term}", 0.0)
            if value != 0.0 and np.isfinite(value):
                turns = any(factor.strip("|") in ("p", "q", "r") for factor in term.factors)
                share = self.rotary if turns and self.rotary is not None else self.relative
                mean[place], deviation[place] = value, share * abs(value)
            elif size > 0.0:
                deviation[place] = self.wide * wrench / size
        return mean, deviation


def posterior(
    design: FloatArray, target: FloatArray, mean: FloatArray, deviation: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return mean and covariance of independent coefficients after white rows were seen."""
    n = len(mean)
    span = spanned(np.vstack([design * deviation, np.eye(n)]), range(n))
    rest = np.concatenate([target - design @ mean, np.zeros(n)])
    parts = deviation[:, None] * span.coefficients
    return mean + parts @ (span.directions.T @ rest), parts @ parts.T


def _listed(head: str, labels: npt.NDArray[np.str_]) -> list[str]:
    """Return a remark naming labels, or none."""
    more = f" and {len(labels) - _NAMED} more" if len(labels) > _NAMED else ""
    return [f"{head}: {' '.join(labels[:_NAMED])}{more}."] if len(labels) else []

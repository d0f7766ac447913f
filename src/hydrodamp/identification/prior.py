"""Least squares that starts from what was known: a normal prior and the rows of a log."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.basis.term import Term
from hydrodamp.errors import demand
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
        Its coefficients are the mean. One that is zero or not finite counts as lacking: it is
        zero but for a part of the wrench as large as the root mean square on its axis.
    relative : float
        Standard deviation as a share of each coefficient, such as 0.05.
    rotary : float, optional
        The same for terms with an angular velocity in them, ``relative`` by default.
        Roddy (1990, DTRC/SHD-1298-08, appendix C) states 4 to 5 % for the static and
        10 % for the rotary coefficients of a captive model test.
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
    equations: Equations = field(default_factory=WeakEquations)
    key = "prior"

    def __post_init__(self) -> None:
        """Refuse a prior that says nothing or is absurdly sure."""
        for name, share in (("relative", self.relative), ("rotary", self.rotary)):
            fits = share is None or 0.0 < share < np.inf
            demand(fits, name, "a positive share, such as 0.1", share)

    def _solved(self, regression: Regression, model: DampingModel) -> Fit:
        """Return the posterior; rank and aliases are those of the data alone."""
        triangle = regression.triangle
        warn_if_foreign(self.damping, stamp(regression.problem.vehicle))
        priors = [self._belief(triangle, axis, terms) for axis, terms in enumerate(model.terms)]
        found = []
        for axis, (terms, prior) in enumerate(zip(model.terms, priors, strict=True)):
            one = solve_axis(triangle, terms, axis)
            target, n = triangle.target(axis), triangle.n_samples
            left_over = max(one.residual * np.sqrt(n), _ROUNDING * float(np.linalg.norm(target)))
            weight = np.sqrt(max(n - one.span.rank, 1.0)) / (left_over or 1.0)
            after = posterior(weight * triangle.columns(terms), weight * target, *prior)
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
        known, size = self.damping.as_dict(), np.linalg.norm(triangle.columns(terms), axis=0)
        mean = np.array([known.get(f"{AXES[axis]}_{term}", 0.0) for term in terms])
        mean = np.where(np.isfinite(mean), mean, 0.0)
        turns = [any(atom.strip("|") in VELOCITIES[3:] for atom in term.factors) for term in terms]
        share = np.where(turns, self.rotary or self.relative, self.relative)
        wrench, seen = np.linalg.norm(triangle.target(axis)), size > 0.0
        lacking = np.divide(wrench, size, out=np.zeros(len(terms)), where=seen)
        return mean, np.where(mean != 0.0, share * np.abs(mean), lacking)


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

"""Least squares that starts from what was known: a normal prior and the rows of a log."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import block_diag

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.errors import MethodError
from hydrodamp.identification.fit import Fit, fitted
from hydrodamp.identification.refusal import refused
from hydrodamp.identification.regression.prior import Belief, Prior
from hydrodamp.identification.regression.shrinkage import column_size
from hydrodamp.identification.rows.equations import Equations
from hydrodamp.identification.rows.rank import Span, group_labels, spanned
from hydrodamp.identification.rows.triangle import Triangle
from hydrodamp.identification.rows.weak_equations import WeakEquations
from hydrodamp.models.damping import warn_if_foreign
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import Problem
from hydrodamp.simulation.stamp import stamp

_FAR = 2.0
"""Prior standard deviations from which on a coefficient counts as moved by the data."""

_UNTOUCHED = 0.9
"""Share of its prior standard deviation that a coefficient keeps where data say little."""

# Residuals below this share of the target are rounding, not noise.
_ROUNDING = 1e-9

_NAMED = 8
"""Labels named in a remark."""


def updated(
    design: FloatArray, target: FloatArray, belief: Belief, names: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Return mean and covariance of coefficients after white rows were seen."""
    span = spanned(np.vstack([design, belief.root]), names)
    change = np.concatenate([target - design @ belief.mean, np.zeros(len(belief.root))])
    mean = belief.mean + span.coefficients @ (span.directions.T @ change)
    return mean, span.coefficients @ span.coefficients.T


@dataclass(frozen=True, eq=False)
class PriorLeastSquares:
    """Least squares with a prior from a published set or an earlier fit.

    Each axis weighs its rows by the residuals of ordinary least squares, taken as white
    in time: coloured rows count for more than they should beside the prior.

    Parameters
    ----------
    prior : Prior
        The coefficients known and how sure they are.
    equations : Equations, optional
        Where the rows come from.

    Examples
    --------
    >>> from hydrodamp.models.published import published
    >>> PriorLeastSquares(Prior(published["vt690-sname2022"], relative=0.3)).key
    'prior'
    """

    prior: Prior
    equations: Equations = field(default_factory=WeakEquations)

    def __post_init__(self) -> None:
        """Refuse what is no prior, such as a bare damping."""
        if not isinstance(self.prior, Prior):
            raise MethodError(
                "`prior` must be a Prior, such as Prior(damping, relative=0.1); got "
                f"{type(self.prior).__name__}"
            )

    @property
    def key(self) -> str:
        """The key on the command line."""
        return "prior"

    def identify(self, problem: Problem, model: DampingModel) -> Fit:
        """Identify one model.

        Parameters
        ----------
        problem : Problem
            Prepared for (at least) the model's terms.
        model : DampingModel
            Which terms.

        Returns
        -------
        fit : Fit
            With the posterior covariance; the rank and the aliases are those of the
            data alone. Remarks say what the data moved and what they leave to the prior.
        """
        return self.identify_all(problem, (model,))[0]

    def identify_all(self, problem: Problem, models: Iterable[DampingModel]) -> tuple[Fit, ...]:
        """Identify several models from one triangle.

        Parameters
        ----------
        problem : Problem
            Prepared for the terms of all models.
        models : iterable of DampingModel
            Which terms.

        Returns
        -------
        fits : tuple of Fit
            In the order of the models.

        Warns
        -----
        ForeignVehicleWarning
            If the set belongs to a vehicle of another mass, weight or buoyancy.
        """
        warn_if_foreign(self.prior.damping, stamp(problem.vehicle))
        triangle = self.equations.triangle(problem)
        return tuple(self.solve(triangle, problem, model) for model in models)

    def solve(self, triangle: Triangle, problem: Problem, model: DampingModel) -> Fit:
        """Solve one model from a triangle, without the data.

        Parameters
        ----------
        triangle : Triangle
            Of the problem, or merged from parts of it.
        problem : Problem
            Names the vehicle and the log.
        model : DampingModel
            Which terms; restricted to the vehicle's free axes.

        Returns
        -------
        fit : Fit
            As :meth:`identify`.
        """
        free = model.restricted_to(problem.vehicle.axes)
        refusal = refused(problem, free, self.key, triangle)
        if refusal is not None:
            return refusal
        belief = self.prior.rows(free.labels, _wide(triangle, free))
        seen = [_seen(triangle, free, axis) for axis in range(6)]
        design = block_diag(*[rows for rows, _, _ in seen])
        target = np.concatenate([values for _, values, _ in seen])
        mean, covariance = updated(design, target, belief, free.labels)
        return fitted(
            problem,
            free,
            self,
            mean,
            covariance=covariance,
            rank=sum(span.rank for _, _, span in seen),
            aliased=group_labels(enumerate(span.aliased for _, _, span in seen)),
            n_samples=triangle.n_samples,
            remarks=self._said(free.labels, belief, mean, covariance),
        )

    def _said(
        self, labels: tuple[str, ...], belief: Belief, mean: FloatArray, covariance: FloatArray
    ) -> tuple[str, ...]:
        deviation, known = belief.deviation, set(self.prior.known)
        moved = np.abs(mean - belief.mean) > _FAR * deviation
        kept = (np.sqrt(np.diag(covariance)) > _UNTOUCHED * deviation) & ~moved
        surprised = [label for label, far in zip(labels, moved, strict=True) if far]
        return (
            f"Prior '{self.prior.damping.model.key}' has {belief.n_known} of {len(labels)} "
            "coefficients; the others start at zero.",
            *_listed(
                f"Moved by more than {_FAR:g} prior deviations",
                [label for label in surprised if label in known],
            ),
            *_listed(
                "The data say next to nothing about",
                [label for label, same in zip(labels, kept, strict=True) if same],
            ),
        )


def _seen(
    triangle: Triangle, model: DampingModel, axis: int
) -> tuple[FloatArray, FloatArray, Span[str]]:
    """Return what the data say of one axis as white rows, one a direction they determine."""
    design = triangle.r[:, [triangle.basis.index(term) for term in model.terms[axis]]]
    target = triangle.r[:, len(triangle.basis) + axis]
    span = spanned(design, [str(term) for term in model.terms[axis]])
    amounts = span.directions.T @ target
    left_over = float(np.linalg.norm(target - span.directions @ amounts))
    size = max(left_over, _ROUNDING * float(np.linalg.norm(target))) or 1.0
    scale = np.sqrt(max(triangle.n_samples - span.rank, 1.0)) / size
    return scale * (span.directions.T @ design), scale * amounts, span


def _wide(triangle: Triangle, model: DampingModel) -> dict[str, float]:
    """Return for each coefficient the size at which it alone makes its axis's wrench."""
    sizes = {}
    norms = np.linalg.norm(triangle.r[:, len(triangle.basis) :], axis=0)
    wrenches = (norms / np.sqrt(triangle.n_samples)).tolist()
    for axis, (terms, wrench) in enumerate(zip(model.terms, wrenches, strict=True)):
        for term, size in zip(terms, column_size(triangle, terms), strict=True):
            column = triangle.r[:, triangle.basis.index(term)]
            seen = wrench > 0.0 and bool(np.any(column))
            sizes[f"{AXES[axis]}_{term}"] = wrench / float(size) if seen else np.inf
    return sizes


def _listed(head: str, labels: list[str]) -> list[str]:
    """Return a remark naming labels, or none."""
    if not len(labels):
        return []
    more = f" and {len(labels) - _NAMED} more" if len(labels) > _NAMED else ""
    return [f"{head}: {' '.join(labels[:_NAMED])}{more}."]

"""What a constraint costs: how much the residual grows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import AXES
from hydrodamp.identification.triangle import Triangle
from hydrodamp.models.model import DampingModel

_NOTHING = 1e-6
"""A relative growth below this is rounding of the solver."""


@dataclass(frozen=True, eq=False)
class Price:
    """Growth of the residual over that of unconstrained least squares."""

    total: float
    by_axis: FloatArray

    @property
    def active(self) -> bool:
        """Whether the constraint moved anything."""
        return self.total > _NOTHING

    def __str__(self) -> str:
        """Return a sentence."""
        if not self.active:
            return "The constraint costs nothing: least squares dissipates already."
        shares = ", ".join(
            f"{axis} {100.0 * share:.2g} %"
            for axis, share in zip(AXES, self.by_axis, strict=True)
            if share > _NOTHING
        )
        return f"The constraint costs {100.0 * self.total:.2g} % of RMS residual ({shares})."


def price(
    triangle: Triangle, weights: FloatArray, model: DampingModel, coefficients: FloatArray
) -> Price:
    """Compare the residual of coefficients with that of least squares."""
    ends = np.cumsum([len(terms) for terms in model.terms])[:-1]
    ratio = np.ones(6)
    for axis, (terms, part) in enumerate(
        zip(model.terms, np.split(coefficients, ends), strict=True)
    ):
        if terms:
            chosen = [triangle.basis.index(term) for term in terms]
            rest = triangle.r[:, chosen] @ part - triangle.r[:, len(triangle.basis) + axis]
            ratio[axis] = np.linalg.norm(rest) * np.sqrt(weights[axis] / triangle.n_samples)
    used = np.array([bool(terms) for terms in model.terms])
    total = float(np.sqrt(np.mean(ratio[used] ** 2))) if used.any() else 1.0
    return Price(max(total - 1.0, 0.0), np.where(used, ratio - 1.0, 0.0))

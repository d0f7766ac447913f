"""Projection of a damping onto the terms of a target: constrained least squares by axis.

For each axis, min |Ξ x - w|² over the coefficients x, with drag coefficients x <= 0 and the linear
terms together dissipative: νᵀ (D + Dᵀ) ν <= 0 for the matrix D of linear damping.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, svd
from scipy.optimize import lsq_linear

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF, Term
from hydrodamp.export.plant import ExportedPlant, States, point_transform
from hydrodamp.identification.dissipative import project_dissipative
from hydrodamp.identification.dissipativity import OperatingBox, PowerRows
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel, spell_label

#: Directions of smaller singular values (relative to the greatest) are regularised to zero: the
#: samples do not determine them, and elsewhere they would make the motion diverge.
MIN_SINGULAR_RATIO = 1e-2

POWER_ROUNDING = 1e-12  # of the sum of absolute powers
MAX_BISECTIONS = 40  # of the factor of linear couplings


def drag_terms(axis: str) -> tuple[Term, ...]:
    """Return linear and quadratic drag of an axis by its own velocity."""
    name = VELOCITY_OF[axis]
    return Term((name,)), Term((name, f"|{name}|"))


def project_damping(
    plant: ExportedPlant, model: DampingModel, at: States, point: FloatArray
) -> ExportedPlant:
    """Return a plant whose damping has the terms of a model, about a point of the body.

    Common terms keep their coefficients if the point is the origin. The wrench of the other terms
    is fitted at the states by axis, independently: a joint fit would couple the axes by the mass
    matrix. The linear terms inject no more power than those of the plant.
    """
    terms = tuple(tuple(term for term in row if not term.commands) for row in model.terms)
    free = replace(model, terms=terms)
    initial = plant.damping.onto(free) * (not point.any())
    transform = point_transform(point)
    regressor = free.basis.evaluate(at.velocity @ transform.T, down=at.down)
    wrench = plant.damping_wrench(at) @ np.linalg.inv(transform)
    scale = np.linalg.norm(wrench, axis=0)
    scale[scale == 0.0] = scale.max() or 1.0  # of an axis without damping
    residual = (wrench - regressor @ free.unpack(initial).T) / scale
    orthogonal, triangle = np.linalg.qr(regressor)
    targets, stops = orthogonal.T @ residual, np.cumsum([len(row) for row in free.terms])
    axes = []
    for axis, (row, stop) in enumerate(zip(free.terms, stops.tolist(), strict=True)):
        is_drag = np.array([term in drag_terms(AXES[axis]) for term in row], dtype=bool)
        drag = np.maximum(-initial[stop - len(row) : stop], 0.0)
        columns = triangle[:, [free.basis.index(term) for term in row]]
        upper = np.where(is_drag, drag, np.inf)
        axes.append(_AxisProblem.regularise(columns / scale[axis], targets[:, axis], upper))
    change = np.concatenate([axis.solve() for axis in axes])
    extent, matrix = plant.box.max_abs, _linear_matrix(plant.damping)
    power = _max_power(matrix, extent)
    limit = max(power, 0.0) + POWER_ROUNDING * float(extent @ np.abs(matrix) @ extent)
    if _max_power(_linear_matrix(Damping(free, initial + change)), extent) > limit:
        if power <= limit:
            change = _constrain_power(free, axes, initial, change, plant.box)
        change = _limit_couplings(free, initial, change, limit, extent)
    fitted = dict(zip(free.labels, (initial + change).tolist(), strict=True))
    values = plant.damping.as_dict() | fitted
    coefficients = np.array([values[label] for label in model.labels])
    damping = replace(plant.damping, model=model, coefficients=coefficients, covariance=None)
    return replace(plant, damping=damping)


class _AxisProblem(NamedTuple):
    """Least squares of an axis: min |matrix x - target|, x <= upper."""

    matrix: FloatArray
    target: FloatArray
    upper: FloatArray

    @classmethod
    def regularise(cls, columns: FloatArray, target: FloatArray, upper: FloatArray) -> _AxisProblem:
        """Return the problem of columns (n, m) with small singular values raised to the minimum."""
        unit = np.linalg.norm(columns, axis=0)
        unit[unit == 0.0] = 1.0
        u, singular, vh = svd(columns / unit, full_matrices=False)
        minimum = MIN_SINGULAR_RATIO * singular.max(initial=0.0) or 1.0
        is_small = singular < minimum
        weight = np.where(is_small, minimum, singular)
        projected = np.where(is_small, 0.0, u.T @ target)
        return cls(weight[:, None] * vh * unit, projected, upper)

    def solve(self, free: BoolArray | None = None, start: FloatArray | None = None) -> FloatArray:
        """Return the solution; if given, only ``free`` entries of ``start`` change."""
        x = np.zeros(len(self.upper)) if start is None else start.copy()
        free = np.ones(len(x), dtype=bool) if free is None else free
        if free.any():
            target = self.target - self.matrix[:, ~free] @ x[~free]
            matrix, unit = self.matrix[:, free], np.linalg.norm(self.matrix[:, free], axis=0)
            bounds = -np.inf, self.upper[free] * unit
            solution = lsq_linear(matrix / unit, target, bounds, method="bvls").x / unit
            x[free] = np.minimum(solution, self.upper[free])  # scaling rounds
        return x


def _constrain_power(
    model: DampingModel,
    axes: list[_AxisProblem],
    initial: FloatArray,
    change: FloatArray,
    box: OperatingBox,
) -> FloatArray:
    """Return the change nearest to the fit whose linear terms together dissipate."""
    is_linear = np.array([_is_linear(term) for _, term in _labelled_terms(model)], dtype=bool)
    rows = tuple(tuple(filter(_is_linear, row)) for row in model.terms)
    splits = np.cumsum([len(row) for row in model.terms])[:-1]
    masks, roots = np.split(is_linear, splits), []
    for axis, mask in zip(axes, masks, strict=True):
        if mask.any():  # eliminate the other terms
            ordered = np.column_stack([axis.matrix[:, ~mask], axis.matrix[:, mask]])
            n = int(mask.sum())
            roots.append(np.linalg.qr(ordered)[1][-n:, -n:])
    symmetric_box = OperatingBox(-box.max_abs, box.max_abs)
    power = PowerRows(replace(model, terms=rows))
    linear, _ = project_dissipative(
        power, symmetric_box, block_diag(*roots), (initial + change)[is_linear]
    )
    constrained = change.copy()
    constrained[is_linear] = linear - initial[is_linear]
    starts = zip(axes, masks, np.split(constrained, splits), strict=True)
    return np.concatenate([axis.solve(~mask, start) for axis, mask, start in starts])


def _limit_couplings(
    model: DampingModel, initial: FloatArray, change: FloatArray, limit: float, extent: FloatArray
) -> FloatArray:
    """Return a change with linear couplings scaled until they inject no more power than a limit.

    Near rest linear terms dominate: their greatest power is the greatest eigenvalue of the
    symmetric part of their matrix, in units of the box.
    """
    is_coupling = [_is_coupling(axis, term) for axis, term in _labelled_terms(model)]

    def scale_couplings(factor: float) -> FloatArray:
        return np.where(is_coupling, factor * change, change)

    def exceeds_limit(factor: float) -> bool:
        matrix = _linear_matrix(Damping(model, initial + scale_couplings(factor)))
        return _max_power(matrix, extent) > limit

    low, high = 0.0, 1.0
    if not exceeds_limit(high):
        return change
    for _ in range(MAX_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if exceeds_limit(middle) else (middle, high)
    return scale_couplings(low)


def _labelled_terms(model: DampingModel) -> list[tuple[str, Term]]:
    return [(axis, term) for axis, row in zip(AXES, model.terms, strict=True) for term in row]


def _is_linear(term: Term) -> bool:
    return len(term.factors) == 1 and term.factors[0] in VELOCITIES


def _is_coupling(axis: str, term: Term) -> bool:
    return _is_linear(term) and term not in drag_terms(axis)


def _linear_matrix(damping: Damping) -> FloatArray:
    """Return the matrix of linear damping, shape (6, 6)."""
    values = damping.as_dict()
    labels = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
    return np.array([[values.get(label, 0.0) for label in row] for row in labels])


def _max_power(matrix: FloatArray, extent: FloatArray) -> float:
    """Return the greatest power of linear damping at velocities of a box's size."""
    scaled = extent[:, None] * (matrix + matrix.T) * extent / 2.0
    return float(np.linalg.eigvalsh(scaled)[-1])

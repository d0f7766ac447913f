"""The terms of a target in the place of others: least squares under the constraint to damp."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, svd
from scipy.optimize import lsq_linear

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.export.plant import ExportedPlant, States
from hydrodamp.export.rigid_body import to_point
from hydrodamp.identification.dissipative import project_dissipative
from hydrodamp.identification.dissipativity import OperatingBox, PowerRows
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel, spell_label

#: Combinations of terms that the velocities tell apart by a smaller share stay near zero: what
#: fits them there runs away elsewhere.
_LEAST = 1e-2

_ROUNDING = 1e-12  # of the greatest power
_HALVINGS = 40  # of an interval, to find how much of a coupling still dissipates


def diagonal(axis: str) -> tuple[Term, ...]:
    """Return linear and quadratic drag of an axis along itself."""
    own = VELOCITY_OF[axis]
    return Term((own,)), Term((own, f"|{own}|"))


def projected(
    craft: ExportedPlant, model: DampingModel, at: States, point: FloatArray
) -> ExportedPlant:
    """Return a craft whose damping is in the terms of a model, about a point of the body.

    What they have in common stays where that is the origin. The wrench of the rest is fitted where
    the craft was asked, an axis by itself: how eq. 24 weights axes is the same for all that may fit
    it then. Together they would lend each other accelerations through the mass matrix, and spoil
    their own axes. The fit drives no motion that the craft's own coefficients do not drive: drag of
    an axis along itself is not positive, and linear terms together take power.
    """
    damped = tuple(tuple(term for term in row if not term.commands) for row in model.terms)
    free = replace(model, terms=damped)
    kept = craft.damping.onto(free) * (not point.any())
    turn = to_point(point)
    regressor = free.basis.evaluate(at.velocity @ turn.T, down=at.down)
    whole = craft.damping_wrench(at) @ np.linalg.inv(turn)
    size = np.linalg.norm(whole, axis=0)
    size[size == 0.0] = size.max() or 1.0  # of an axis without damping
    missing = (whole - regressor @ free.unpack(kept).T) / size
    orthogonal, triangle = np.linalg.qr(regressor)
    wanted, ends = orthogonal.T @ missing, np.cumsum([len(row) for row in free.terms])
    axes = []
    for axis, (row, end) in enumerate(zip(free.terms, ends.tolist(), strict=True)):
        own = np.array([term in diagonal(AXES[axis]) for term in row], dtype=bool)
        most = np.where(own, np.maximum(-kept[end - len(row) : end], 0.0), np.inf)
        columns = triangle[:, [free.basis.index(term) for term in row]]
        axes.append(_Axis.of(columns / size[axis], wanted[:, axis], most))
    change = np.concatenate([axis.fit() for axis in axes])
    extent, own_push = craft.box.max_abs, _push(_linear(craft.damping), craft.box.max_abs)
    limit = max(own_push, 0.0) + _ROUNDING * float(extent @ np.abs(_linear(craft.damping)) @ extent)
    if _push(_linear(Damping(free, kept + change)), extent) > limit:
        if own_push <= limit:
            change = _dissipative(free, axes, kept, change, craft.box)
        change = _shrunk(free, kept, change, limit, extent)
    found = kept + change
    fitted = dict(zip(free.labels, found.tolist(), strict=True))
    values = [(craft.damping.as_dict() | fitted)[label] for label in model.labels]
    changed = replace(craft.damping, model=model, coefficients=np.array(values), covariance=None)
    return replace(craft, damping=changed)


class _Axis(NamedTuple):
    """Least squares of an axis: ``|matrix x - target|`` with x at most ``most``.

    Combinations below the least share of the greatest singular value are drawn to zero by it.
    """

    matrix: FloatArray
    target: FloatArray
    most: FloatArray

    @classmethod
    def of(cls, columns: FloatArray, wanted: FloatArray, most: FloatArray) -> _Axis:
        """Return the problem of some columns (n, m), its matrix square."""
        unit = np.linalg.norm(columns, axis=0)
        unit[unit == 0.0] = 1.0
        left, singular, right = svd(columns / unit, full_matrices=False)
        least = _LEAST * singular.max(initial=0.0) or 1.0
        weak = singular < least
        weight = np.where(weak, least, singular)
        target = np.where(weak, 0.0, left.T @ wanted)
        return cls(weight[:, None] * right * unit, target, most)

    def fit(self, free: BoolArray | None = None, held: FloatArray | None = None) -> FloatArray:
        """Return the solution; with some free alone, the others held."""
        found = np.zeros(len(self.most)) if held is None else held.copy()
        free = np.ones(len(found), dtype=bool) if free is None else free
        if free.any():
            rest = self.target - self.matrix[:, ~free] @ found[~free]
            matrix, unit = self.matrix[:, free], np.linalg.norm(self.matrix[:, free], axis=0)
            bounds = -np.inf, self.most[free] * unit
            found[free] = lsq_linear(matrix / unit, rest, bounds, method="bvls").x / unit
        return found


def _dissipative(
    model: DampingModel, axes: list[_Axis], kept: FloatArray, change: FloatArray, box: OperatingBox
) -> FloatArray:
    """Return the change nearest to the fit whose linear terms together take power."""
    linear = np.array([_is_linear(term) for _, term in _places(model)], dtype=bool)
    rows = tuple(tuple(filter(_is_linear, row)) for row in model.terms)
    splits = np.cumsum([len(row) for row in model.terms])[:-1]
    parts, roots = np.split(linear, splits), []
    for axis, part in zip(axes, parts, strict=True):
        if part.any():  # what the other terms cannot make up for
            ordered = np.column_stack([axis.matrix[:, ~part], axis.matrix[:, part]])
            n = int(part.sum())
            roots.append(np.linalg.qr(ordered)[1][-n:, -n:])
    around = OperatingBox(-box.max_abs, box.max_abs)
    power = PowerRows(replace(model, terms=rows))
    moved, _ = project_dissipative(power, around, block_diag(*roots), (kept + change)[linear])
    changed = change.copy()
    changed[linear] = moved - kept[linear]
    held = zip(axes, parts, np.split(changed, splits), strict=True)
    return np.concatenate([axis.fit(~part, values) for axis, part, values in held])


def _shrunk(
    model: DampingModel, kept: FloatArray, change: FloatArray, limit: float, extent: FloatArray
) -> FloatArray:
    """Return a change with as much of its linear couplings as feed no more power than a limit.

    Near rest linear terms are all the power there is: the greatest eigenvalue of the symmetric
    part of their matrix, in units of the box, is what they feed.
    """
    couples = np.array([_couples(axis, term) for axis, term in _places(model)], dtype=bool)

    def with_share(share: float) -> FloatArray:
        return np.where(couples, share * change, change)

    def feeds(share: float) -> bool:
        return _push(_linear(Damping(model, kept + with_share(share))), extent) > limit

    low, high = 0.0, 1.0
    if not feeds(high):
        return change
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if feeds(middle) else (middle, high)
    return with_share(low)


def _places(model: DampingModel) -> list[tuple[str, Term]]:
    return [(axis, term) for axis, row in zip(AXES, model.terms, strict=True) for term in row]


def _is_linear(term: Term) -> bool:
    return len(term.factors) == 1 and term.factors[0] in VELOCITIES


def _couples(axis: str, term: Term) -> bool:
    return _is_linear(term) and term not in diagonal(axis)


def _linear(damping: Damping) -> FloatArray:
    """Return the matrix of linear damping, shape (6, 6)."""
    values = damping.as_dict()
    labels = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
    return np.array([[values.get(label, 0.0) for label in row] for row in labels])


def _push(matrix: FloatArray, extent: FloatArray) -> float:
    """Return the greatest power of linear damping at velocities of a box's size."""
    scaled = extent[:, None] * (matrix + matrix.T) * extent / 2.0
    return float(np.linalg.eigvalsh(scaled)[-1])

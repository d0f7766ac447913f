"""The terms of a target in the place of others: least squares under the constraint to damp."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import svd
from scipy.optimize import lsq_linear

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.export.body import to_point
from hydrodamp.export.craft import Craft, States
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


def projected(craft: Craft, model: DampingModel, at: States, point: FloatArray) -> Craft:
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
    missing = craft.damping_wrench(at) @ np.linalg.inv(turn) - regressor @ free.unpack(kept).T
    orthogonal, triangle = np.linalg.qr(regressor)
    wanted, ends = orthogonal.T @ missing, np.cumsum([len(row) for row in free.terms])
    correction = np.zeros(len(kept))
    for axis, (row, end) in enumerate(zip(free.terms, ends.tolist(), strict=True)):
        part = slice(end - len(row), end)
        columns = triangle[:, [free.basis.index(term) for term in row]]
        own = np.array([term in diagonal(AXES[axis]) for term in row], dtype=bool)
        most = np.where(own, np.maximum(-kept[part], 0.0), np.inf)
        correction[part] = _bounded(columns, wanted[:, axis], most)
    linear = _linear(craft.damping)
    found = kept + _dissipative(free, kept, correction, linear, craft.box.extent)
    fitted = dict(zip(free.labels, found.tolist(), strict=True))
    values = [(craft.damping.as_dict() | fitted)[label] for label in model.labels]
    changed = replace(craft.damping, model=model, coefficients=np.array(values), covariance=None)
    return replace(craft, damping=changed)


def _bounded(columns: FloatArray, wanted: FloatArray, most: FloatArray) -> FloatArray:
    """Return the least-squares coefficients that are not above their bounds.

    Combinations below the least share of the greatest singular value are drawn to zero by it.
    """
    unit = np.linalg.norm(columns, axis=0)
    unit[unit == 0.0] = 1.0
    if not columns.any():
        return np.zeros(columns.shape[1])
    left, singular, right = svd(columns / unit, full_matrices=False)
    weak = singular < _LEAST * singular[0]
    weight = np.where(weak, _LEAST * singular[0], singular)
    target = np.where(weak, 0.0, left.T @ wanted)
    found = lsq_linear(weight[:, None] * right, target, (-np.inf, most * unit), method="bvls")
    return np.asarray(found.x / unit)


def _dissipative(
    model: DampingModel, kept: FloatArray, change: FloatArray, own: FloatArray, extent: FloatArray
) -> FloatArray:
    """Return a change of coefficients whose linear couplings feed the motion no more than ``own``.

    Near rest linear terms are all the power there is: the greatest eigenvalue of the symmetric
    part of their matrix, in units of the box, is bounded by the craft's own or by zero.
    """
    couples = np.array([_couples(axis, term) for axis, term in _places(model)], dtype=bool)
    limit = max(_push(own, extent), 0.0)
    limit += _ROUNDING * float(np.abs(own * extent * extent[:, None]).max())

    def with_share(share: float) -> FloatArray:
        return np.where(couples, share * change, change)

    def feeds(share: float) -> bool:
        matrix = _linear(Damping(model, kept + with_share(share)))
        return _push(matrix, extent) > limit

    low, high = 0.0, 1.0
    if not couples.any() or not feeds(high):
        return change
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if feeds(middle) else (middle, high)
    return with_share(low)


def _places(model: DampingModel) -> list[tuple[str, Term]]:
    return [(axis, term) for axis, row in zip(AXES, model.terms, strict=True) for term in row]


def _couples(axis: str, term: Term) -> bool:
    return len(term.factors) == 1 and term.factors[0] in VELOCITIES and term not in diagonal(axis)


def _linear(damping: Damping) -> FloatArray:
    """Return the matrix of linear damping, shape (6, 6)."""
    values = damping.as_dict()
    labels = [[spell_label(axis, Term((name,))) for name in VELOCITIES] for axis in AXES]
    return np.array([[values.get(label, 0.0) for label in row] for row in labels])


def _push(matrix: FloatArray, extent: FloatArray) -> float:
    """Return the greatest power of linear damping at velocities of a box's size."""
    scaled = extent[:, None] * (matrix + matrix.T) * extent / 2.0
    return float(np.linalg.eigvalsh(scaled)[-1])

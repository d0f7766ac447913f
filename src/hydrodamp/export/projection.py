"""A damping in terms that a target can hold: which, and least squares over velocities."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
from scipy.linalg import lstsq

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.basis.term import Term
from hydrodamp.errors import ModelError
from hydrodamp.export.body import to_point
from hydrodamp.export.craft import Craft, States
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel, read_label

#: Combinations of terms are left alone that the velocities tell apart by a smaller share: what
#: fits them there runs away elsewhere.
_LEAST = 1e-2

_ODD = {**dict(zip("vwpqr", "vwpqr", strict=True)), "V_v": "v", "V_w": "w"}


def terms_for(craft: Craft, key: str, allowed: Callable[[str], Iterable[Term]]) -> DampingModel:
    """Return the terms of a craft that a target allows on each axis.

    Where it has others, those allowed of the same velocities and symmetry take their place.
    """
    model = craft.damping.model
    foreign = [
        label
        for label in model.labels
        if (term := read_label(label)[1]).commands or term.needs_attitude
    ]
    if foreign:
        raise ModelError(
            f"'{key}' has no input for {', '.join(foreign)}: it holds terms of velocities alone. "
            "Give the vehicle an actuator with these numbers, or identify a model without."
        )
    rows = []
    for axis, row in zip(AXES, model.terms, strict=True):
        able = tuple(allowed(axis))
        lost = [term for term in row if term not in able]
        own = VELOCITY_OF[axis]
        moving = {own, *(name for term in lost for name in term.velocities)}
        odd = [_odd(term) for term in lost]
        rows.append(
            tuple(
                term
                for term in able
                if term in row
                or (
                    _odd(term) in odd
                    and moving.issuperset(term.velocities)
                    and term.factors != (own, own)  # it drives one way as it damps the other
                )
            )
        )
    return replace(model, terms=tuple(rows))


def _odd(term: Term) -> set[str]:
    """Return the velocities across the bow that turn the sign of a term by turning theirs."""
    names = [_ODD[factor] for factor in term.factors if factor in _ODD]
    return {name for name in names if names.count(name) % 2}


def diagonal(axis: str) -> tuple[Term, ...]:
    """Return linear and quadratic drag of an axis along itself."""
    own = VELOCITY_OF[axis]
    return Term((own,)), Term((own, f"|{own}|"))


def projected(craft: Craft, model: DampingModel, at: States, point: FloatArray) -> Craft:
    """Return a craft whose damping is in the terms of a model, about a point of the body.

    What they have in common stays where that is the origin. The wrench of the rest is fitted where
    the craft was asked, an axis by itself: how eq. 24 weights axes is the same for all that may fit
    it then. Together they would lend each other accelerations through the mass matrix, and spoil
    their own axes.
    """
    free = model.restricted_to(craft.vehicle.axes)
    kept = craft.damping.onto(free) * (not point.any())
    turn = to_point(point)
    regressor = free.basis.evaluate(at.velocity @ turn.T, down=at.down)
    missing = craft.damping_wrench(at) @ np.linalg.inv(turn) - regressor @ free.unpack(kept).T
    orthogonal, triangle = np.linalg.qr(regressor)
    wanted, found = orthogonal.T @ missing, []
    for axis, row in enumerate(free.terms):
        columns = triangle[:, [free.basis.index(term) for term in row]]
        unit = np.linalg.norm(columns, axis=0)
        unit[unit == 0.0] = 1.0
        found.append(lstsq(columns / unit, wanted[:, axis], cond=_LEAST)[0] / unit)
    own = craft.damping
    told_of = own.vehicle, own.source, own.note
    return replace(craft, damping=Damping(free, kept + np.concatenate(found), None, *told_of))

"""A damping in terms that a target can hold: least squares over velocities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import lstsq

from hydrodamp.export.craft import Craft, States
from hydrodamp.export.frames import to_point
from hydrodamp.export.target import Target
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel

#: Combinations of terms are left alone that the velocities tell apart by a smaller share: what
#: fits them there runs away elsewhere.
_LEAST = 1e-2


def left_out(craft: Craft, model: DampingModel) -> tuple[str, ...]:
    """Return the coefficients of a craft that a model does not have."""
    return tuple(label for label in craft.damping.model.labels if label not in model.labels)


def held_by(form: Target, craft: Craft, at: States) -> Craft:
    """Return a craft as a target holds it: about its point, in its terms."""
    there, turn = form.moved(craft), to_point(form.point(craft))
    model = form.holds(there)
    if model is None or not left_out(there, model):
        return there
    return projected(there, model, replace(at, velocity=at.velocity @ turn.T))


def projected(craft: Craft, model: DampingModel, at: States) -> Craft:
    """Return a craft whose damping is in the terms of a model.

    What they have in common stays. The wrench of the rest is fitted where the craft was asked, an
    axis by itself: how eq. 24 weights axes is the same for all that may fit it then. Together they
    would lend each other accelerations through the mass matrix, and spoil their own axes.
    """
    free = model.restricted_to(craft.vehicle.axes)
    kept = craft.damping.onto(free)
    regressor = free.basis.evaluate(at.velocity, down=at.down)
    missing = craft.damping_wrench(at) - regressor @ free.unpack(kept).T
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

"""A damping in terms that a target can hold: least squares over velocities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import lstsq

from hydrodamp.basis.basis import Basis
from hydrodamp.export.craft import Craft, States
from hydrodamp.models.damping import Damping
from hydrodamp.models.model import DampingModel

#: Degrees a radian: eq. 24 adds rates in deg/s to velocities in m/s.
SCORED = np.array([1.0] * 3 + [np.degrees(1.0)] * 3)

#: Combinations of terms are left alone that the velocities tell apart by a smaller share: what
#: fits them there runs away elsewhere.
_LEAST = 1e-2


def left_out(craft: Craft, model: DampingModel) -> tuple[str, ...]:
    """Return the coefficients of a craft that a model does not have."""
    return tuple(label for label in craft.damping.model.labels if label not in model.labels)


def projected(craft: Craft, model: DampingModel, at: States) -> Craft:
    """Return a craft whose damping is in the terms of a model.

    What they have in common stays. The wrench of the rest is fitted where the craft was asked,
    weighted as eq. 24 weights the acceleration it makes.
    """
    free = model.restricted_to(craft.vehicle.axes)
    kept = craft.damping.onto(free)
    entries = [
        (free.basis.index(term), axis) for axis, row in enumerate(free.terms) for term in row
    ]
    columns, axes = np.array(entries, dtype=np.intp).reshape(-1, 2).T
    regressor = Basis(free.basis.terms).evaluate(at.velocity, down=at.down)
    missing = craft.damping_wrench(at) - regressor @ free.unpack(kept).T
    weight = SCORED[:, None] * craft.inverse
    orthogonal, triangle = np.linalg.qr(regressor)
    rows = np.einsum("mj,ai->maji", triangle, weight)[:, :, columns, axes]
    rows = rows.reshape(-1, len(columns))
    wanted = (orthogonal.T @ missing @ weight.T).ravel()
    unit = np.linalg.norm(rows, axis=0)
    unit[unit == 0.0] = 1.0
    found = lstsq(rows / unit, wanted, cond=_LEAST)[0] / unit
    own = craft.damping
    damping = Damping(free, kept + found, None, own.vehicle, own.source, own.note)
    return replace(craft, damping=damping)

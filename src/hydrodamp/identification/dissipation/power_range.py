"""The power of damping over the values of one velocity, whatever the others are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.identification.dissipation.operating_box import OperatingBox
from hydrodamp.identification.dissipation.power import PowerRows, spread
from hydrodamp.models.damping import Damping

_PLACES = 25
"""Values of a velocity at which the others are varied."""


@dataclass(frozen=True, eq=False)
class PowerRange:
    """Power over the values of one velocity, whatever the others are within the box."""

    velocity: FloatArray
    least: FloatArray
    middle: FloatArray
    greatest: FloatArray


def power_range(damping: Damping, box: OperatingBox, name: str) -> PowerRange:
    """Return the power of a damping over the values of one velocity."""
    axis, rows = VELOCITIES.index(name), PowerRows(damping.model)
    values = np.linspace(box.low[axis], box.high[axis], _PLACES)
    here = np.arange(6) == axis
    low, high = (np.where(here, 0.0, bound) for bound in (box.low, box.high))
    others = spread(OperatingBox(low, high))
    power = np.empty((_PLACES, len(others)))
    for place, value in enumerate(values.tolist()):
        power[place] = rows.power(damping.coefficients, np.where(here, value, others))
    return PowerRange(values, power.min(axis=1), np.median(power, axis=1), power.max(axis=1))

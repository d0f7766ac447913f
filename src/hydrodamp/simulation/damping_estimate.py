"""Damping of a vehicle before any log: a published set, or an estimate from its hull."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.models.catalog import published
from hydrodamp.models.damping import Damping, foreign_to
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.problem import vehicle_stamp
from hydrodamp.vehicle.mass import STANDARD_GRAVITY
from hydrodamp.vehicle.vehicle import Vehicle

WATER_DENSITY = 1000.0
"""[kg/m^3]; fresh water."""

FRONTAL_DRAG, CROSSFLOW_DRAG = 0.2, 1.1
"""Drag coefficients of a smooth hull ahead (frontal area) and of a cylinder across the flow:
S. F. Hoerner, Fluid-Dynamic Drag (1965), chapters 6 and 3."""

LIFT_SLOPE = 0.03
"""Lift slope of a slender hull with tail fins, with the squared length as area; assumed."""


def published_damping(vehicle: Vehicle) -> Damping | None:
    """Return the published set of a vehicle, None without one."""
    for name, damping in published.items():
        if damping.vehicle is not None and not foreign_to(damping, vehicle_stamp(vehicle)):
            return replace(damping, source=f"published set '{name}'")
    return None


def hull_damping(vehicle: Vehicle) -> Damping:
    """Estimate damping from length and displacement, to a factor of two.

    The hull is a cylinder in crossflow, a smooth body ahead, and a slender body in lift.
    """
    length = estimate_length(vehicle) or 1.0
    volume = vehicle.weight / STANDARD_GRAVITY / WATER_DENSITY
    diameter = float(np.sqrt(4.0 * volume / np.pi / length))
    crossflow = 0.5 * WATER_DENSITY * CROSSFLOW_DRAG * diameter * length
    lift = 0.5 * WATER_DENSITY * LIFT_SLOPE * length**2
    yaw, roll = crossflow * length**3 / 32.0, 0.5 * WATER_DENSITY * CROSSFLOW_DRAG * diameter**5
    values = {
        "X_u|u|": -0.5 * WATER_DENSITY * FRONTAL_DRAG * np.pi / 4.0 * diameter**2,
        "Y_v|v|": -crossflow,
        "Z_w|w|": -crossflow,
        "Y_uv": -lift,
        "Z_uw": -lift,
        "N_r|r|": -yaw,
        "M_q|q|": -yaw,
        "N_ur": -lift * length**2 / 4.0,
        "M_uq": -lift * length**2 / 4.0,
        "K_p|p|": -roll,
        "K_up": -roll,
    }
    coefficients = {label: value for label, value in values.items() if label[0] in vehicle.axes}
    source = f"a hull of {length:.2g} m and {diameter:.2g} m"
    return Damping.from_dict(None, coefficients, source=source, vehicle=vehicle_stamp(vehicle))

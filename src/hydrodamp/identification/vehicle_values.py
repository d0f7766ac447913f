"""A vehicle at other values of the parameters that can be estimated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from hydrodamp.basis.term import AXES
from hydrodamp.vehicle.actuators import Actuator, Curve, Fin
from hydrodamp.vehicle.mass import rigid_body_mass_matrix
from hydrodamp.vehicle.vehicle import Vehicle

#: Starts of the labels of a curve's parameters whose θ is a logarithm, and the fields they scale.
CURVE_FIELDS = {"reverse_": "reverse_ratio", "exponent_": "exponent", "stall_": "limit"}

#: Starts of all labels whose θ is a logarithm.
LOGARITHMS = ("A_", "gain_", *CURVE_FIELDS)

#: Bounds of the logarithm of a curve's parameter, and of a dead band over the reference.
MAX_LOGARITHM, MAX_DEAD_BAND = (-5.0, 5.0), 0.95


def vehicle_at(vehicle: Vehicle, theta: dict[str, float]) -> Vehicle:
    """Return the vehicle at parameters θ by label, zero for those without."""
    added = np.zeros((6, 6)) if vehicle.added_mass is None else vehicle.added_mass
    factor = np.exp([0.5 * theta.get(f"A_{axis}", 0.0) for axis in AXES])
    changed, rigid = added * np.outer(factor, factor), vehicle.mass_matrix - added
    before = vehicle.center_of_gravity
    center = before + [theta.get(f"{name}_G", 0.0) for name in "xyz"]
    mass = float(rigid[:3, :3].trace()) / 3.0
    moved, unmoved = (
        rigid_body_mass_matrix(mass, np.zeros(3), point, "center_of_gravity")
        for point in (center, before)
    )
    return replace(
        vehicle,
        mass_matrix=rigid + (moved - unmoved) * np.outer(vehicle.free, vehicle.free) + changed,
        added_mass=changed,
        center_of_gravity=center,
        buoyancy=vehicle.buoyancy + theta.get("B", 0.0),
        actuators=tuple(actuator_at(each, theta) for each in vehicle.actuators),
        wrench_gain=vehicle.wrench_gain * np.exp([theta.get(f"gain_{axis}", 0.0) for axis in AXES]),
    )


def actuator_at(actuator: Actuator, theta: Mapping[str, float]) -> Actuator:
    """Return an actuator at parameters θ by label."""
    (name, *_) = actuator.commands

    def factor(start: str) -> float:
        return float(np.exp(np.clip(theta.get(start + name, 0.0), *MAX_LOGARITHM)))

    if isinstance(actuator, Fin):
        gain = factor("gain_")
        force, drag = (
            {axis: gain * value for axis, value in dict(gains).items()}
            for gains in (actuator.force, actuator.drag)
        )
        return replace(actuator, force=force, drag=drag)
    if not isinstance(actuator, Curve):
        return actuator
    values = {
        field: value * factor(start)
        for start, field in CURVE_FIELDS.items()
        if (value := getattr(actuator, field)) is not None
    }
    values["voltage_exponent"] = actuator.voltage_exponent + theta.get(f"voltage_{name}", 0.0)
    if change := theta.get(f"dead_band_{name}"):
        largest = MAX_DEAD_BAND * actuator.reference
        values["dead_band"] = min(max(actuator.dead_band + change, 0.0), largest)
    return replace(actuator, **values)

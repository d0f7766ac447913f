"""A vehicle as text on one screen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.axes import AXES, VELOCITIES

if TYPE_CHECKING:
    from hydrodamp.vehicle.vehicle import Vehicle


def describe(vehicle: Vehicle) -> str:
    """Return a vehicle as text."""
    lines = [
        f"{vehicle.name}: axes {' '.join(vehicle.axes)}",
        f"weight {vehicle.weight:g} N, buoyancy {vehicle.buoyancy:g} N",
        f"center of gravity {_point(vehicle.center_of_gravity)}, "
        f"of buoyancy {_point(vehicle.center_of_buoyancy)} m",
        "mass matrix, rigid body and added mass [kg, kg m, kg m^2]",
        *_table(vehicle),
        *(
            f"{type(one).__name__.lower()} on {', '.join(one.commands)}"
            for one in vehicle.actuators
        ),
    ]
    if not vehicle.actuators:
        lines.append("no known actuators")
    lines += [f"{what}: {text}" for what, text in _origins(vehicle) if text]
    return "\n".join(lines)


def _origins(vehicle: Vehicle) -> tuple[tuple[str, str], ...]:
    return ("source", vehicle.source), ("note", vehicle.note)


def _point(values: object) -> str:
    return "(" + ", ".join(f"{value:g}" for value in np.asarray(values)) + ")"


def _table(vehicle: Vehicle) -> list[str]:
    free = [index for index, axis in enumerate(AXES) if axis in vehicle.axes]
    head = "   " + "".join(f"{VELOCITIES[j]:>10}" for j in free)
    rows = vehicle.mass_matrix
    return [head, *(f"  {AXES[i]}" + "".join(f"{rows[i, j]:10.4g}" for j in free) for i in free)]

"""Template of a vehicle file, empty or with estimates from length, diameter and mass."""

from __future__ import annotations

import json
import re
from pathlib import Path
from string import Template

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.vehicle import Vehicle

WATER_DENSITY = 1025.0  # kg/m^3, sea water
MAX_MASS_RATIO = 3.0  # mass over displaced mass, or its inverse, beyond which units are refused


_TEMPLATE = Path(__file__).with_name("template.yaml").read_text(encoding="utf-8")
_ACTUATORS = _TEMPLATE[_TEMPLATE.index("# What is known of the actuation") :]
_EMPTY = {
    **dict.fromkeys(("mass", "weight", "buoyancy", "gravity", "lift"), ""),
    "source": '""',
    "inertia": "[null, null, null]",
    "about": "origin",
    "added": "\n".join(
        f"  - [{', '.join('null' if i == j else '0' for i in range(6))}]" for j in range(6)
    ),
}


def vehicle_template(
    name: str = "my-vehicle",
    *,
    length: float | None = None,
    diameter: float | None = None,
    mass: float | None = None,
) -> str:
    """Return the text of a vehicle file."""
    numbers = _EMPTY
    if length is not None and diameter is not None and mass is not None:
        numbers = _estimate(length, diameter, mass)
    elif (length, diameter, mass) != (None, None, None):
        raise VehicleError("an estimate needs `length`, `diameter` and `mass` together, or none")
    return Template(_TEMPLATE).substitute(name=json.dumps(name), **numbers)


def rename_vehicle(text: str, name: str) -> str:
    """Return the text of a vehicle file under another name, with an actuators section."""
    renamed = re.sub(r"(?m)^name:.*$", lambda _: f"name: {json.dumps(name)}", text, count=1)
    if re.search(r"(?m)^actuators:", text):
        return renamed
    return f"{renamed.rstrip()}\n\n{_ACTUATORS}"


def _estimate(length: float, diameter: float, mass: float) -> dict[str, str]:
    """Return the values estimated for a hull, which must be about neutrally buoyant."""
    vehicle = Vehicle.from_hull(length, diameter, mass)
    cylinder = WATER_DENSITY * np.pi / 4.0 * diameter**2 * length
    spheroid = cylinder * 2.0 / 3.0
    if not spheroid / MAX_MASS_RATIO <= mass <= cylinder * MAX_MASS_RATIO:
        raise VehicleError(
            f"a hull {length:g} m long and {diameter:g} m across displaces {spheroid:.3g} to "
            f"{cylinder:.3g} kg of water, which does not match a `mass` of {mass:g} kg: use "
            "metres and kilograms, flooded spaces included"
        )
    added = np.zeros((6, 6)) if vehicle.added_mass is None else vehicle.added_mass
    return {
        "source": json.dumps(f"{vehicle.source}: {vehicle.note}"),
        "mass": repr(float(mass)),
        "inertia": _list((vehicle.mass_matrix - added).diagonal()[3:]),
        "about": "center_of_gravity",
        "added": "\n".join(f"  - {_list(row)}" for row in added),
        "weight": f"{vehicle.weight:.6g}",
        "buoyancy": f"{vehicle.buoyancy:.6g}",
        "gravity": _list(vehicle.center_of_gravity),
        "lift": _list(vehicle.center_of_buoyancy),
    }


def _list(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.6g}" for value in values) + "]"

"""Text of vehicle files: empty, from main dimensions, or a copy under another name."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any, Literal

import numpy as np

from hydrodamp.basis.term import AXES
from hydrodamp.errors import VehicleError
from hydrodamp.vehicle.hulls import PLANAR, WATER_DENSITY, HullKind
from hydrodamp.vehicle.mass import STANDARD_GRAVITY
from hydrodamp.vehicle.priors import format_std
from hydrodamp.vehicle.vehicle import Vehicle, checked_axes

VehicleKind = HullKind | Literal["auv"]

_HULL = (("length", "beam", "draft"), ("mass", "block_coefficient"))

SIZES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "auv": (("length", "diameter", "mass"), ()),
    **dict.fromkeys(("rov", "boat", "catamaran", "ship"), _HULL),
}
"""Needed and optional sizes of each kind of vehicle."""

MAX_MASS_RATIO = 3.0
"""Mass over displaced mass of a spheroid, or its inverse, beyond which units are refused."""


def _format_list(values: Iterable[Any]) -> str:
    words = (value if isinstance(value, str) else f"{value:.6g}" for value in values)
    return f"[{', '.join(words)}]"


def _format_rows(matrix: Iterable[Any]) -> str:
    return "\n".join(f"  - {_format_list(row)}" for row in matrix)


_TEMPLATE = Path(__file__).with_name("template.yaml").read_text(encoding="utf-8")
_ACTUATORS = _TEMPLATE[_TEMPLATE.index("# What is known of the actuation") :]
_RESTORING = ("weight", "buoyancy", "gravity", "lift")
_EMPTY = {
    **dict.fromkeys(("mass", *_RESTORING), ""),
    "source": '""',
    "inertia": "[null, null, null]",
    "about": "origin",
    "added": _format_rows(np.where(np.eye(6), "null", "0").tolist()),
    "std": "std: {}\norigin: {}",
}


def vehicle_template(
    name: str = "my-vehicle",
    axes: Sequence[str] | None = None,
    kind: VehicleKind = "auv",
    /,
    **sizes: float | None,
) -> str:
    """Return the text of a vehicle file; what belongs to locked axes alone is empty."""
    axes = (AXES if kind in ("auv", "rov") else PLANAR) if axes is None else checked_axes(axes)
    numbers, known = _EMPTY, {key: size for key, size in sizes.items() if size is not None}
    if known:
        vehicle = _estimate(kind, known, axes)
        if locked := [axis for axis in axes if axis not in vehicle.axes]:
            raise VehicleError(
                f"`axes` of a {kind} are of {' '.join(vehicle.axes)}: no formula gives its added "
                f"mass on {' '.join(locked)}"
            )
        numbers = _format_numbers(vehicle, axes)
    return Template(_TEMPLATE).substitute(name=json.dumps(name), axes=_format_list(axes), **numbers)


def rename_vehicle(text: str, name: str) -> str:
    """Return the text of a vehicle file under another name, with an actuators section."""
    renamed = re.sub(r"(?m)^name:.*$", lambda _: f"name: {json.dumps(name)}", text, count=1)
    if re.search(r"(?m)^actuators:", text):
        return renamed
    return f"{renamed.rstrip()}\n\n{_ACTUATORS}"


def _estimate(kind: VehicleKind, sizes: Mapping[str, float], axes: Sequence[str]) -> Vehicle:
    """Return the vehicle estimated from its sizes."""
    needed, optional = SIZES[kind]
    if {*needed} - {*sizes} or {*sizes} - {*needed, *optional}:
        more = f", and {' or '.join(f'`{name}`' for name in optional)}" if optional else ""
        raise VehicleError(
            f"an estimate of the kind {kind} needs `{needed[0]}`, `{needed[1]}` and `{needed[2]}` "
            f"together, or none{more}; got {', '.join(sizes)}"
        )
    if kind != "auv":
        mass, block = (sizes.get(name) for name in optional)
        dimensions = (sizes[name] for name in needed)
        return Vehicle.from_dimensions(kind, *dimensions, mass=mass, block_coefficient=block)
    length, diameter, mass = (sizes[name] for name in needed)
    vehicle = Vehicle.from_hull(length, diameter, mass)
    cylinder = WATER_DENSITY * np.pi / 4.0 * diameter**2 * length
    spheroid = cylinder * 2.0 / 3.0
    lightest = spheroid / MAX_MASS_RATIO if {*axes} & {*"ZKM"} else 0.0  # a hull may float
    if not lightest <= mass <= cylinder * MAX_MASS_RATIO:
        raise VehicleError(
            f"a hull of {length:g} m by {diameter:g} m displaces {spheroid:.3g} to {cylinder:.3g} "
            f"kg, not a `mass` of {mass:g} kg: use metres and kilograms, flooded spaces included"
        )
    return vehicle


def _format_numbers(vehicle: Vehicle, axes: Sequence[str]) -> dict[str, str]:
    """Return the values of an estimate as text."""
    rows = np.asarray(vehicle.added_mass).tolist()
    inertia = (vehicle.mass_matrix - np.array(rows)).diagonal().tolist()
    for i in (i for i, axis in enumerate(AXES) if axis not in axes):
        rows[i][i] = inertia[i] = "null"
    numbers = {
        "source": json.dumps(f"{vehicle.source}: {vehicle.note}"),
        "mass": f"{vehicle.weight / STANDARD_GRAVITY:.9g}",
        "inertia": _format_list(inertia[3:]),
        "about": "center_of_gravity",
        "added": _format_rows(rows),
        "weight": f"{vehicle.weight:.6g}",
        "buoyancy": f"{vehicle.buoyancy:.6g}",
        "std": format_std(vehicle.std, vehicle.origin),
        "gravity": _format_list(vehicle.center_of_gravity),
        "lift": _format_list(vehicle.center_of_buoyancy),
    }
    submerged = {*axes} & {*"ZKM"}
    return numbers | dict.fromkeys(() if submerged else _RESTORING, "")

"""A plant known on X, Y and N alone, completed for simulators of all six axes.

What the vehicle file has of the other axes remains; the rest is that of a spheroid of its length
and displacement that floats upright without heaving, and is critically damped.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITIES, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.export.plant import ExportedPlant, with_damping
from hydrodamp.export.verification import LEVEL_ATTITUDE
from hydrodamp.simulation.checks import estimate_length
from hydrodamp.simulation.damping_estimate import WATER_DENSITY
from hydrodamp.vehicle.hulls import PLANAR
from hydrodamp.vehicle.mass import (
    STANDARD_GRAVITY,
    InertiaPoint,
    hull_added_mass,
    hull_inertia,
    rigid_body_mass_matrix,
)
from hydrodamp.vehicle.vehicle import Vehicle, without_righting

#: Height of the centre of buoyancy above that of gravity over the diameter of the spheroid: the
#: metacentric height of small boats is of this order.
RIGHTING_RATIO = 0.1

#: Share of a moment of inertia below which it is rounding of the part of the mass.
ROUNDING = 1e-9

CENTER: InertiaPoint = "center_of_gravity"


def complete_plant(plant: ExportedPlant) -> tuple[ExportedPlant, tuple[str, ...]]:
    """Return a planar plant with six axes, and what is assumed of them; others unchanged."""
    if plant.vehicle.axes != PLANAR:
        return plant, ()
    vehicle, assumed = complete_vehicle(plant.vehicle)
    lever = vehicle.weight * float(vehicle.center_of_gravity[2] - vehicle.center_of_buoyancy[2])
    heave, roll, pitch = vehicle.mass_matrix.diagonal()[2:5].tolist()
    drag = {
        "Z_w": -2.0 * heave * float(np.sqrt(lever / roll)),
        "K_p": -2.0 * float(np.sqrt(lever * roll)),
        "M_q": -2.0 * float(np.sqrt(lever * pitch)),
    }
    table = {axis: VELOCITY_OF[axis] for axis in "ZKM"}
    old = plant.damping.model
    model = replace(old.with_terms(table, old.key), title=old.title)
    completed = with_damping(replace(plant, vehicle=vehicle), model, plant.damping.as_dict() | drag)
    periods = (2.0 * np.pi * np.sqrt(np.array([roll, pitch]) / lever)).tolist()
    damping = ", ".join(f"{label} {value:.3g}" for label, value in drag.items())
    return completed, (
        *assumed,
        f"damping {damping}: critical in roll and pitch (periods {periods[0]:.2g} and "
        f"{periods[1]:.2g} s), in heave with the time of roll; nothing holds a depth",
    )


def complete_vehicle(vehicle: Vehicle) -> tuple[Vehicle, tuple[str, ...]]:
    """Return a planar vehicle with six axes, and what its file does not have."""
    assumed, weight, gravity = list[str](), vehicle.weight, vehicle.center_of_gravity
    added = np.zeros((6, 6)) if vehicle.added_mass is None else vehicle.added_mass
    rigid = vehicle.mass_matrix - added
    if not weight:
        weight = float(rigid[0, 0]) * STANDARD_GRAVITY
        share = "mass" if vehicle.added_mass is None else "rigid-body mass"
        assumed.append(f"weight {weight:.4g} N of the {share} in surge")
    if vehicle.buoyancy != weight:
        assumed.append("buoyancy equal to the weight")
    mass, length = weight / STANDARD_GRAVITY, estimate_length(vehicle) or 1.0
    diameter = min(float(np.sqrt(6.0 * mass / (np.pi * WATER_DENSITY * length))), length)
    point_mass = rigid_body_mass_matrix(float(rigid[0, 0]), np.zeros(3), gravity, CENTER)
    inertia = (rigid - point_mass).diagonal()[3:]
    is_given = inertia > ROUNDING * rigid.diagonal()[3:]
    hull_moments = hull_inertia(length, diameter, mass)
    inertia = np.where(is_given, inertia, np.maximum(hull_moments, [0.0, inertia[2], 0.0]))
    hull = hull_added_mass(length, diameter, mass, float(inertia[0]))
    is_added = vehicle.free | (added.diagonal() > 0.0)
    added = np.where(is_added[:, None] & is_added, added, hull)
    full = rigid_body_mass_matrix(mass, inertia, gravity, CENTER) + added
    known = vehicle.free.copy()
    if vehicle.added_mass is None:
        known |= vehicle.mass_matrix.diagonal() > 0.0
    full = np.where(known[:, None] & known, vehicle.mass_matrix, full)
    size = f"a spheroid of {length:.2g} m by {diameter:.2g} m"
    names = [f"inertia {'KMN'[i]}" for i in range(3) if not (is_given[i] or known[i + 3])]
    names += [
        f"added mass {axis}"
        for axis, a, b in zip(AXES, is_added, known, strict=True)
        if not (a or b)
    ]
    if names:
        assumed.append(f"{', '.join(names)} of {size}")
    completed = replace(
        vehicle,
        axes=AXES,
        mass_matrix=full,
        weight=weight,
        buoyancy=weight,
        added_mass=None if vehicle.added_mass is None else added,
    )
    if without_righting(completed):
        height = RIGHTING_RATIO * diameter
        assumed.append(f"centre of buoyancy {height:.2g} m above that of gravity")
        completed = replace(completed, center_of_buoyancy=gravity - [0.0, 0.0, height])
    return completed, tuple(assumed)


def complete_log(log: Log) -> Log:
    """Return the log of a planar vehicle with its other velocities at rest, level if unknown."""
    attitude = np.tile(LEVEL_ATTITUDE, (log.n, 1)) if log.attitude is None else log.attitude
    is_free = np.isin(list(VELOCITIES), [VELOCITY_OF[axis] for axis in PLANAR])
    return replace(
        log,
        velocity=np.where(is_free, log.velocity, 0.0),
        velocity_names=VELOCITIES,
        attitude=attitude,
        acceleration=None,
    )

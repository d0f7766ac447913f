"""A vehicle with one of its numbers moved both ways."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.vehicle.vehicle import Vehicle

#: Share of the weight that W - B is taken to be for a neutral vehicle: trimming in the field is not
#: much finer.
NEUTRAL = 0.01


@dataclass(frozen=True)
class Variant:
    """One number of a vehicle, moved."""

    what: str
    vehicles: tuple[Vehicle, ...] = ()


def variants(vehicle: Vehicle, share: float) -> tuple[Variant, ...]:
    """Move mass, added mass, W - B and r_G, one at a time."""
    return (*_masses(vehicle, share), _trim(vehicle, share), _center(vehicle, share))


def _masses(vehicle: Vehicle, share: float) -> tuple[Variant, ...]:
    added = vehicle.added_mass
    if added is None:
        return (_mass(vehicle, vehicle.mass_matrix, share, "mass and added mass"),)
    rigid = vehicle.mass_matrix - added
    return (_mass(vehicle, rigid, share, "mass"), _mass(vehicle, added, share, "added mass"))


def _mass(vehicle: Vehicle, part: FloatArray, share: float, name: str) -> Variant:
    if not part.any():
        return Variant(f"{name}: none, nothing to move")
    moved = tuple(_with_mass(vehicle, vehicle.mass_matrix + way * part) for way in _ways(share))
    return Variant(f"{name} ±{100.0 * share:g} %", moved)


def _trim(vehicle: Vehicle, share: float) -> Variant:
    net = vehicle.weight - vehicle.buoyancy
    step = share * (abs(net) or NEUTRAL * vehicle.weight)
    if not step or not np.any(vehicle.free[[2, 3, 4]]):
        return Variant("W - B: acts on no free axis, nothing to move")
    moved = (replace(vehicle, buoyancy=vehicle.buoyancy - way) for way in _ways(step))
    return Variant(f"W - B ±{step:.2g} N", tuple(moved))


def _center(vehicle: Vehicle, share: float) -> Variant:
    center = vehicle.center_of_gravity
    if not center.any():
        return Variant("r_G: at the origin, nothing to move")
    coupling = np.zeros((6, 6))
    if vehicle.added_mass is not None:
        rigid = vehicle.mass_matrix - vehicle.added_mass
        coupling[:3, 3:], coupling[3:, :3] = rigid[:3, 3:], rigid[3:, :3]
    moved = tuple(
        replace(
            _with_mass(vehicle, vehicle.mass_matrix + way * coupling),
            center_of_gravity=(1.0 + way) * center,
        )
        for way in _ways(share)
    )
    return Variant(f"r_G ±{100.0 * share:g} %", moved)


def _ways(step: float) -> tuple[float, float]:
    return -step, step


def _with_mass(vehicle: Vehicle, mass_matrix: FloatArray) -> Vehicle:
    """Another mass matrix; which part of it is added mass is no longer of interest."""
    return replace(vehicle, mass_matrix=mass_matrix, added_mass=None)

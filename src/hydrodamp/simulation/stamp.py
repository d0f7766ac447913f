"""What a damping says of the vehicle it belongs to."""

from __future__ import annotations

from hydrodamp.models.damping import VehicleStamp
from hydrodamp.vehicle.vehicle import Vehicle, mass_matrix_digest


def stamp(vehicle: Vehicle) -> VehicleStamp:
    """Return what a damping file says of the vehicle it belongs to."""
    return VehicleStamp(
        name=vehicle.name,
        weight=vehicle.weight,
        buoyancy=vehicle.buoyancy,
        mass_matrix_digest=mass_matrix_digest(vehicle.mass_matrix),
    )

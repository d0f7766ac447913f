"""Whether weight and buoyancy turn a vehicle upright."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hydrodamp.vehicle.vehicle import Vehicle

_MOTIONS = {"K": ("roll", "down_y"), "M": ("pitch", "down_x")}


def without_righting(vehicle: Vehicle) -> str:
    """Return what to say of a vehicle that nothing turns upright."""
    gravity, lift = float(vehicle.center_of_gravity[2]), float(vehicle.center_of_buoyancy[2])
    free = [axis for axis in _MOTIONS if axis in vehicle.axes]
    if not free or (gravity > lift and max(vehicle.weight, vehicle.buoyancy) > 0.0):
        return ""
    motions = " and ".join(_MOTIONS[axis][0] for axis in free)
    terms = ", ".join(f"{axis}: {_MOTIONS[axis][1]}" for axis in free)
    return (
        f"'{vehicle.name}' has no righting moment in {motions}: its center of gravity "
        f"(z {gravity:g} m) is not below its center of buoyancy (z {lift:g} m), and damping has to "
        "explain what turns the vehicle upright. Enter in the vehicle file by how much it is, "
        f"mostly millimetres to centimetres, or let it be fitted by `terms: {{{terms}}}` in a "
        "model file."
    )

"""Named vehicles, each number with its source in the file it comes from."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from hydrodamp.errors import FileError, HydrodampWarning, VehicleError, did_you_mean
from hydrodamp.files import Packaged, absent, neighbour
from hydrodamp.vehicle.file import parse_vehicle, read_vehicle
from hydrodamp.vehicle.vehicle import Vehicle

_MOTIONS = {"K": ("roll", "down_y"), "M": ("pitch", "down_x")}


def _read(name: str) -> Vehicle:
    return parse_vehicle(fleet_text(name), source=name)


fleet = Packaged(Path(__file__).parent / "fleet", _read)
"""The vehicles that come with the package."""


def fleet_text(name: str) -> str:
    """Return the file of a vehicle of the fleet, with the source of every number."""
    if name not in fleet:
        raise VehicleError(_unknown(name))
    return fleet.text(name)


def find_vehicle(name_or_path: str | os.PathLike[str]) -> Vehicle:
    """Return a vehicle of the fleet, or read a vehicle file.

    Parameters
    ----------
    name_or_path : str or path
        A name of the fleet, otherwise the path of a YAML file.

    Returns
    -------
    vehicle : Vehicle
        Checked.

    Raises
    ------
    VehicleError
        If it is neither a name nor a file, or the file's content cannot be.
    FileError
        If a file with such a path cannot be read, or is not there: with the nearest.

    Warns
    -----
    HydrodampWarning
        If the vehicle of a file is free in roll or pitch and nothing rights it.

    Examples
    --------
    >>> find_vehicle("lauv").weight
    176.58
    """
    if name_or_path in fleet:
        return fleet[str(name_or_path)]
    path = Path(name_or_path)
    if path.exists():
        vehicle = read_vehicle(path)
        if fault := without_righting(vehicle):
            warnings.warn(fault, HydrodampWarning, stacklevel=2)
        return vehicle
    if path.suffix or len(path.parts) > 1:
        raise FileError(absent(path))
    raise VehicleError(_unknown(str(name_or_path)))


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


def _unknown(name: str) -> str:
    meant = did_you_mean(name, fleet)
    if not meant and (near := neighbour(f"{name}.yaml")):
        meant = f" Did you mean '{near}'?"
    return (
        f"there is no vehicle `{name}`; the fleet has {', '.join(fleet)}.{meant} For your own "
        "vehicle give the path of its YAML file; `hydrodamp vehicle new` writes one to fill in."
    )

"""Named vehicles, each number with its source in the file it comes from."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path

from hydrodamp.errors import FileError, VehicleError, did_you_mean
from hydrodamp.vehicle.file import parse_vehicle, read_vehicle
from hydrodamp.vehicle.vehicle import Vehicle

NAMES = ("vt690", "remus100", "lauv", "bluerov2", "bluerov2-heavy")
"""The vehicles of the fleet."""


class Fleet(Mapping[str, Vehicle]):
    """The vehicles that come with the package, each read when first asked for.

    Raises
    ------
    VehicleError
        On ``fleet[name]`` for an unknown name, with the nearest known one.

    Examples
    --------
    >>> fleet["vt690"].buoyancy
    466.5
    """

    def __init__(self) -> None:
        self._read: dict[str, Vehicle] = {}

    def __getitem__(self, name: str) -> Vehicle:
        """Return one vehicle by name."""
        if name not in NAMES:
            raise VehicleError(_unknown(name))
        if name not in self._read:
            place = files("hydrodamp.vehicle").joinpath("fleet", f"{name}.yaml")
            self._read[name] = parse_vehicle(place.read_text(encoding="utf-8"), source=name)
        return self._read[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is such a vehicle, without reading it."""
        return name in NAMES

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names."""
        return iter(NAMES)

    def __len__(self) -> int:
        """Return the number of vehicles."""
        return len(NAMES)

    def __repr__(self) -> str:
        """Return the names."""
        return f"Fleet({', '.join(NAMES)})"


fleet = Fleet()
"""The vehicles that come with the package."""


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
        If a file with such a path cannot be read.

    Examples
    --------
    >>> find_vehicle("lauv").weight
    176.58
    """
    if name_or_path in fleet:
        return fleet[str(name_or_path)]
    path = Path(name_or_path)
    if path.exists():
        return read_vehicle(path)
    if path.suffix.lower() in (".yaml", ".yml") or len(path.parts) > 1:
        raise FileError(f"{path}: there is no such vehicle file")
    raise VehicleError(_unknown(str(name_or_path)))


def _unknown(name: str) -> str:
    return (
        f"there is no vehicle `{name}`; the fleet has {', '.join(NAMES)}."
        f"{did_you_mean(name, NAMES)} For your own vehicle give the path of its YAML file."
    )

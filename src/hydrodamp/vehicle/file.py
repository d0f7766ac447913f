"""The vehicle file: YAML both ways."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import VehicleError, list_faults
from hydrodamp.files import load_text, mistaken, parse_yaml, save_text
from hydrodamp.vehicle.actuation import Actuator
from hydrodamp.vehicle.fin import Fin
from hydrodamp.vehicle.mass import rigid_body_mass_matrix
from hydrodamp.vehicle.matrix import Matrix
from hydrodamp.vehicle.propeller import Propeller
from hydrodamp.vehicle.thruster import Thruster
from hydrodamp.vehicle.vehicle import Vehicle

KINDS: Mapping[str, type] = {
    "matrix": Matrix,
    "fin": Fin,
    "propeller": Propeller,
    "thruster": Thruster,
}
"""How a file calls the kinds of actuator."""


def read_vehicle(path: str | os.PathLike[str]) -> Vehicle:
    """Read a vehicle file.

    Parameters
    ----------
    path : path
        A YAML file.

    Returns
    -------
    vehicle : Vehicle
        Checked.

    Raises
    ------
    FileError
        If the file cannot be read or is no YAML; with the line.
    VehicleError
        If its content cannot be: every fault at once, with its key.

    Examples
    --------
    >>> read_vehicle("nowhere.yaml")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    hydrodamp.errors.FileError: nowhere.yaml: cannot be read: ...
    """
    return parse_vehicle(load_text(path), source=str(path))


def parse_vehicle(text: str, *, source: str = "vehicle") -> Vehicle:
    """Read a vehicle from the text of a vehicle file."""
    from pydantic import ValidationError

    from hydrodamp.vehicle.faults import faults_of
    from hydrodamp.vehicle.schema import VehicleEntry

    content = parse_yaml(text, source)
    if not isinstance(content, dict):
        got = "it is empty" if content is None else f"got {_called(content)}"
        raise VehicleError(
            f"{source}: a vehicle file must be keys and values, such as 'name: mine'; {got}"
        )
    if other := mistaken(content, source, "vehicle"):
        raise VehicleError(other)
    try:
        entry = VehicleEntry.model_validate(content)
    except ValidationError as error:
        raise VehicleError(list_faults(source, faults_of(error))) from error
    faults: list[str] = []
    actuators = [_actuator(i, one.model_dump(), faults) for i, one in enumerate(entry.actuators)]
    made = tuple(one for one in actuators if one is not None)
    vehicle = _vehicle(entry.model_dump(exclude={"actuators"}), made, faults)
    if vehicle is None or faults:
        raise VehicleError(list_faults(source, faults))
    return vehicle


def write_vehicle(vehicle: Vehicle, path: str | os.PathLike[str]) -> None:
    """Write a vehicle file that reads back as the same vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        Any vehicle.
    path : path
        Where to; an existing file is replaced at once or not at all.

    Raises
    ------
    FileError
        If the file cannot be written.
    """
    save_text(format_vehicle(vehicle), path)


def format_vehicle(vehicle: Vehicle) -> str:
    """Return the text of a vehicle file."""
    import yaml

    content = {
        "name": vehicle.name,
        "source": vehicle.source,
        "note": vehicle.note,
        "axes": list(vehicle.axes),
        "mass_matrix": _lists(vehicle.mass_matrix),
        "added_mass": None if vehicle.added_mass is None else _lists(vehicle.added_mass),
        "weight": vehicle.weight,
        "buoyancy": vehicle.buoyancy,
        "center_of_gravity": _lists(vehicle.center_of_gravity),
        "center_of_buoyancy": _lists(vehicle.center_of_buoyancy),
        "actuators": [_entry(actuator) for actuator in vehicle.actuators],
    }
    kept = {key: value for key, value in content.items() if value not in (None, "")}
    return str(yaml.safe_dump(kept, sort_keys=False, allow_unicode=True, default_flow_style=None))


def _called(content: object) -> str:
    return "a list" if isinstance(content, list) else repr(content)[:60]


def _actuator(index: int, entry: dict[str, Any], faults: list[str]) -> Actuator | None:
    kind = KINDS[entry.pop("kind")]
    try:
        actuator: Actuator = kind(**entry)
    except VehicleError as error:
        faults.append(f"actuators[{index}]: {error}")
        return None
    return actuator


def _vehicle(
    entry: dict[str, Any], actuators: tuple[Actuator, ...], faults: list[str]
) -> Vehicle | None:
    rigid, added = entry.pop("rigid_body"), entry["added_mass"]
    try:
        if rigid is not None:
            body = rigid_body_mass_matrix(**rigid, center_of_gravity=entry["center_of_gravity"])
            entry["mass_matrix"] = body + np.array(added)
        return Vehicle(**{**entry, "axes": tuple(entry["axes"])}, actuators=actuators)
    except VehicleError as error:
        faults.append(str(error))
        return None


def _entry(actuator: Actuator) -> dict[str, Any]:
    kind = next(name for name, made in KINDS.items() if type(actuator) is made)
    entry: dict[str, Any] = {"kind": kind}
    for field in fields(KINDS[kind]):
        value = getattr(actuator, field.name)
        if field.name in ("force", "drag"):
            value = dict(value)
        if value != field.default and value != {}:
            entry[field.name] = _plain(value)
    return entry


def _plain(value: Any) -> Any:
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def _lists(values: FloatArray) -> Any:
    return np.asarray(values).tolist()

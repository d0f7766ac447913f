"""Vehicle files: YAML both ways, a template to fill in, and the fleet that comes along."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from hydrodamp import files as files
from hydrodamp.arrays import MAX_MAGNITUDE
from hydrodamp.errors import FileError, HydrodampWarning, VehicleError, did_you_mean
from hydrodamp.faults import validate
from hydrodamp.vehicle.actuators import Actuator
from hydrodamp.vehicle.mass import fill_locked_axes, rigid_body_mass_matrix
from hydrodamp.vehicle.vehicle import Vehicle, checked_axes, without_righting

KINDS: Mapping[str, type] = {kind.__name__.lower(): kind for kind in get_args(Actuator)}

Number = Annotated[
    float, Field(strict=True, allow_inf_nan=False, ge=-MAX_MAGNITUDE, le=MAX_MAGNITUDE)
]
AxisName = Literal["X", "Y", "Z", "K", "M", "N"]
Vector = Annotated[list[Number], Field(min_length=3, max_length=3)]
Six = Annotated[list[Number], Field(min_length=6, max_length=6)]
SixBySix = Annotated[list[Six], Field(min_length=6, max_length=6)]


def _inertia_form(given: object) -> str:
    rows = isinstance(given, list) and any(isinstance(row, list) for row in given)
    return "tensor" if rows else "moments"


Inertia = Annotated[
    Annotated[Vector, Tag("moments")]
    | Annotated[list[Vector], Field(min_length=3, max_length=3), Tag("tensor")],
    Discriminator(_inertia_form),
]


def _actuator(given: object) -> object:
    """Return the actuator of an entry; errors are predicates of a sentence."""
    if not isinstance(given, Mapping):
        raise ValueError(f"must be a table; got {given!r}")
    entry = dict(given)
    kind = KINDS.get(str(entry.pop("kind", None)))
    if kind is None:
        raise ValueError(f"needs a `kind` of {', '.join(KINDS)}; got {given.get('kind')!r}")
    known = {field.name: field for field in fields(kind)}
    unknown = (key for key in entry if key not in known)
    faults = [f"It has no `{key}`.{did_you_mean(str(key), known)}" for key in unknown]
    faults += [
        f"It lacks `{name}`."
        for name, field in known.items()
        if field.default is MISSING and entry.get(name) is None
    ]
    if faults:
        raise ValueError(f"cannot be a {given['kind']}. {' '.join(faults)}")
    try:
        return kind(**{name: value for name, value in entry.items() if value is not None})
    except TypeError as error:
        raise ValueError(f"has a value of the wrong kind: {error}") from error


class RigidBody(BaseModel):
    """Mass and inertia, from which the rigid-body matrix is made."""

    model_config = ConfigDict(extra="forbid")

    mass: Annotated[Number, Field(gt=0)]
    inertia: Inertia
    inertia_about: Literal["origin", "center_of_gravity"] = "origin"


class VehicleFile(BaseModel):
    """A whole vehicle file."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)

    name: str
    source: str = ""
    note: str = ""
    mass_matrix: list[list[Number]] | None = None
    rigid_body: RigidBody | None = None
    added_mass: SixBySix | None = None
    weight: Annotated[Number, Field(ge=0)]
    buoyancy: Annotated[Number, Field(ge=0)]
    center_of_gravity: Vector = [0.0, 0.0, 0.0]
    center_of_buoyancy: Vector = [0.0, 0.0, 0.0]
    axes: Annotated[list[AxisName], AfterValidator(checked_axes)] = ["X", "Y", "Z", "K", "M", "N"]
    actuators: list[Annotated[Any, BeforeValidator(_actuator)]] = []
    estimate: list[
        Literal["added_mass", "center_of_gravity", "buoyancy", "gains", "thrust_curve", "fin_curve"]
    ] = []
    std: dict[str, Any] = {}
    origin: dict[str, str] = {}
    wrench_gain: Six = [1.0] * 6

    @model_validator(mode="before")
    @classmethod
    def _zero_where_locked(cls, content: Any) -> Any:
        return fill_locked_axes(content)

    @model_validator(mode="after")
    def _one_mass_matrix(self) -> VehicleFile:
        if (self.mass_matrix is None) == (self.rigid_body is None):
            got = "neither" if self.rigid_body is None else "both"
            raise ValueError(f"the file needs either `mass_matrix` or `rigid_body`; got {got}")
        if self.rigid_body is not None and self.added_mass is None:
            raise ValueError("`rigid_body` needs `added_mass`, 6 x 6 and positive")
        return self

    def vehicle(self) -> Vehicle:
        """Return the vehicle that the file describes."""
        mass = self.mass_matrix
        if self.rigid_body is not None:
            body = self.rigid_body.model_dump()
            rigid = rigid_body_mass_matrix(**body, center_of_gravity=self.center_of_gravity)
            mass = (rigid + np.array(self.added_mass)).tolist()
        words = self.model_dump(
            exclude={"mass_matrix", "rigid_body", "axes", "actuators", "estimate"}
        )
        return Vehicle(
            **words,
            mass_matrix=np.array(mass),
            axes=tuple(self.axes),
            actuators=tuple(self.actuators),
            estimate=tuple(self.estimate),
        )


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
    return parse_vehicle(files.load_text(path), source=str(path))


def parse_vehicle(text: str, *, source: str = "vehicle") -> Vehicle:
    """Read a vehicle from the text of a vehicle file."""
    return build_vehicle(files.parse_yaml(text, source), source)


def build_vehicle(content: object, source: str) -> Vehicle:
    """Return the vehicle of the content of a vehicle file."""
    if not isinstance(content, dict):
        kind = "a list" if isinstance(content, list) else repr(content)[:60]
        got = "it is empty" if content is None else f"got {kind}"
        raise VehicleError(
            f"{source}: a vehicle file must be keys and values, such as 'name: mine'; {got}"
        )
    if message := files.wrong_kind_message(content, source, "vehicle"):
        raise VehicleError(message)
    document = validate(VehicleFile, content, source, VehicleError)
    try:
        return document.vehicle()
    except VehicleError as error:
        raise VehicleError(f"{source}: {error}") from error


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
    files.save_text(format_vehicle(vehicle), path)


def format_vehicle(vehicle: Vehicle) -> str:
    """Return the text of a vehicle file."""
    import yaml

    entry = vehicle_entry(vehicle)
    return str(yaml.safe_dump(entry, sort_keys=False, allow_unicode=True, default_flow_style=None))


def vehicle_entry(thing: Vehicle | Actuator) -> dict[str, Any]:
    """Return a vehicle or an actuator as in its file, without what goes without saying."""
    kind = type(thing).__name__.lower()
    entry: dict[str, Any] = {"kind": kind} if isinstance(thing, Actuator) else {}
    for field in fields(thing):
        value = getattr(thing, field.name)
        plain = _plain(dict(value) if field.name in ("force", "drag") else value)
        default = field.default if field.default_factory is MISSING else field.default_factory()
        if plain != _plain(default):
            entry[field.name] = plain
    return entry


def _plain(value: Any) -> Any:
    if isinstance(value, Actuator):
        return vehicle_entry(value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


fleet = files.PackageData(
    Path(__file__).parent / "fleet", lambda name: parse_vehicle(fleet_text(name), source=name)
)
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
        raise FileError(files.missing_file_message(path))
    raise VehicleError(_unknown(str(name_or_path)))


def _unknown(name: str) -> str:
    suggestion = files.nearest_file(f"{name}.yaml") or did_you_mean(name, fleet)
    return (
        f"there is no vehicle `{name}`; the fleet has {', '.join(fleet)}.{suggestion} For your own "
        "vehicle give the path of its YAML file; `hydrodamp vehicle new` writes one to fill in."
    )

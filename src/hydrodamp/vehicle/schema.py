"""The form of a vehicle file, checked key by key."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from hydrodamp.errors import did_you_mean

AxisName = Literal["X", "Y", "Z", "K", "M", "N"]
Vector = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
Six = Annotated[list[FiniteFloat], Field(min_length=6, max_length=6)]
SixBySix = Annotated[list[Six], Field(min_length=6, max_length=6)]
Pair = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class MatrixEntry(_Strict):
    """Commands times a table."""

    kind: Literal["matrix"]
    commands: list[str]
    wrench: list[Six]


class FinEntry(_Strict):
    """A control surface."""

    kind: Literal["fin"]
    command: str
    force: dict[AxisName, FiniteFloat]
    drag: dict[AxisName, FiniteFloat] = Field(default_factory=dict)
    limit: FiniteFloat | None = None
    name: str = ""


class PropellerEntry(_Strict):
    """A propeller on the x axis."""

    kind: Literal["propeller"]
    command: str
    thrust: FiniteFloat
    advance: FiniteFloat = 0.0
    torque: FiniteFloat = 0.0
    speed_slope: FiniteFloat | None = None
    speed_offset: FiniteFloat = 0.0
    limit: FiniteFloat | None = None
    name: str = ""


class ThrusterEntry(_Strict):
    """A thruster at a place."""

    kind: Literal["thruster"]
    command: str
    position: Vector
    direction: Vector
    gain: FiniteFloat | None = None
    curve: list[Pair] | None = None
    dead_zone: Pair | None = None
    limit: FiniteFloat | None = None
    name: str = ""


ActuatorEntry = Annotated[
    MatrixEntry | FinEntry | PropellerEntry | ThrusterEntry, Field(discriminator="kind")
]


class RigidBodyEntry(_Strict):
    """Mass and inertia, from which the rigid-body matrix is made."""

    mass: Annotated[FiniteFloat, Field(gt=0)]
    inertia: Vector | Annotated[list[Vector], Field(min_length=3, max_length=3)]
    inertia_about: Literal["origin", "center_of_gravity"] = "origin"


class VehicleEntry(_Strict):
    """A whole vehicle file."""

    name: str
    source: str = ""
    note: str = ""
    mass_matrix: list[list[FiniteFloat]] | None = None
    rigid_body: RigidBodyEntry | None = None
    added_mass: SixBySix | None = None
    weight: Annotated[FiniteFloat, Field(ge=0)]
    buoyancy: Annotated[FiniteFloat, Field(ge=0)]
    center_of_gravity: Vector = [0.0, 0.0, 0.0]
    center_of_buoyancy: Vector = [0.0, 0.0, 0.0]
    axes: list[AxisName] = ["X", "Y", "Z", "K", "M", "N"]
    actuators: list[ActuatorEntry] = []

    @model_validator(mode="before")
    @classmethod
    def _weight_where_it_acts(cls, content: Any) -> Any:
        """Let a level vehicle with no free Z, K or M go without weight and buoyancy."""
        if isinstance(content, dict) and isinstance(content.get("axes"), list):
            upright = not {"Z", "K", "M"} & {str(axis) for axis in content["axes"]}
            return {"weight": 0.0, "buoyancy": 0.0, **content} if upright else content
        return content

    @model_validator(mode="after")
    def _one_mass_matrix(self) -> VehicleEntry:
        if (self.mass_matrix is None) == (self.rigid_body is None):
            raise ValueError("needs either `mass_matrix` or `rigid_body`; got both or neither")
        if self.rigid_body is not None and self.added_mass is None:
            raise ValueError("`rigid_body` needs `added_mass`, 6 x 6 and positive, beside it")
        return self


def faults_of(error: ValidationError) -> list[str]:
    """Return the faults of a vehicle file, one sentence each.

    Parameters
    ----------
    error : ValidationError
        What pydantic found.

    Returns
    -------
    faults : list of str
        Key path, what is required, what was got.

    Examples
    --------
    >>> try:
    ...     RigidBodyEntry.model_validate({"mass": -1, "inertia": [1, 1, 1]})
    ... except ValidationError as error:
    ...     faults_of(error)
    ['`mass` must be greater than 0; got -1']
    """
    return list(dict.fromkeys(_sentences(error)))


def _sentences(error: ValidationError) -> Iterator[str]:
    for fault in error.errors(include_url=False):
        path = _path(fault["loc"])
        kind, given = fault["type"], fault.get("input")
        if kind == "missing":
            yield f"`{path}` is missing"
        elif kind == "extra_forbidden":
            yield f"`{path}` is no key of a vehicle file.{_nearest(fault['loc'])}"
        elif kind == "value_error":
            yield f"{path + ' ' if path else 'the file '}{fault['ctx']['error']}"
        elif given is None:
            yield f"`{path}` is still empty: fill it in"
        else:
            wanted = fault["msg"].removeprefix("Input should be ").removeprefix("Input ")
            yield f"`{path}` must be {wanted}; got {_short(given)}"


def _path(loc: tuple[str | int, ...]) -> str:
    kinds = {"matrix", "fin", "propeller", "thruster"}
    parts: list[str] = []
    for part in loc:
        if isinstance(part, int):
            parts[-1] += f"[{part}]"
        elif "[" not in part and not (
            part in kinds and parts and parts[-1].startswith("actuators[")
        ):
            parts.append(part)
    return ".".join(parts)


def _nearest(loc: tuple[str | int, ...]) -> str:
    forms: dict[str | int, type[BaseModel]] = {
        "rigid_body": RigidBodyEntry,
        "matrix": MatrixEntry,
        "fin": FinEntry,
        "propeller": PropellerEntry,
        "thruster": ThrusterEntry,
    }
    form = forms.get(loc[-2], VehicleEntry) if len(loc) > 1 else VehicleEntry
    return did_you_mean(str(loc[-1]), form.model_fields)


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."

"""The form of a vehicle file, checked key by key."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    Tag,
    model_validator,
)

from hydrodamp.vehicle.unneeded import without_unneeded

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
    dead_zone: Pair | None = None
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
    dead_zone: Pair | None = None
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


def _inertia_form(given: object) -> str:
    rows = isinstance(given, list) and any(isinstance(row, list) for row in given)
    return "tensor" if rows else "moments"


Inertia = Annotated[
    Annotated[Vector, Tag("moments")]
    | Annotated[list[Vector], Field(min_length=3, max_length=3), Tag("tensor")],
    Discriminator(_inertia_form),
]


class RigidBodyEntry(_Strict):
    """Mass and inertia, from which the rigid-body matrix is made."""

    mass: Annotated[FiniteFloat, Field(gt=0)]
    inertia: Inertia
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
    def _zero_where_locked(cls, content: Any) -> Any:
        """Let what the free axes do not need stay empty."""
        return without_unneeded(content) if isinstance(content, dict) else content

    @model_validator(mode="after")
    def _one_mass_matrix(self) -> VehicleEntry:
        if (self.mass_matrix is None) == (self.rigid_body is None):
            got = "neither" if self.rigid_body is None else "both"
            raise ValueError(f"needs either `mass_matrix` or `rigid_body`; got {got}")
        if self.rigid_body is not None and self.added_mass is None:
            raise ValueError("`rigid_body` needs `added_mass`, 6 x 6 and positive, beside it")
        return self

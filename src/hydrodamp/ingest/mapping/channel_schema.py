"""Schema of the channels of a mapping: columns, alternatives, units, constants."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    StrictBool,
    StrictStr,
    model_validator,
)

from hydrodamp.data.channels import ATTITUDE, BLOCKS, EULER, POSITION, VELOCITY, unit_factor

#: Value of `time` for topics with a recorded time.
RECORDED_TIME = "recorded"

#: Velocity components in world axes; rotation to body axes needs the attitude.
WORLD_DIRECTIONS = ("north", "east", "down", "up")

#: Speed along the path and its direction over ground, clockwise from north.
PATH_VELOCITY = ("speed", "course")

#: Position on the ellipsoid, in degrees unless a unit is stated.
GEOGRAPHIC = ("latitude", "longitude")
COORDINATES = tuple(f"position.{name}" for name in GEOGRAPHIC)

#: Aliases of the down component, and their sign.
VERTICAL_ALIASES = {"up": ("down", -1.0), "depth": ("down", 1.0)}

_EXTRA_CHANNELS = {
    ATTITUDE.name: dict.fromkeys((*EULER, "heading"), "angle"),
    VELOCITY.name: {**dict.fromkeys((*WORLD_DIRECTIONS, "speed"), "speed"), "course": "angle"},
    POSITION.name: {
        **dict.fromkeys(VERTICAL_ALIASES, "length"),
        **dict.fromkeys(GEOGRAPHIC, "geographic angle"),
    },
}

#: Channels of each group and their quantities; commands are named by the user.
CHANNEL_GROUPS: dict[str, dict[str, str]] = {
    block.name: {**block.quantities, **_EXTRA_CHANNELS.get(block.name, {})}
    for block in BLOCKS
    if block.shape
}

#: Channels without a group.
SINGLE_CHANNELS = {
    name: what for block in BLOCKS if not block.shape for name, what in block.quantities.items()
}


def quantity_of(group: str, name: str) -> str | None:
    """Return the quantity of a channel; None if any is allowed."""
    return SINGLE_CHANNELS.get(group) or CHANNEL_GROUPS.get(group, {}).get(name)


Axes = Literal["FRD", "FLU"]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def table_from_name(
    table: Callable[[str], dict[str, Any]], wanted: str, kind: Any = dict
) -> BeforeValidator:
    """Return a validator that expands a bare name to its table."""

    def expand(given: object) -> object:
        if isinstance(given, str):
            return table(given)
        if isinstance(given, dict | BaseModel):
            return given
        raise ValueError(f"must {wanted}; got {given!r}")

    return BeforeValidator(expand, json_schema_input_type=str | kind)


_FIELD_VALUES = table_from_name(
    lambda name: {name: None},
    "be the name of a field, or a table of fields and values",
    dict[str, float],
)


class Direction(Strict):
    """Column of an angle from the bow, clockwise."""

    column: StrictStr
    unit: str | None = None

    @model_validator(mode="after")
    def _check_unit(self) -> Self:
        if self.unit is not None:
            unit_factor(self.unit, "angle")
        return self


_DIRECTION_BY_NAME = table_from_name(lambda name: {"column": name}, "name a column", Direction)


class Source(Strict):
    """A column of a log and the conversion of its numbers; or a constant value."""

    column: StrictStr = ""
    value: FiniteFloat | None = None
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = None
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: FiniteFloat = 1.0
    offset: FiniteFloat = 0.0
    plus: dict[str, FiniteFloat] = Field({})
    direction: Annotated[Direction, _DIRECTION_BY_NAME] | None = None
    along: Literal["x", "y"] | None = None
    hold: StrictBool | None = None
    delay: FiniteFloat = 0.0
    where: Annotated[dict[str, FiniteFloat | None], _FIELD_VALUES] = Field({})
    optional: StrictBool = False

    @model_validator(mode="after")
    def _check_source(self) -> Self:
        if self.value is None and not self.column and self.rate is None:
            raise ValueError("must have a `column` or a `value`")
        if self.rate is not None and self.model_fields_set != {"rate"}:
            raise ValueError("allows no other key with `rate`")
        if self.value is not None and not self.model_fields_set <= {"value", "unit", "sign"}:
            raise ValueError("allows only `unit` and `sign` with `value`")
        if (self.direction is None) != (self.along is None):
            raise ValueError("needs both `direction` and `along`, or neither")
        return self

    @property
    def further_columns(self) -> tuple[str, ...]:
        """The columns of the same topic that it needs besides its own."""
        angle = () if self.direction is None else (self.direction.column,)
        return (*self.where, *self.plus, *angle)


def _as_choices(given: object) -> object:
    if given == []:
        raise ValueError("must be a list of at least one column; got []")
    return given if isinstance(given, list) else [given]


def check_units(choices: tuple[Source, ...], quantity: str) -> tuple[Source, ...]:
    for source in choices:
        if source.unit is not None:
            unit_factor(source.unit, quantity)
    return choices


_SourceInput = str | Source

#: A column, a source table, or a list of alternatives; the first one in the log is used.
Channel = Annotated[
    tuple[Annotated[Source, table_from_name(lambda name: {"column": name}, "name a column")], ...],
    BeforeValidator(_as_choices, json_schema_input_type=_SourceInput | list[_SourceInput]),
]


class Entry(NamedTuple):
    """A channel of a mapping; ``sign`` is -1 for an alias such as ``up`` of ``down``."""

    group: str
    name: str
    choices: tuple[Source, ...]
    quantity: str | None = None
    sign: float = 1.0

    @property
    def column(self) -> str:
        """Column of the first choice."""
        return self.choices[0].column

    @property
    def default_unit(self) -> str:
        """Unit of numbers whose unit neither file nor mapping states; empty for SI."""
        return "deg" if self.name in GEOGRAPHIC else ""

    @property
    def channel(self) -> str:
        """Full name of the channel: ``group.name``."""
        return f"{self.group}.{self.name}"


class Quaternion(Strict):
    """Quaternion of one message: an array, or four fields."""

    column: StrictStr
    order: Literal["wxyz", "xyzw"] | None = None

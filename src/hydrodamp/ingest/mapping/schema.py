"""Schema of mapping files: pydantic models for validation, values and JSON Schema."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, Self

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    PrivateAttr,
    StrictBool,
    StrictStr,
    create_model,
    model_validator,
)

from hydrodamp.basis.term import check_command_name
from hydrodamp.conditioning.pipeline import Step, parse_steps
from hydrodamp.data.channels import (
    ATTITUDE,
    BLOCKS,
    EULER,
    POSITION,
    RESERVED,
    VELOCITY,
    unit_factor,
)
from hydrodamp.errors import LogError

#: Value of `time` for topics with a recorded time.
RECORDED_TIME = "recorded"

#: Velocity components in world axes; rotation to body axes needs the attitude.
WORLD_DIRECTIONS = ("north", "east", "down", "up")

#: Aliases of the down component, and their sign.
VERTICAL_ALIASES = {"up": ("down", -1.0), "depth": ("down", 1.0)}

_EXTRA_CHANNELS = {
    ATTITUDE.name: dict.fromkeys((*EULER, "heading"), "angle"),
    VELOCITY.name: dict.fromkeys(WORLD_DIRECTIONS, "speed"),
    POSITION.name: dict.fromkeys(VERTICAL_ALIASES, "length"),
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


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def _table_from_name(
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


_FIELD_VALUES = _table_from_name(
    lambda name: {name: None},
    "be the name of a field, or a table of fields and values",
    dict[str, float],
)


class Source(_Strict):
    """A column of a log and the conversion of its numbers; or a constant value."""

    column: StrictStr = ""
    value: FiniteFloat | None = None
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = None
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: FiniteFloat = 1.0
    offset: FiniteFloat = 0.0
    plus: dict[str, FiniteFloat] = Field({})
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
        return self


def _as_choices(given: object) -> object:
    if given == []:
        raise ValueError("must be a list of at least one column; got []")
    return given if isinstance(given, list) else [given]


def _check_units(choices: tuple[Source, ...], quantity: str) -> tuple[Source, ...]:
    for source in choices:
        if source.unit is not None:
            unit_factor(source.unit, quantity)
    return choices


_SourceInput = str | Source

#: A column, a source table, or a list of alternatives; the first one in the log is used.
Channel = Annotated[
    tuple[Annotated[Source, _table_from_name(lambda name: {"column": name}, "name a column")], ...],
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
    def channel(self) -> str:
        """Full name of the channel: ``group.name``."""
        return f"{self.group}.{self.name}"


class Quaternion(_Strict):
    """Quaternion of one message: an array, or four fields."""

    column: StrictStr
    order: Literal["wxyz", "xyzw"] | None = None


def _entries(group: str, channels: Iterable[tuple[str, Any]]) -> Iterator[Entry]:
    for name, channel in channels:
        if isinstance(channel, Quaternion):
            for axis in "wxyz":
                suffix = f".{axis}" if channel.order is None else f"[{channel.order.index(axis)}]"
                source = Source(column=f"{channel.column}{suffix}")
                yield Entry(group, f"q{axis}", (source,), "ratio")
        else:
            axis, sign = VERTICAL_ALIASES.get(name, (name, 1.0))
            yield Entry(group, axis, channel, quantity_of(group, name), sign)


def _channel_field(quantity: str) -> tuple[Any, Any]:
    """Return the model field of an optional channel with a check of its unit."""
    kind = Annotated[Channel, AfterValidator(partial(_check_units, quantity=quantity))] | None
    return kind, Field(None, description=quantity)


def _group_model(name: str, channels: dict[str, str]) -> type[_Strict]:
    """Return the model of a group, with one field per channel."""
    fields: dict[str, Any] = {name: _channel_field(quantity) for name, quantity in channels.items()}
    if name == "attitude":
        fields["quaternion"] = (Quaternion | None, None)
    return create_model(name.capitalize(), __base__=_Strict, **fields)


class Rotation(_Strict):
    """Mounting angles of a sensor relative to the body."""

    roll: FiniteFloat = 0.0
    pitch: FiniteFloat = 0.0
    yaw: FiniteFloat = 0.0
    unit: Literal["deg", "rad"] = "deg"


class Sensor(_Strict):
    """Axes, mounting angles and position of a sensor in the vehicle."""

    axes: Axes | None = None
    rotation: Rotation = Rotation()
    position: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] = [0.0, 0.0, 0.0]


class Sensors(_Strict):
    """Sensors of the channel groups."""

    velocity: Sensor = Sensor()
    rates: Sensor = Sensor()
    attitude: Sensor = Sensor()
    specific_force: Sensor = Sensor()


class Clock(_Strict):
    """Reference clock to which all channels are resampled."""

    topic: StrictStr | None = None
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = None


def _check_command_name(name: str) -> str:
    if name in RESERVED:
        raise ValueError("is the reserved name of another channel; rename the command")
    check_command_name(name)
    return name


def _parse_steps(given: object) -> tuple[Step, ...]:
    if not isinstance(given, list):
        raise ValueError(f"must be a list; got {given!r}")
    steps, faults = parse_steps(given)
    if faults:
        raise LogError(faults)
    return steps


def commands_by_name(commands: Any) -> Any:
    """Expand a list of commands to a table."""
    return {name: name for name in commands} if isinstance(commands, list) else commands


if TYPE_CHECKING:

    class _Channels(_Strict):
        time: Channel

else:
    _Channels = create_model(
        "_Channels",
        __base__=_Strict,
        **{
            name: (_group_model(name, channels) | None, None)
            for name, channels in CHANNEL_GROUPS.items()
        },
        **{name: _channel_field(quantity) for name, quantity in SINGLE_CHANNELS.items()},
    )


_ALTERNATIVES = BeforeValidator(
    lambda given: [given] if isinstance(given, str) else given,
    json_schema_input_type=str | list[str],
)
_CLOCK_OF_TOPIC = _table_from_name(
    lambda name: {"topic": name}, "be a topic, or a table of `topic` or `rate`", Clock
)
_COMMANDS_BY_NAME = BeforeValidator(
    commands_by_name, json_schema_input_type=dict[str, Channel] | list[str]
)
_STEPS = BeforeValidator(_parse_steps, json_schema_input_type=list[str | dict[str, Any]])


class MappingFile(_Channels):
    """Mapping file: assignment of columns to channels, with units, axes and clocks."""

    extends: str | list[str] = Field([])
    source: str | None = None
    note: str | None = None
    topics: dict[str, Annotated[tuple[str, ...], _ALTERNATIVES]] = Field({})
    files: dict[str, StrictStr] = Field({})
    frame: Axes = "FRD"
    world: Literal["NED", "NWU", "ENU"] = "NED"
    clock: Annotated[Clock, _CLOCK_OF_TOPIC] = Clock()
    segment: StrictStr | None = None
    commands: Annotated[
        dict[Annotated[str, AfterValidator(_check_command_name)], Channel], _COMMANDS_BY_NAME
    ] = Field({})
    sensors: Sensors = Sensors()
    steps: Annotated[tuple[Step, ...], _STEPS] = ()

    _name: str = PrivateAttr("mapping")

    @property
    def name(self) -> str:
        """Name of the mapping in messages."""
        return self._name

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """All channels, one entry each."""
        channels = SINGLE_CHANNELS.items()
        entries = [Entry(name, name, getattr(self, name), what) for name, what in channels]
        for group in CHANNEL_GROUPS:
            entries += _entries(group, getattr(self, group) or ())
        entries += [Entry("commands", name, choices) for name, choices in self.commands.items()]
        return tuple(entry for entry in entries if entry.choices)

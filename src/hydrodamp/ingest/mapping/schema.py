"""Schema of mapping files: pydantic models for validation, values and JSON Schema."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
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
from hydrodamp.data.channels import ATTITUDE, BLOCKS, EULER, POSITION, RESERVED, VELOCITY
from hydrodamp.data.units import unit_factor
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


class Source(_Strict):
    """A column of a log and the conversion of its numbers; or a constant value."""

    column: StrictStr = Field("", description="topic.field, or the column of a table")
    value: FiniteFloat | None = Field(None, description="constant value, instead of a column")
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = Field(
        None, description="of `time`, instead of a column: sampling rate [Hz]"
    )
    unit: str | None = Field(None, description="unit after scale and offset")
    sign: Literal[1, -1] = Field(1, description="applied before rotation of axes")
    scale: FiniteFloat = Field(1.0, description="value = scale * number + offset")
    offset: FiniteFloat = 0.0
    plus: dict[str, FiniteFloat] = Field(
        {}, description="columns of the same topic to add, and weights"
    )
    hold: StrictBool | None = Field(
        None, description="sample and hold; false interpolates a command"
    )
    delay: FiniteFloat = Field(0.0, description="from measurement to timestamp [s]")
    where: Annotated[
        dict[str, FiniteFloat | None],
        _table_from_name(
            lambda name: {name: None},
            "be the name of a field, or a table of fields and values",
            dict[str, float],
        ),
    ] = Field({}, description="use only rows where this field is nonzero, or has this value")
    optional: StrictBool = Field(False, description="if true, the log may lack this column")

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


def _unit_check(quantity: str | None) -> Callable[[tuple[Source, ...]], tuple[Source, ...]]:
    def check(choices: tuple[Source, ...]) -> tuple[Source, ...]:
        for source in choices:
            if source.unit is not None:
                unit_factor(source.unit, quantity)
        return choices

    return check


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

    column: StrictStr = Field(description="prefix of [0] ... [3], or of .w .x .y .z")
    order: Literal["wxyz", "xyzw"] | None = Field(
        None, description="of an array; without it, fields are named w x y z"
    )

    def components(self) -> Iterator[tuple[str, Source]]:
        """Yield name and source of each component."""
        for component in "wxyz":
            suffix = f".{component}" if self.order is None else f"[{self.order.index(component)}]"
            yield f"q{component}", Source(column=f"{self.column}{suffix}")


def _entries(group: str, channels: Iterable[tuple[str, Any]]) -> Iterator[Entry]:
    for name, channel in channels:
        if isinstance(channel, Quaternion):
            for component, source in channel.components():
                yield Entry(group, component, (source,), "ratio")
        else:
            axis, sign = VERTICAL_ALIASES.get(name, (name, 1.0))
            yield Entry(group, axis, channel, quantity_of(group, name), sign)


def _channel_field(quantity: str) -> tuple[Any, Any]:
    """Return the model field of an optional channel with a check of its unit."""
    kind = Annotated[Channel, AfterValidator(_unit_check(quantity))] | None
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

    axes: Axes | None = Field(None, description="axes of the sensor; default: `frame`")
    rotation: Rotation = Field(
        Rotation(), description="body to sensor axes: yaw, then pitch, then roll"
    )
    position: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] = Field(
        [0.0, 0.0, 0.0], description="of the sensor from the reference point, body axes [m]"
    )


class Sensors(_Strict):
    """Sensors of the channel groups."""

    velocity: Sensor = Sensor()
    rates: Sensor = Sensor()
    attitude: Sensor = Sensor()
    specific_force: Sensor = Sensor()


class Clock(_Strict):
    """Reference clock to which all channels are resampled."""

    topic: StrictStr | None = None
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = Field(None, description="[Hz]")


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


class MappingFile(_Channels):
    """Mapping file: assignment of columns to channels, with units, axes and clocks."""

    extends: str | list[str] = Field(
        [], description="presets or mapping files that this file overrides"
    )
    source: str | None = Field(None, description="origin of the mapping")
    note: str | None = None
    topics: dict[
        str,
        Annotated[
            tuple[str, ...],
            BeforeValidator(
                lambda given: [given] if isinstance(given, str) else given,
                json_schema_input_type=str | list[str],
            ),
        ],
    ] = Field({}, description="names used in this file, and the alternative topics of each")
    files: dict[str, StrictStr] = Field(
        {}, description="file name of each topic; `*` is the name of the recording"
    )
    frame: Axes = Field(
        "FRD", description="body axes; FRD: forward-starboard-down; FLU: forward-port-up"
    )
    world: Literal["NED", "NWU", "ENU"] = Field(
        "NED", description="frame of attitude: NED for FRD; NWU (default) or ENU for FLU"
    )
    clock: Annotated[
        Clock,
        _table_from_name(
            lambda name: {"topic": name}, "be a topic, or a table of `topic` or `rate`", Clock
        ),
    ] = Clock()
    segment: StrictStr | None = None
    commands: Annotated[
        dict[Annotated[str, AfterValidator(_check_command_name)], Channel],
        BeforeValidator(commands_by_name, json_schema_input_type=dict[str, Channel] | list[str]),
    ] = Field({}, description="columns of the commands by name; a list if the names are equal")
    sensors: Sensors = Sensors()
    steps: Annotated[
        tuple[Step, ...],
        BeforeValidator(_parse_steps, json_schema_input_type=list[str | dict[str, Any]]),
    ] = Field(
        (), description="conditioning steps in order; names as in hydrodamp.conditioning.pipeline"
    )

    _name: str = PrivateAttr("mapping")

    @property
    def name(self) -> str:
        """Name of the mapping in messages."""
        return self._name

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """All channels, one entry each."""
        entries = [
            Entry(name, name, getattr(self, name), SINGLE_CHANNELS[name])
            for name in SINGLE_CHANNELS
        ]
        entries += [
            entry
            for group in CHANNEL_GROUPS
            for entry in _entries(group, getattr(self, group) or ())
        ]
        entries += [Entry("commands", name, choices) for name, choices in self.commands.items()]
        return tuple(entry for entry in entries if entry.choices)

"""The mapping file: frozen models that are at once its form, its checks and its values."""

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

from hydrodamp.basis.atoms import check_command_name
from hydrodamp.conditioning.pipeline import Step, parse_steps
from hydrodamp.data.channels import ATTITUDE, BLOCKS, EULER, POSITION, RESERVED, VELOCITY
from hydrodamp.data.units import unit_factor
from hydrodamp.errors import LogError

#: What `time` says where topics have a clock of their own.
RECORDED = "recorded"

#: Directions of the world; what is given along them needs the attitude to become body axes.
COMPASS = ("north", "east", "down", "up")

#: Other names of what is counted downwards, and their sign.
DOWNWARD = {"up": ("down", -1.0), "depth": ("down", 1.0)}

_BESIDES = {
    ATTITUDE.name: dict.fromkeys((*EULER, "heading"), "angle"),
    VELOCITY.name: dict.fromkeys(COMPASS, "speed"),
    POSITION.name: dict.fromkeys(DOWNWARD, "length"),
}

#: For every group its channels and their quantities; commands have names of their own.
GROUPS: dict[str, dict[str, str]] = {
    block.name: {**block.quantities, **_BESIDES.get(block.name, {})}
    for block in BLOCKS
    if block.shape
}

#: Channels that stand by themselves.
SINGLE = {
    name: what for block in BLOCKS if not block.shape for name, what in block.quantities.items()
}


def quantity_of(group: str, name: str) -> str | None:
    """Return the quantity of a channel; None where it may be any."""
    return SINGLE.get(group) or GROUPS.get(group, {}).get(name)


Axes = Literal["FRD", "FLU"]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def _from_name(
    table: Callable[[str], dict[str, Any]], wanted: str, kind: Any = dict
) -> BeforeValidator:
    """Return what writes a name alone as the table that it stands for."""

    def write(given: object) -> object:
        if isinstance(given, str):
            return table(given)
        if isinstance(given, dict | BaseModel):
            return given
        raise ValueError(f"must {wanted}; got {given!r}")

    return BeforeValidator(write, json_schema_input_type=str | kind)


class Source(_Strict):
    """One place in a log and what becomes of the numbers there; or one value throughout."""

    column: StrictStr = Field(
        "", description="its name in the log: topic.field, or the column of a table"
    )
    value: FiniteFloat | None = Field(None, description="in place of a column: the same throughout")
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = Field(
        None, description="of `time`, in place of a column: rows follow one another so often [Hz]"
    )
    unit: str | None = Field(None, description="of the value after scale and offset")
    sign: Literal[1, -1] = Field(1, description="applied before axes are turned")
    scale: FiniteFloat = Field(1.0, description="value = scale times number plus offset")
    offset: FiniteFloat = 0.0
    plus: dict[str, FiniteFloat] = Field(
        {}, description="other columns of the same topic to add, each times a number"
    )
    hold: StrictBool | None = Field(
        None, description="keep the last value until the next; false interpolates a command"
    )
    delay: FiniteFloat = Field(0.0, description="how long before its stamp it was measured [s]")
    where: Annotated[
        dict[str, FiniteFloat | None],
        _from_name(
            lambda name: {name: None},
            "be the name of a field, or a table of fields and values",
            dict[str, float],
        ),
    ] = Field({}, description="use only rows where this field is not zero, or has this value")
    optional: StrictBool = Field(False, description="no fault where the log lacks it")

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.value is None and not self.column and self.rate is None:
            raise ValueError("must name a `column`, or give a `value`")
        if self.rate is not None and self.model_fields_set != {"rate"}:
            raise ValueError("takes nothing beside `rate`")
        if self.value is not None and not self.model_fields_set <= {"value", "unit", "sign"}:
            raise ValueError("takes `unit` and `sign` alone beside `value`")
        return self


def _choices(given: object) -> object:
    if given == []:
        raise ValueError("must be a list of at least one; got []")
    return given if isinstance(given, list) else [given]


def _checked_units(quantity: str | None) -> Callable[[tuple[Source, ...]], tuple[Source, ...]]:
    def check(choices: tuple[Source, ...]) -> tuple[Source, ...]:
        for source in choices:
            if source.unit is not None:
                unit_factor(source.unit, quantity)
        return choices

    return check


_ONE = str | Source

#: A column, a table about it, or a list of these of which the first found counts.
Channel = Annotated[
    tuple[Annotated[Source, _from_name(lambda name: {"column": name}, "name a column")], ...],
    BeforeValidator(_choices, json_schema_input_type=_ONE | list[_ONE]),
]


class Entry(NamedTuple):
    """One channel of a mapping; ``sign`` is that of its name, as of ``up`` for ``down``."""

    group: str
    name: str
    choices: tuple[Source, ...]
    quantity: str | None = None
    sign: float = 1.0

    @property
    def column(self) -> str:
        """Its first choice of a column."""
        return self.choices[0].column

    @property
    def place(self) -> str:
        """How the channel is called: ``group.name``."""
        return f"{self.group}.{self.name}"


class Quaternion(_Strict):
    """Four numbers of one message."""

    column: StrictStr = Field(description="what comes before [0] ... [3], or before .w .x .y .z")
    order: Literal["wxyz", "xyzw"] | None = Field(
        None, description="of an array; without it the parts are called w x y z"
    )

    def parts(self) -> Iterator[tuple[str, Source]]:
        """Yield the parts by their names, and where each stands."""
        for part in "wxyz":
            tail = f".{part}" if self.order is None else f"[{self.order.index(part)}]"
            yield f"q{part}", Source(column=f"{self.column}{tail}")


def _entries(group: str, channels: Iterable[tuple[str, Any]]) -> Iterator[Entry]:
    for name, given in channels:
        if isinstance(given, Quaternion):
            for part, source in given.parts():
                yield Entry(group, part, (source,), "ratio")
        else:
            called, sign = DOWNWARD.get(name, (name, 1.0))
            yield Entry(group, called, given, quantity_of(group, name), sign)


def _field(quantity: str) -> tuple[Any, Any]:
    """Return the form of a channel that may be left out, its unit checked."""
    kind = Annotated[Channel, AfterValidator(_checked_units(quantity))] | None
    return kind, Field(None, description=quantity)


def _group(name: str, channels: dict[str, str]) -> type[_Strict]:
    """Return the form of a group: a field a channel, its unit checked against its quantity."""
    fields: dict[str, Any] = {name: _field(quantity) for name, quantity in channels.items()}
    if name == "attitude":
        fields["quaternion"] = (Quaternion | None, None)
    return create_model(name.capitalize(), __base__=_Strict, **fields)


class Rotation(_Strict):
    """How a sensor is turned against the body."""

    roll: FiniteFloat = 0.0
    pitch: FiniteFloat = 0.0
    yaw: FiniteFloat = 0.0
    unit: Literal["deg", "rad"] = "deg"


class Sensor(_Strict):
    """Where and how a sensor sits in the vehicle."""

    axes: Axes | None = Field(None, description="of the sensor; those of the body if not given")
    rotation: Rotation = Field(
        Rotation(),
        description="turns the body's axes into the sensor's: yaw, then pitch, then roll",
    )
    position: Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)] = Field(
        [0.0, 0.0, 0.0], description="of the sensor from the reference point, body axes [m]"
    )


class Sensors(_Strict):
    """The sensors behind the groups of channels."""

    velocity: Sensor = Sensor()
    rates: Sensor = Sensor()
    attitude: Sensor = Sensor()
    specific_force: Sensor = Sensor()


class Clock(_Strict):
    """Whose clock all channels are brought to."""

    topic: StrictStr | None = None
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = Field(None, description="[Hz]")


def _command_name(name: str) -> str:
    if name in RESERVED:
        raise ValueError("has the name of another column of a log; give the command its own")
    check_command_name(name)
    return name


def _steps(given: object) -> tuple[Step, ...]:
    if not isinstance(given, list):
        raise ValueError(f"must be a list; got {given!r}")
    steps, faults = parse_steps(given)
    if faults:
        raise LogError(faults)
    return steps


def by_name(given: Any) -> Any:
    """Write a list of commands as a table."""
    return {name: name for name in given} if isinstance(given, list) else given


if TYPE_CHECKING:

    class _Channels(_Strict):
        time: Channel

else:
    _Channels = create_model(
        "_Channels",
        __base__=_Strict,
        **{name: (_group(name, channels) | None, None) for name, channels in GROUPS.items()},
        **{name: _field(quantity) for name, quantity in SINGLE.items()},
    )


class MappingFile(_Channels):
    """A whole mapping file."""

    extends: str | list[str] = Field([], description="presets or mapping files this one changes")
    source: str | None = Field(None, description="where it is from")
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
    ] = Field({}, description="names used in this file, and the topics that each may stand for")
    files: dict[str, StrictStr] = Field(
        {}, description="topics with a file each, by its name; a star stands for what names the run"
    )
    frame: Axes = Field("FRD", description="FRD: world north-east-down; FLU: world z up")
    world: Literal["NED", "NWU", "ENU"] = Field(
        "NED",
        description="what attitude is counted from: NED for FRD; NWU (default) or ENU for FLU",
    )
    clock: Annotated[
        Clock,
        _from_name(
            lambda name: {"topic": name}, "be a topic, or a table of `topic` or `rate`", Clock
        ),
    ] = Clock()
    segment: StrictStr | None = None
    commands: Annotated[
        dict[Annotated[str, AfterValidator(_command_name)], Channel],
        BeforeValidator(by_name, json_schema_input_type=dict[str, Channel] | list[str]),
    ] = Field({}, description="by their names here; a list where they keep their names")
    sensors: Sensors = Sensors()
    steps: Annotated[
        tuple[Step, ...],
        BeforeValidator(_steps, json_schema_input_type=list[str | dict[str, Any]]),
    ] = Field(
        (), description="done to the log, in order; names as in hydrodamp.conditioning.pipeline"
    )

    _name: str = PrivateAttr("mapping")

    @property
    def name(self) -> str:
        """What messages call it."""
        return self._name

    @cached_property
    def entries(self) -> tuple[Entry, ...]:
        """The channels, one entry each."""
        found = [Entry(name, name, getattr(self, name), SINGLE[name]) for name in SINGLE]
        found += [one for group in GROUPS for one in _entries(group, getattr(self, group) or ())]
        found += [Entry("commands", name, given) for name, given in self.commands.items()]
        return tuple(one for one in found if one.choices)

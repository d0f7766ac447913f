"""The form of a mapping file, key by key."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    FiniteFloat,
    StrictBool,
    StrictStr,
    Tag,
)

Vector = Annotated[list[FiniteFloat], Field(min_length=3, max_length=3)]
Axes = Literal["FRD", "FLU"]


def _not_a_truth(given: object) -> object:
    """Keep true from being taken for 1."""
    return repr(given).lower() if isinstance(given, bool) else given


def _name_or_table(given: object) -> str:
    return "one" if isinstance(given, str) else "table"


def _one_or_list(given: object) -> str:
    return "several" if isinstance(given, list) else "one"


def _list_or_table(given: object) -> str:
    return "several" if isinstance(given, list) else "table"


Sign = Annotated[Literal[1, -1], BeforeValidator(_not_a_truth)]
Condition = Annotated[
    Annotated[str, Tag("one")] | Annotated[dict[str, FiniteFloat], Tag("table")],
    Discriminator(_name_or_table),
]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class EntryForm(_Strict):
    """One column and what becomes of it."""

    column: StrictStr = Field(
        description="its name in the log: topic.field, or the column of a table"
    )
    unit: str | None = Field(None, description="of the value after scale and offset")
    sign: Sign = Field(1, description="applied before axes are turned")
    scale: FiniteFloat = Field(1.0, description="value = scale times number plus offset")
    offset: FiniteFloat = 0.0
    plus: dict[str, FiniteFloat] = Field(
        {}, description="other columns of the same topic to add, each times a number"
    )
    hold: StrictBool | None = Field(
        None, description="keep the last value until the next; false interpolates a command"
    )
    delay: FiniteFloat = Field(0.0, description="how long before its stamp it was measured [s]")
    where: Condition | None = Field(
        None, description="use only rows where this field is not zero, or has this value"
    )
    optional: StrictBool = Field(False, description="no fault where the log lacks it")


class ConstantForm(_Strict):
    """A channel that is the same all the time."""

    value: FiniteFloat
    unit: str | None = None


def _form(given: object) -> str:
    if isinstance(given, str):
        return "name"
    if isinstance(given, list):
        return "choices"
    return "constant" if isinstance(given, dict) and "value" in given else "entry"


_One = Annotated[
    Annotated[str, Tag("name")]
    | Annotated[EntryForm, Tag("entry")]
    | Annotated[ConstantForm, Tag("constant")],
    Discriminator(_form),
]
Channel = Annotated[
    Annotated[str, Tag("name")]
    | Annotated[EntryForm, Tag("entry")]
    | Annotated[ConstantForm, Tag("constant")]
    | Annotated[Annotated[list[_One], Field(min_length=1)], Tag("choices")],
    Discriminator(_form),
]
"""A column, a table about it, a constant, or a list of these of which the first found counts."""


class QuaternionForm(_Strict):
    """Four numbers of one message."""

    column: str = Field(description="what comes before [0] ... [3], or before .w .x .y .z")
    order: Literal["wxyz", "xyzw"] | None = Field(
        None, description="of an array; without it the parts are called w x y z"
    )


class AttitudeForm(_Strict):
    """Roll, pitch, yaw; or a quaternion; or a heading."""

    roll: Channel | None = None
    pitch: Channel | None = None
    yaw: Channel | None = None
    qw: Channel | None = None
    qx: Channel | None = None
    qy: Channel | None = None
    qz: Channel | None = None
    heading: Channel | None = Field(None, description="clockwise from north, whatever the frame")
    quaternion: QuaternionForm | None = None


class VelocityForm(_Strict):
    """Along body axes, or along north, east, down."""

    u: Channel | None = None
    v: Channel | None = None
    w: Channel | None = None
    p: Channel | None = None
    q: Channel | None = None
    r: Channel | None = None
    north: Channel | None = None
    east: Channel | None = None
    down: Channel | None = None
    up: Channel | None = None


class AccelerationForm(_Strict):
    """Time derivatives of the velocities."""

    du: Channel | None = None
    dv: Channel | None = None
    dw: Channel | None = None
    dp: Channel | None = None
    dq: Channel | None = None
    dr: Channel | None = None


class WrenchForm(_Strict):
    """Actuator force and moment on the vehicle, body axes."""

    X: Channel | None = None
    Y: Channel | None = None
    Z: Channel | None = None
    K: Channel | None = None
    M: Channel | None = None
    N: Channel | None = None


class PositionForm(_Strict):
    """Of the reference point in the world."""

    north: Channel | None = None
    east: Channel | None = None
    down: Channel | None = None
    up: Channel | None = None
    depth: Channel | None = None


class AccelerometerForm(_Strict):
    """Specific force, body axes."""

    x: Channel | None = None
    y: Channel | None = None
    z: Channel | None = None


class AnglesForm(_Strict):
    """How a sensor is turned against the body."""

    roll: FiniteFloat = 0.0
    pitch: FiniteFloat = 0.0
    yaw: FiniteFloat = 0.0
    unit: Literal["deg", "rad"] = "deg"


class SensorForm(_Strict):
    """Where and how a sensor sits in the vehicle."""

    axes: Axes | None = Field(None, description="of the sensor; those of the body if not given")
    rotation: AnglesForm | None = Field(
        None, description="turns the body's axes into the sensor's: yaw, then pitch, then roll"
    )
    position: Vector | None = Field(
        None, description="of the sensor from the reference point, body axes [m]"
    )


class SensorsForm(_Strict):
    """The sensors behind the groups of channels."""

    velocity: SensorForm | None = None
    rates: SensorForm | None = None
    attitude: SensorForm | None = None
    accelerometer: SensorForm | None = None


class ClockForm(_Strict):
    """Whose clock all channels are brought to."""

    topic: StrictStr | None = None
    rate: Annotated[FiniteFloat, Field(gt=0)] | None = Field(None, description="[Hz]")


TopicNames = Annotated[
    Annotated[str, Tag("one")] | Annotated[list[str], Tag("several")], Discriminator(_one_or_list)
]
Clock = Annotated[
    Annotated[str, Tag("one")] | Annotated[ClockForm, Tag("table")], Discriminator(_name_or_table)
]


class MappingForm(_Strict):
    """A whole mapping file."""

    extends: str | list[str] = Field([], description="presets or mapping files this one changes")
    source: str | None = None
    note: str | None = None
    topics: dict[str, TopicNames] = Field(
        {}, description="names used in this file, and the topics that each may stand for"
    )
    frame: Axes = Field("FRD", description="FRD: world north-east-down; FLU: world z up")
    world: Literal["NED", "NWU", "ENU"] | None = Field(
        None, description="what attitude is counted from: NED for FRD; NWU (default) or ENU for FLU"
    )
    time: Channel | None = Field(None, description="the clock, or `recorded`")
    clock: Clock | None = None
    segment: StrictStr | None = None
    attitude: AttitudeForm | None = None
    velocity: VelocityForm | None = None
    acceleration: AccelerationForm | None = None
    wrench: WrenchForm | None = None
    position: PositionForm | None = None
    accelerometer: AccelerometerForm | None = None
    eta: Channel | None = None
    commands: Annotated[
        Annotated[dict[str, Channel], Tag("table")] | Annotated[list[str], Tag("several")],
        Discriminator(_list_or_table),
    ] = Field({}, description="by their names here; a list where they keep their names")
    sensors: SensorsForm | None = None
    steps: list[str | dict[str, Any]] | None = Field(
        None, description="done to the log, in order; names as in hydrodamp.conditioning.steps"
    )


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a mapping file."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **MappingForm.model_json_schema(),
        "title": "hydrodamp mapping file",
    }

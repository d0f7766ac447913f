"""Schema of mapping files: pydantic models for validation, values and JSON Schema."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    FiniteFloat,
    PrivateAttr,
    StrictStr,
    create_model,
)

from hydrodamp.basis.term import check_command_name
from hydrodamp.conditioning.pipeline import Step, parse_steps
from hydrodamp.data.channels import (
    RESERVED,
)
from hydrodamp.errors import LogError
from hydrodamp.ingest.mapping.channel_schema import (
    CHANNEL_GROUPS,
    SINGLE_CHANNELS,
    VERTICAL_ALIASES,
    Axes,
    Channel,
    Entry,
    Quaternion,
    Source,
    Strict,
    check_units,
    quantity_of,
    table_from_name,
)
from hydrodamp.ingest.mapping.sensor_schema import Sensors


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
    kind = Annotated[Channel, AfterValidator(partial(check_units, quantity=quantity))] | None
    return kind, Field(None, description=quantity)


def _group_model(name: str, channels: dict[str, str]) -> type[Strict]:
    """Return the model of a group, with one field per channel."""
    fields: dict[str, Any] = {name: _channel_field(quantity) for name, quantity in channels.items()}
    if name == "attitude":
        fields["quaternion"] = (Quaternion | None, None)
    return create_model(name.capitalize(), __base__=Strict, **fields)


class Clock(Strict):
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
    is_list = isinstance(commands, list) and all(isinstance(name, str) for name in commands)
    return {name: name for name in commands} if is_list else commands


if TYPE_CHECKING:

    class _Channels(Strict):
        time: Channel

else:
    _Channels = create_model(
        "_Channels",
        __base__=Strict,
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
_CLOCK_OF_TOPIC = table_from_name(
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
        for name, sensor in self.sensors.measured.items():
            entries += sensor.entries(name)
        return tuple(entry for entry in entries if entry.choices)

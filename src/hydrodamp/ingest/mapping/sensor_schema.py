"""Schema of the sensors of a mapping: mounting, and sensors that keep their own times."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from hydrodamp.data.measurement import KINDS, NUISANCE
from hydrodamp.ingest.mapping.channel_schema import (
    VERTICAL_ALIASES,
    Axes,
    Channel,
    Entry,
    Strict,
    check_units,
)


class Rotation(Strict):
    """Mounting angles of a sensor relative to the body."""

    roll: FiniteFloat = 0.0
    pitch: FiniteFloat = 0.0
    yaw: FiniteFloat = 0.0
    unit: Literal["deg", "rad"] = "deg"


class Sensor(Strict):
    """Axes, mounting angles and position of a sensor in the vehicle."""

    axes: Axes | None = None
    rotation: Rotation = Rotation()
    position: list[FiniteFloat] = Field([0.0, 0.0, 0.0], min_length=3, max_length=3)


#: Quantity of the components of each kind of measurement.
_KIND_QUANTITIES = {
    "position": "length",
    "velocity": "speed",
    "ground_velocity": "speed",
    "rates": "angular rate",
    "attitude": "angle",
    "specific_force": "acceleration",
}

#: Other names of components.
_COMPONENT_ALIASES = {**VERTICAL_ALIASES, "heading": ("yaw", 1.0)}

#: Columns of latitude and longitude.
_ANGLES = re.compile(r"(?i)(^|[._/])(lat|lon|lng|latitude|longitude)(_?deg)?$")

_Positive = Annotated[FiniteFloat, Field(gt=0)]


class MeasuredSensor(Strict):
    """A sensor whose measurements keep their own times."""

    kind: Literal[tuple(KINDS)]  # type: ignore[valid-type]
    columns: Annotated[dict[str, Channel], Field(min_length=1)]
    std: _Positive | dict[str, _Positive] | None = None
    delay: FiniteFloat = 0.0
    lever_arm: list[FiniteFloat] = Field([0.0, 0.0, 0.0], min_length=3, max_length=3)
    estimate: list[Literal[NUISANCE]] = Field([])  # type: ignore[valid-type]

    @model_validator(mode="after")
    def _check_components(self) -> Self:
        known = KINDS[self.kind]
        components = [_COMPONENT_ALIASES.get(name, (name, 1.0))[0] for name in self.columns]
        if not set(components) <= set(known) or len(set(components)) < len(components):
            raise ValueError(
                f"must have `columns` of a {self.kind}, {' '.join(known)}; got "
                f"{' '.join(self.columns)}"
            )
        angles = [
            source.column
            for choices in self.columns.values()
            for source in choices
            if self.kind == "position" and _ANGLES.search(source.column)
        ]
        if angles:
            raise ValueError(
                f"must have `columns` in metres north and east; `{angles[0]}` is an angle: project "
                "it to metres first"
            )
        if isinstance(self.std, dict) and set(self.std) != set(components):
            raise ValueError(f"`std` must be a number, or one of each of {' '.join(components)}")
        for choices in self.columns.values():
            check_units(choices, _KIND_QUANTITIES[self.kind])
        return self

    def entries(self, name: str) -> Iterator[Entry]:
        """Yield the channels of the sensor."""
        for column, choices in self.columns.items():
            component, sign = _COMPONENT_ALIASES.get(column, (column, 1.0))
            quantity = _KIND_QUANTITIES[self.kind]
            yield Entry(sensor_group(name), component, choices, quantity, sign)


def sensor_group(name: str) -> str:
    """Return the channel group of a sensor with its own times."""
    return f"sensor {name}"


class Sensors(BaseModel):
    """Sensors of the channel groups, and sensors with their own times by name."""

    model_config = ConfigDict(extra="allow", frozen=True, defer_build=True)
    __pydantic_extra__: dict[str, MeasuredSensor] = Field(init=False)

    velocity: Sensor = Sensor()
    rates: Sensor = Sensor()
    attitude: Sensor = Sensor()
    specific_force: Sensor = Sensor()

    @property
    def measured(self) -> dict[str, MeasuredSensor]:
        """The sensors with their own times."""
        return self.__pydantic_extra__ or {}

"""What a mapping file must say to make sense, beyond the form of its keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.basis.command_names import check_command_name
from hydrodamp.data.channels import ATTITUDE, EULER
from hydrodamp.data.units import factor
from hydrodamp.errors import LogError, TermError
from hydrodamp.ingest.mapping.channels import COMPASS, GROUPS, SINGLE, quantity_of

_WORLDS = {"FRD": ("NED",), "FLU": ("NWU", "ENU")}


def sense_faults(content: Mapping[Any, Any]) -> Iterator[str]:
    """Say what is missing or contradicts itself in a mapping."""
    yield from _missing(content)
    yield from _attitude(_table(content, "attitude"))
    yield from _velocity(_table(content, "velocity"), _table(content, "attitude"))
    yield from _position(_table(content, "position"))
    yield from _sensors(content)
    yield from _world(content)
    for name in _table(content, "commands"):
        yield from _name(str(name))
    for place, group, name, entry in _entries(content):
        yield from _unit(place, quantity_of(group, name), entry)


def _table(content: Mapping[Any, Any], key: str) -> dict[Any, Any]:
    given = content.get(key)
    return given if isinstance(given, dict) else {}


def _missing(content: Mapping[Any, Any]) -> Iterator[str]:
    if content.get("time") is None:
        yield (
            "`time` must name the column of the clock; it is missing. Where topics have a clock of"
            " their own, `time: recorded` takes it"
        )
    if not content.get("velocity") and not content.get("position"):
        yield ("`velocity` must name the columns of at least one of u v w p q r; it is missing")


def _attitude(given: Mapping[Any, Any]) -> Iterator[str]:
    euler = [name for name in (*EULER, "heading") if name in given]
    turned = [name for name in (*ATTITUDE.columns, "quaternion") if name in given]
    if euler and turned:
        yield (
            f"`attitude` must be given once; got both `{' '.join(euler)}` and"
            f" `{' '.join(turned)}`. Set one of them to null"
        )
    if "yaw" in given and "heading" in given:
        yield "`attitude` takes `yaw` or `heading`, not both. Set one of them to null"
    if "quaternion" in given and len(turned) > 1:
        yield "`attitude` takes `quaternion` or its four parts, not both"


def _velocity(given: Mapping[Any, Any], attitude: Mapping[Any, Any]) -> Iterator[str]:
    body = [name for name in VELOCITIES[:3] if name in given]
    world = [name for name in COMPASS if name in given]
    if body and world:
        yield (
            f"`velocity` must be along body axes or along the world's; got both `{' '.join(body)}`"
            f" and `{' '.join(world)}`. Set one of them to null"
        )
    yield from _vertical("velocity", given)
    if world and not attitude:
        yield f"`velocity.{world[0]}` needs `attitude` to become a velocity along body axes"
    if world and not {"north", "east"} <= set(world):
        yield "`velocity` along the world's axes needs both `north` and `east`"
    level = not {"roll", "pitch", *ATTITUDE.columns, "quaternion"} & set(attitude)
    if world and attitude and not level and not {"down", "up"} & set(world):
        yield "`velocity` needs `down` or `up` beside north and east, as the vehicle may tilt"


def _position(given: Mapping[Any, Any]) -> Iterator[str]:
    yield from _vertical("position", given)


def _vertical(group: str, given: Mapping[Any, Any]) -> Iterator[str]:
    vertical = [name for name in ("down", "up", "depth") if name in given]
    if len(vertical) > 1:
        yield f"`{group}` takes one of `{' '.join(vertical)}`; set the others to null"


def _sensors(content: Mapping[Any, Any]) -> Iterator[str]:
    velocity = _table(content, "velocity")
    whole = {
        "velocity": all(name in velocity for name in VELOCITIES[:3]),
        "rates": all(name in velocity for name in VELOCITIES[3:]),
        "accelerometer": set(_table(content, "accelerometer")) == {"x", "y", "z"},
        "attitude": len(_table(content, "attitude")) > 2 or "quaternion" in content["attitude"]
        if _table(content, "attitude")
        else False,
    }
    for name, given in _table(content, "sensors").items():
        if isinstance(given, dict) and given.get("rotation") and not whole.get(name, True):
            yield f"`sensors.{name}.rotation` needs all three components of it in the mapping"
        if isinstance(given, dict) and given.get("position") and name != "velocity":
            yield f"`sensors.{name}.position` has no effect; only that of `velocity` has"
    given = _table(content, "sensors").get("velocity")
    if isinstance(given, dict) and given.get("position") and not {"p", "q", "r"} & set(velocity):
        yield "`sensors.velocity.position` needs the rates p q r, or r alone on the level"


def _world(content: Mapping[Any, Any]) -> Iterator[str]:
    frame, world = _axes_of_attitude(content), content.get("world")
    if world is not None and frame in _WORLDS and world not in _WORLDS[frame]:
        allowed = " or ".join(_WORLDS[frame])
        yield (
            f"`world` must be {allowed} where attitude is of axes {frame}; got {world}. Set"
            " `sensors.attitude.axes` if attitude has other axes than the rest"
        )


def _axes_of_attitude(content: Mapping[Any, Any]) -> str:
    sensor = _table(content, "sensors").get("attitude")
    own = sensor.get("axes") if isinstance(sensor, dict) else None
    return str(own or content.get("frame") or "FRD")


def _name(name: str) -> Iterator[str]:
    try:
        check_command_name(name)
    except TermError as error:
        yield f"`commands.{name}`: {error}"


def _entries(content: Mapping[Any, Any]) -> Iterator[tuple[str, str, str, dict[Any, Any]]]:
    """Yield place, group, name and table of every entry that is a table."""
    groups = {key: {key: content.get(key)} for key in SINGLE}
    groups |= {key: _table(content, key) for key in (*GROUPS, "commands")}
    for group, channels in groups.items():
        for name, given in channels.items():
            place = group if group in SINGLE else f"{group}.{name}"
            choices = given if isinstance(given, list) else [given]
            for one in choices:
                if isinstance(one, dict) and name != "quaternion":
                    yield place, group, str(name), one


def _unit(place: str, quantity: str | None, entry: Mapping[Any, Any]) -> Iterator[str]:
    if entry.get("unit") is None:
        return
    try:
        factor(str(entry["unit"]), quantity)
    except LogError as error:
        yield f"`{place}.unit`: {error}"

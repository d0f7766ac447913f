"""What a mapping file lacks, or says twice in two ways, beyond the form of its keys."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.channels import ATTITUDE, EULER, SPECIFIC_FORCE
from hydrodamp.ingest.mapping.channels import COMPASS

_WORLDS = {"FRD": ("NED",), "FLU": ("NWU", "ENU")}
_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]


def contradictions(content: Mapping[Any, Any]) -> Iterator[str]:
    """Yield what is missing from a mapping or contradicts itself, a sentence each."""
    attitude, velocity = _table(content, "attitude"), _table(content, "velocity")
    if content.get("time") is None:
        yield (
            "`time` must name the column of the clock; it is missing. Where topics have a clock of"
            " their own, `time: recorded` takes it"
        )
    if not content.get("velocity") and not content.get("position"):
        yield "`velocity` must name the columns of at least one of u v w p q r; it is missing"
    yield from _attitude(attitude)
    yield from _velocity(velocity, attitude)
    for group in ("velocity", "position"):
        vertical = [name for name in ("down", "up", "depth") if name in _table(content, group)]
        if len(vertical) > 1:
            yield f"`{group}` takes one of `{' '.join(vertical)}`; set the others to null"
    yield from _sensors(content, attitude, velocity)
    frame, world = _axes_of_attitude(content), content.get("world")
    if world is not None and world not in _WORLDS.get(frame, (world,)):
        yield (
            f"`world` must be {' or '.join(_WORLDS[frame])} where attitude is of axes {frame}; got"
            f" {world}. Set `sensors.attitude.axes` if attitude has other axes than the rest"
        )


def usual_world(content: Mapping[Any, Any]) -> str:
    """Return what the attitude is counted from where a mapping does not say it."""
    return _WORLDS.get(_axes_of_attitude(content), ("NED",))[0]


def _axes_of_attitude(content: Mapping[Any, Any]) -> str:
    own = _table(_table(content, "sensors"), "attitude").get("axes")
    return str(own or content.get("frame") or "FRD")


def _table(content: Mapping[Any, Any], key: str) -> dict[Any, Any]:
    given = content.get(key)
    return given if isinstance(given, dict) else {}


def _attitude(given: Mapping[Any, Any]) -> Iterator[str]:
    euler = [name for name in (*EULER, "heading") if name in given]
    quaternion = [name for name in (*ATTITUDE.columns, "quaternion") if name in given]
    if euler and quaternion:
        yield (
            f"`attitude` must be given once; got both `{' '.join(euler)}` and"
            f" `{' '.join(quaternion)}`. Set one of them to null"
        )
    if {"yaw", "heading"} <= set(given):
        yield "`attitude` takes `yaw` or `heading`, not both. Set one of them to null"
    if "quaternion" in given and len(quaternion) > 1:
        yield "`attitude` takes `quaternion` or its four parts, not both"


def _velocity(given: Mapping[Any, Any], attitude: Mapping[Any, Any]) -> Iterator[str]:
    body = [name for name in _LINEAR if name in given]
    world = [name for name in COMPASS if name in given]
    if not world:
        return
    if body:
        yield (
            f"`velocity` must be along body axes or along the world's; got both `{' '.join(body)}`"
            f" and `{' '.join(world)}`. Set one of them to null"
        )
    if not attitude:
        yield f"`velocity.{world[0]}` needs `attitude` to become a velocity along body axes"
    if not {"north", "east"} <= set(world):
        yield "`velocity` along the world's axes needs both `north` and `east`"
    tilts = {"roll", "pitch", *ATTITUDE.columns, "quaternion"} & set(attitude)
    if tilts and not {"down", "up"} & set(world):
        yield "`velocity` needs `down` or `up` beside north and east, as the vehicle may tilt"


def _sensors(
    content: Mapping[Any, Any], attitude: Mapping[Any, Any], velocity: Mapping[Any, Any]
) -> Iterator[str]:
    is_whole = {
        "velocity": set(_LINEAR) <= set(velocity),
        "rates": set(_ANGULAR) <= set(velocity),
        "attitude": len(attitude) > 2 or "quaternion" in attitude,
        SPECIFIC_FORCE.name: len(_table(content, SPECIFIC_FORCE.name)) == 3,
    }
    sensors = _table(content, "sensors")
    for name in sensors:
        given = _table(sensors, name)
        if given.get("rotation") and not is_whole.get(name, True):
            yield f"`sensors.{name}.rotation` needs all three components of it in the mapping"
        if given.get("position") and name != "velocity":
            yield f"`sensors.{name}.position` has no effect; only that of `velocity` has"
    if _table(sensors, "velocity").get("position") and not set(_ANGULAR) & set(velocity):
        yield "`sensors.velocity.position` needs the rates p q r, or r alone on the level"

"""What the name and the unit of a column say about its role."""

from __future__ import annotations

from collections.abc import Iterator

from hydrodamp.data.units import UNITS
from hydrodamp.ingest.mapping.channels import quantity_of
from hydrodamp.ingest.probing.words import parted, words


def _set(listed: str) -> frozenset[str]:
    return frozenset(listed.split())


COMMANDS = _set(
    "cmd command commands thruster thrusters thrust rpm rudder fin fins flaps elevator pwm servo "
    "rcout rcou ch chan channel channels motor motors propeller prop screw delta stern "
    "aileron actuator actuators torque throttle force wrench output outputs control voltage "
    "esc joystick plane planes"
)
"""Words of commands and actuators."""

NOISE = _set(
    "covariance cov cova var variance std sigma error err bias innov innovation integral reset "
    "derivative counter dop"
)
"""Words of fields that are about others, and measure nothing themselves."""

_WANTED = _set("setpoint sp target desired ref reference goal des wanted")
_FLAGS = _set("good valid ok lock flag status quality is healthy")
_ANGULAR = _set("angular gyro gyr gyroscope omega rate rates angvel pqr dot")
_FORCE = _set("accel acceleration acc accelerometer accelerations")
_SPIN = _set("orientation quaternion quat attitude q")
_SPEED = _set("velocity velocities vel twist linear v speed dvl nu vbody")
_PLACE = _set("position pose pos translation location point")
_ANGLES = {
    "roll": "roll",
    "phi": "roll",
    "pitch": "pitch",
    "theta": "pitch",
    "yaw": "yaw",
    "psi": "yaw",
    "heading": "heading",
    "hdg": "heading",
    "compass": "heading",
}
_RATE_OF = {"roll": "p", "pitch": "q", "yaw": "r", "heading": "r"}
_COMPASS = {"north": "north", "n": "north", "east": "east", "e": "east", "down": "down"}
_COMPASS |= {"d": "down", "up": "up"}
_FUSED = (
    {f"v{a}": f"velocity.{b}" for a, b in zip("xyz", "uvw", strict=True)}
    | {f"w{a}": f"velocity.{b}" for a, b in zip("xyz", "pqr", strict=True)}
    | {f"g{a}": f"velocity.{b}" for a, b in zip("xyz", "pqr", strict=True)}
    | {f"a{a}": f"specific_force.f{a}" for a in "xyz"}
    | {f"acc{a}": f"specific_force.f{a}" for a in "xyz"}
    | {f"gyr{a}": f"velocity.{b}" for a, b in zip("xyz", "pqr", strict=True)}
    | {f"q{a}": f"attitude.q{a}" for a in "wxyz"}
    | {f"v{a}": f"velocity.{b}" for a, b in _COMPASS.items() if len(a) == 1}
    | {f"p{a}": f"position.{b}" for a, b in _COMPASS.items() if len(a) == 1}
)
_AXES = {"x": 0, "y": 1, "z": 2, "0": 0, "1": 1, "2": 2}

Hint = tuple[str, int]
"""A role, and how sure the name is of it [%]."""


def hint(topic: str, field: str, unit: str | None) -> Hint | None:
    """Return the role that a name and a unit speak for."""
    name = parted(field)[0]
    around = {*words(topic), *name}
    if around & NOISE or field.startswith("header."):
        return None
    found = next(_told(name, around), None)
    if found is None:
        return None
    role, confidence = found
    quantity = quantity_of_role(role)
    if unit is None or quantity is None:
        return role, confidence
    if unit in UNITS[quantity]:
        return role, min(95, confidence + 10)
    return None


def quantity_of_role(role: str) -> str | None:
    """Return the quantity of a role; None where it may be any."""
    group, _, channel = role.partition(".")
    if group == "position":
        return "length"
    return quantity_of(group, channel) if channel else None


def _told(name: tuple[str, ...], around: set[str]) -> Iterator[Hint]:
    """Yield what words say, the surest first."""
    if set(name) & _FLAGS and not set(name) & set(_ANGLES):
        yield "flag", 80
        return
    yield from _commands(name, around)
    if around & _WANTED:
        return
    yield from _angles(name, around)
    yield from _vectors(name, around)
    yield from _single(name, around)


def _commands(name: tuple[str, ...], around: set[str]) -> Iterator[Hint]:
    if set(name) & COMMANDS:
        yield "commands", 85
    elif around & (COMMANDS - {"control"}) and not set(name) & {*_ANGLES, *_WANTED}:
        yield "commands", 75


def _angles(name: tuple[str, ...], around: set[str]) -> Iterator[Hint]:
    for word in name:
        if word in _ANGLES:
            angle = _ANGLES[word]
            rate = bool(set(name) & (_ANGULAR | {"speed"}))
            yield (f"velocity.{_RATE_OF[angle]}", 80) if rate else (f"attitude.{angle}", 85)
    if "rate" in around and len(name) == 1 and name[0] in "rpy":
        yield f"velocity.{dict(zip('rpy', 'pqr', strict=True))[name[0]]}", 75


def _vectors(name: tuple[str, ...], around: set[str]) -> Iterator[Hint]:
    last = name[-1] if name else ""
    if around & _SPIN and last in ("w", "x", "y", "z"):
        yield f"attitude.q{last}", 85
        return
    if name[:1] == ("q",) and last in ("0", "1", "2", "3"):
        yield f"attitude.q[{last}]", 80
        return
    axis = _AXES.get(last)
    if axis is not None and len(around) > 1:
        for kind, role, sure in (
            (_FORCE, f"specific_force.f{'xyz'[axis]}", 85),
            (_ANGULAR, f"velocity.{'pqr'[axis]}", 85),
            (_SPEED, f"velocity.{'uvw'[axis]}", 80),
            (_PLACE, f"position.{'xyz'[axis]}", 75),
        ):
            if around & kind:
                yield role, sure
                return
    if last in _COMPASS and len(name) > 1:
        group = "velocity" if set(name) & _SPEED else "position"
        yield f"{group}.{_COMPASS[last]}", 80


def _single(name: tuple[str, ...], around: set[str]) -> Iterator[Hint]:
    last = name[-1] if name else ""
    if "depth" in name:
        yield "position.depth", 75 if set(name) & {"raw", "sensor", "setpoint"} else 85
    elif len(name) == 1 and last in "uvwpqr":
        yield f"velocity.{last}", 85
    elif last in _FUSED and not (last[0] == "a" and around & _PLACE):
        yield _FUSED[last], 80  # but not the world's acceleration beside a position
    elif len(name) == 1 and last in "xyz" and around:
        yield f"position.{last}", 60
    elif last in ("north", "east"):
        yield f"position.{last}", 75

"""What the name and the unit of a column say about its role."""

from __future__ import annotations

import re
from collections.abc import Iterator

from hydrodamp.data.recording import Topic
from hydrodamp.data.units import UNITS, spelt, unit_at_end
from hydrodamp.ingest.mapping.channels import quantity_of


def _set(listed: str) -> frozenset[str]:
    return frozenset(listed.split())


#: Words of fields that are about others, and measure nothing themselves.
NOISE = _set(
    "covariance cov cova var variance std sigma error err bias innov innovation integral reset "
    "derivative counter dop"
)
_COMMANDS = _set(
    "cmd command commands thruster thrusters thrust rpm rudder fin fins flaps elevator pwm servo "
    "rcout rcou ch chan channel channels motor motors propeller prop screw delta stern "
    "aileron actuator actuators torque throttle force wrench output outputs control voltage "
    "esc joystick plane planes"
)
_WANTED = _set("setpoint sp target desired ref reference goal des wanted")
_FLAGS = _set("good valid ok lock flag status quality is healthy")
_ANGULAR = _set("angular gyro gyr gyroscope omega rate rates angvel pqr dot")
_FORCE = _set("accel acceleration acc accelerometer accelerations")
_TURNED = _set("orientation quaternion quat attitude q")
_SPEED = _set("velocity velocities vel twist linear v speed dvl nu vbody")
_PLACE = _set("position pose pos translation location point")
_ANGLES = {
    word: angle
    for angle, listed in (
        ("roll", "roll phi"),
        ("pitch", "pitch theta"),
        ("yaw", "yaw psi"),
        ("heading", "heading hdg compass"),
    )
    for word in listed.split()
}
_RATE_OF = {"roll": "p", "pitch": "q", "yaw": "r", "heading": "r"}
_LETTERS = {"n": "north", "e": "east", "d": "down"}
_COMPASS = {word: word for word in ("north", "east", "down", "up")} | _LETTERS
_AXES = {"x": 0, "y": 1, "z": 2, "0": 0, "1": 1, "2": 2}


def _fused() -> Iterator[tuple[str, str]]:
    """Yield names of which the first letters say what is measured, and their roles."""
    for axis, speed, rate in zip("xyz", "uvw", "pqr", strict=True):
        yield f"v{axis}", f"velocity.{speed}"
        yield from ((f"{kind}{axis}", f"velocity.{rate}") for kind in ("w", "g", "gyr"))
        yield from ((f"{kind}{axis}", f"specific_force.f{axis}") for kind in ("a", "acc"))
    yield from ((f"q{part}", f"attitude.q{part}") for part in "wxyz")
    for letter, way in _LETTERS.items():
        yield f"v{letter}", f"velocity.{way}"
        yield f"p{letter}", f"position.{way}"


_FUSED = dict(_fused())

#: A role, and how sure the name is of it [%].
Hint = tuple[str, int]


def words(name: str) -> tuple[str, ...]:
    """Return the words of a name, small."""
    apart = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+", apart.lower()) if word)


def parted(name: str) -> tuple[tuple[str, ...], str | None]:
    """Return the words of a name without its unit, and the unit."""
    whole = words(name)
    found = unit_at_end(whole)
    return (whole, None) if found is None else (whole[: -found[0]], found[1])


def unit_of(topic: Topic, field: str) -> str | None:
    """Return the unit that the file states for a field, or that its name carries."""
    return spelt(topic.units.get(field, "")) or parted(field)[1]


def hint(topic: str, field: str, unit: str | None) -> Hint | None:
    """Return the role that a name and a unit speak for."""
    name = parted(field)[0]
    around = {*words(topic), *name}
    if around & NOISE or field.startswith("header."):
        return None
    found = next(_hints(name, around), None)
    if found is None:
        return None
    role, confidence = found
    quantity = quantity_of_role(role)
    if unit is None or quantity is None:
        return role, confidence
    return (role, min(95, confidence + 10)) if unit in UNITS[quantity] else None


def quantity_of_role(role: str) -> str | None:
    """Return the quantity of a role; None where it may be any."""
    group, _, channel = role.partition(".")
    if group == "position":
        return "length"
    return quantity_of(group, channel) if channel else None


def _hints(name: tuple[str, ...], around: set[str]) -> Iterator[Hint]:
    """Yield what words say, the surest first."""
    own, last = set(name), name[-1] if name else ""
    if own & _FLAGS and not own & set(_ANGLES):
        yield "flag", 80
        return
    if own & _COMMANDS:
        yield "commands", 85
    elif around & (_COMMANDS - {"control"}) and not own & {*_ANGLES, *_WANTED}:
        yield "commands", 75
    if around & _WANTED:
        return
    for angle in (_ANGLES[word] for word in name if word in _ANGLES):
        is_rate = bool(own & (_ANGULAR | {"speed"}))
        yield (f"velocity.{_RATE_OF[angle]}", 80) if is_rate else (f"attitude.{angle}", 85)
    if "rate" in around and len(name) == 1 and last in "rpy":
        yield f"velocity.{dict(zip('rpy', 'pqr', strict=True))[last]}", 75
    yield from _vectors(name, around, last)
    yield from _single(name, around, last)


def _vectors(name: tuple[str, ...], around: set[str], last: str) -> Iterator[Hint]:
    if around & _TURNED and last in ("w", "x", "y", "z"):
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


def _single(name: tuple[str, ...], around: set[str], last: str) -> Iterator[Hint]:
    is_alone = len(name) == 1
    if "depth" in name:
        yield "position.depth", 75 if set(name) & {"raw", "sensor", "setpoint"} else 85
    elif is_alone and last in "uvwpqr":
        yield f"velocity.{last}", 85
    elif last in _FUSED and not (last[0] == "a" and around & _PLACE):
        yield _FUSED[last], 80  # but not the world's acceleration beside a position
    elif is_alone and last in "xyz" and around:
        yield f"position.{last}", 60
    elif last in ("north", "east"):
        yield f"position.{last}", 75

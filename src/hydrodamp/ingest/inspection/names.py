"""What the names of columns say: roles by words, units at the end, vectors by their elements."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator

from hydrodamp.data.channels import WRENCH
from hydrodamp.data.recording import Topic
from hydrodamp.data.units import UNITS, parse_unit, trailing_unit
from hydrodamp.ingest.inspection.elements import element_of, split_index
from hydrodamp.ingest.mapping.columns import NON_UNIT_WORDS
from hydrodamp.ingest.mapping.schema import quantity_of

_WAYS = ("north", "east", "down")


def _set(listed: str) -> frozenset[str]:
    return frozenset(listed.split())


#: Words of fields that are about others, and measure nothing themselves.
NOISE = _set(
    "covariance cov cova var variance std sigma error err bias innov innovation integral reset "
    "derivative counter dop seq layout sim simulated simulation pred predicted battery batt"
)
_ASIDE = _set("offset limit max min kp ki kd wind wave waves camera gimbal")  # of a field alone
#: Words of the state of an actuator or a program, which commands nothing.
_STATUS = _set(
    "status state states mode code fault faults flags enable enabled armed health temp temperature "
    "current amps watts power energy count counts counter index idx id warning alarm saturated "
    "online"
)
_COMMANDS = _set(
    "cmd command commands thr thruster thrusters thrust rpm rudder fin fins flaps elevator pwm "
    "servo rcout rcou ch chan channel channels motor motors propeller prop screw delta stern "
    "aileron actuator actuators torque throttle force wrench output outputs control voltage "
    "esc joystick joy stick sticks lever manual rc axes plane planes tab tabs "
    "moment moments effort cpp blade"
)
_WANTED = _set("setpoint setpoints sp target targets desired ref reference goal des wanted")
_WANTED |= _set("dref etad nud psid posd veld")  # eta_d and its like, in a single word
_WRENCH = _set("wrench tau")
_PUSH, _TWIST = _set("force forces"), _set("torque torques moment moments")
_LOADS = _WRENCH | _PUSH | _TWIST
_EULER = _set("rpy euler attitude angles angle")
_ANGLE, _CHANGE = _set("rpy euler angles angle"), _set("rate rates vel velocity speed dot")
_SAID_OF = _set("meas measured est estimated filt filtered actual act true gt mocap sensor value")
_NAMED_WORLDS = {
    world: {f"velocity.{speed}": f"velocity.{way}" for speed, way in zip("uvw", ways, strict=True)}
    for world, ways in {"ned": _WAYS, "enu": ("east", "north", "up")}.items()
}
_EARTH = _set("gps gnss global local world earth map inertial ned enu")
_BODY = _set("body dvl odom odometry frd flu pathfinder")  # axes of the vehicle, whatever else
_FLAGS = _set("good valid ok lock flag status quality is healthy")
_ANGULAR = _set("angular gyro gyr gyroscope omega rate rates angvel pqr dot rotational")
_FORCE = _set("accel acceleration acc accelerometer accelerations")
_TURNED = _set("orientation quaternion quat attitude q")
_SPEED = _set("velocity velocities vel twist linear v speed dvl nu vbody translational")
_PLACE = _set("position pose pos translation location point eta")
_MOTIONS = {"surge": "u", "sway": "v", "heave": "w"}
_ANGLES = {name: name for name in ("roll", "pitch", "yaw", "heading")}
_ANGLES |= {"phi": "roll", "theta": "pitch", "psi": "yaw", "hdg": "heading", "compass": "heading"}
_ANGLES |= {"heel": "roll", "trim": "pitch"}
_RATE_OF = {"roll": "p", "pitch": "q", "yaw": "r", "heading": "r"}
_LETTERS = {"n": "north", "e": "east", "d": "down"}
_COMPASS = {word: word for word in ("north", "east", "down", "up")} | _LETTERS
_AXES = {"x": 0, "y": 1, "z": 2} | {str(place): place for place in range(6)}
_WRENCH_OF = dict(zip("uvwpqrxyzkmn", 2 * WRENCH.columns, strict=True))
_TURN = ("attitude.roll", "attitude.pitch", "attitude.yaw")


def _roles_of(group: str, names: str) -> tuple[str, ...]:
    return tuple(f"{group}.{name}" for name in names.split())


# Vectors of ships, which move in the plane where they have three components.
_PLANAR = {
    "nu": _roles_of("velocity", "u v r"),
    "eta": ("position.x", "position.y", "attitude.yaw"),
    "tau": _roles_of("wrench", "X Y N"),
}

# What words say of vectors, of three components or of six, the likeliest first; and how surely [%].
_VECTORS = (
    (_FORCE, _roles_of("specific_force", "fx fy fz"), 85),
    (_PUSH, _roles_of("wrench", "X Y Z"), 80),
    (_TWIST, _roles_of("wrench", "K M N"), 80),
    (_WRENCH, _roles_of("wrench", "X Y Z K M N"), 85),
    (_ANGULAR, _roles_of("velocity", "p q r"), 85),
    (_SPEED, _roles_of("velocity", "u v w p q r"), 80),
    (_EULER, _TURN, 80),
    (_PLACE, (*_roles_of("position", "x y z"), *_TURN), 75),
)


def _compound_names() -> Iterator[tuple[str, str]]:
    """Yield names of which the first letters say what is measured, and their roles."""
    for axis, speed, rate in zip("xyz", "uvw", "pqr", strict=True):
        yield f"v{axis}", f"velocity.{speed}"
        yield from ((f"{kind}{axis}", f"velocity.{rate}") for kind in ("w", "g", "gyr"))
        yield from ((f"{kind}{axis}", f"specific_force.f{axis}") for kind in ("a", "acc"))
    yield from ((f"q{part}", f"attitude.q{part}") for part in "wxyz")
    for turn, rate in zip(("roll", "pitch", "yaw"), "pqr", strict=True):
        yield from ((f"{turn}{kind}", f"velocity.{rate}") for kind in ("rate", "speed"))
    for letter, way in _LETTERS.items():
        yield f"v{letter}", f"velocity.{way}"
        yield f"p{letter}", f"position.{way}"


_FUSED = dict(_compound_names())

_PATH = re.compile(r"[./]")  # between messages within messages

#: Why a column has no role, where nothing else is to be said.
NO_ROLE = "no role found"

#: A role, and how sure the name is of it [%].
Hint = tuple[str, int]


def words(name: str) -> tuple[str, ...]:
    """Return the words of a name, small."""
    apart = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+", apart.lower()) if word)


def split_unit(name: str) -> tuple[tuple[str, ...], str | None]:
    """Return the words of a name without its unit, and the unit; an index stays at the end."""
    stem, index = split_index(name)
    whole = words(stem)
    found = trailing_unit(whole)
    bare, unit = (whole, None) if found is None else (whole[: -found[0]], found[1])
    return (*bare, *words(index)), unit


def unit_of(topic: Topic, field: str) -> str | None:
    """Return the unit that the file states for a field, or that its name carries."""
    return parse_unit(topic.units.get(field, "")) or split_unit(field)[1]


def guess_role(
    topic: str, field: str, unit: str | None, beside: Collection[str] = (), stated: str = ""
) -> Hint:
    """Return the role that a name and a unit, known or but stated, speak for, or why none."""
    name = split_unit(field)[0]
    around = {*words(topic), *name}
    if told := around & NOISE | {*name} & _ASIDE:
        return f"not a measurement itself: {min(told)}", 0
    is_wrench = {"K", "M", "N"} <= {*beside} or {"X", "Y", "N"} <= {*beside}
    if field in WRENCH.columns and is_wrench:
        return f"wrench.{field}", 85
    stem = split_index(field)[0]
    wanted = {*name} & _WANTED or _setpoint_suffix(stem, beside)
    if wanted and not {*name} & _COMMANDS:
        return f"asked for, not measured: {min(wanted)}", 0
    bare = tuple(word for word in name if word not in _SAID_OF) or name
    is_alone = len({*split_unit(_PATH.split(field)[-1])[0]} - _SAID_OF) == 1
    size = 0
    if element := element_of(field, beside):
        words_of_stem = split_unit(stem)[0]
        bare = tuple(word for word in words_of_stem if word not in _SAID_OF) or words_of_stem
        bare = (*bare, str(element.index))
        size = element.size if element.size > 1 else 0
    elif stem != field:
        return "an element of a matrix", 0
    found = _role_of_words(bare, around, size, is_alone=is_alone, beside=beside, field=field)
    if found is None and split_unit(field)[1] == "rpm":
        found = "commands", 80
    if found is None:
        asked = sorted({*words(topic)} & _WANTED)
        return f"asked for, not measured: {asked[0]}" if asked else NO_ROLE, 0
    of_topic = set() if around & {"output", "outputs"} else {*words(topic)} & _STATUS
    if found[0] == "commands" and (status := {*name} & _STATUS | of_topic):
        return f"of the state of an actuator, no command: {min(status)}", 0
    found = _velocity_axes(found, around)
    quantity = quantity_of_role(found[0])
    if unit is None and quantity is not None and stated.casefold() not in NON_UNIT_WORDS:
        return f"in {stated}", 0
    if unit is None or quantity is None:
        return found
    return (found[0], min(95, found[1] + 10)) if unit in UNITS[quantity] else (f"in {unit}", 0)


def _setpoint_suffix(stem: str, beside: Collection[str]) -> set[str]:
    """Return the last word of `psi_d` or `pd`, unless it stands for down beside north."""
    said = words(stem)
    said = said[:-1] if len(said) > 1 and said[-1] in tuple("xyz") else said
    last = said[-1] if said else ""
    is_desired = last in ("pd", "vd") or (last == "d" and len(said) > 1)
    stems = {split_index(one)[0].casefold() for one in beside}
    is_down = any(stem[:-1].casefold() + north in stems for north in ("n", "north"))
    return {last} if is_desired and not is_down else set()


def _velocity_axes(found: Hint, around: set[str]) -> Hint:
    """Return a linear velocity along the axes that its words name: body, compass, or the world.

    The role of a velocity of the world whose axes no word names is velocity.x, y or z.
    """
    role, sure = found
    axis = role.removeprefix("velocity.")
    if role == axis or axis not in tuple("uvw"):
        return found
    if around & _BODY:
        return role, sure + 5 * ("body" in around)
    if named := around & _NAMED_WORLDS.keys():
        return _NAMED_WORLDS[min(named)][role], sure
    return (f"velocity.{'xyz'['uvw'.index(axis)]}", sure) if around & _EARTH else found


def quantity_of_role(role: str) -> str | None:
    """Return the quantity of a role; None where it may be any."""
    group, _, channel = role.partition(".")
    if group == "position":
        return "length"
    if group == "velocity" and channel in tuple("xyz"):
        return "speed"
    return quantity_of(group, channel) if channel else None


def _role_of_words(
    name: tuple[str, ...],
    around: set[str],
    size: int,
    *,
    is_alone: bool,
    beside: Collection[str],
    field: str,
) -> Hint | None:
    """Return what words say of a field, by itself or in an array of some size."""
    own, last = set(name), name[-1] if name else ""
    has_w = f"{field[:-1]}w" in beside
    numbered = own | {word.rstrip("0123456789") for word in name}
    angle = next((_ANGLES[word] for word in name if word in _ANGLES), None)
    if own & _FLAGS and angle is None:
        return "flag", 80
    if own & _WRENCH and (of := _wrench_component(name)):
        return f"wrench.{of}", 85
    loading = around if last in tuple("xyz") else own | around & _WRENCH
    is_load = last in _AXES and not around & _WANTED and loading & _LOADS
    if is_load and (found := _vector_component(around - _SPEED, _AXES[last], size)):
        return found
    if numbered & _COMMANDS:
        return "commands", 85
    if around & (_COMMANDS - {"control"}) and angle is None and not own & _WANTED:
        return "commands", 75
    if around & _WANTED:
        return None
    if angle is not None and own & _FORCE:
        return None  # an angular acceleration
    is_angle = own & _ANGLE and not own & _CHANGE
    if angle is None and is_angle and last in tuple("xyz012") and size in (0, 3):
        return _TURN[_AXES[last]], 80
    if angle is not None:
        is_rate = bool(own & (_ANGULAR | {"speed"}))
        return (f"velocity.{_RATE_OF[angle]}", 80) if is_rate else (f"attitude.{angle}", 85)
    if own & _MOTIONS.keys() and not own & _PLACE:
        return f"velocity.{next(_MOTIONS[word] for word in name if word in _MOTIONS)}", 80
    if "rate" in around and is_alone and last in "rpy" and f"{field[:-1]}x" not in beside:
        return f"velocity.{'pqr'['rpy'.index(last)]}", 75
    if around & _TURNED and last in ("w", "x", "y", "z") and has_w:
        return f"attitude.q{last}", 85
    if around & _TURNED and size == 4 and last in ("0", "1", "2", "3"):
        return f"attitude.q[{last}]", 60
    if (
        last in _AXES
        and len(around) > 1
        and (found := _vector_component(around, _AXES[last], size))
    ):
        return found
    if last in _COMPASS and not is_alone:
        return f"{'velocity' if own & _SPEED else 'position'}.{_COMPASS[last]}", 80
    if "depth" in own and not own & (_ANGULAR | _SPEED):
        return "position.depth", 75 if own & {"raw", "sensor"} else 85
    if is_alone and last in "uvwpqr" and not around & _TURNED - {"q"}:
        return f"velocity.{last}", 85
    if last in _FUSED and not (last[0] == "a" and around & _PLACE):
        return _FUSED[last], 80  # but not the world's acceleration beside a position
    if len(name) == 1 and last in "xyz":
        return f"position.{last}", 60
    if is_alone and last == "n":  # of the propeller, as ships have it
        return "commands", 60
    return (f"position.{last}", 75) if last in ("north", "east") else None


def _wrench_component(name: tuple[str, ...]) -> str | None:
    """Return the component of a wrench that a name such as `tau_N` or `tau_surge` ends in."""
    last = next((word for word in name[::-1] if word not in ("cmd", "command", "total")), "")
    axis = _MOTIONS.get(last) or _RATE_OF.get(last, last)
    return _WRENCH_OF.get(axis) if axis not in tuple("xyz") else None


def _vector_component(around: set[str], place: int, size: int) -> Hint | None:
    """Return what a component of a vector is."""
    for kind, roles, sure in _VECTORS:
        if size == 3 and around & kind & _PLANAR.keys():
            return _PLANAR[min(around & kind & _PLANAR.keys())][place], 65
        if around & kind:
            is_one = place < min(len(roles), size or 3)
            return (roles[place], sure) if is_one and size in (0, 2, 3, 6) else None
    return None

"""Roles of columns from their names: words, unit suffixes, elements of vectors."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from pathlib import Path

import yaml

from hydrodamp.data.channels import EULER, UNITS, WRENCH, parse_unit, trailing_unit
from hydrodamp.data.recording import Topic
from hydrodamp.ingest.mapping.channel_schema import quantity_of
from hydrodamp.ingest.mapping.columns import NON_UNIT_WORDS

_TABLES = yaml.safe_load(Path(__file__).with_name("words.yaml").read_text("utf-8"))
#: Words in names by their meaning.
WORDS = {meaning: frozenset(text.split()) for meaning, text in _TABLES["words"].items()}
_LOADS = WORDS["wrench"] | WORDS["force"] | WORDS["moment"]
_ANGLES, _MOTIONS, _DIRECTIONS = (_TABLES[name] for name in ("angles", "motions", "directions"))
_COMPOUNDS = {word: role for role, text in _TABLES["compounds"].items() for word in text.split()}
_PHRASES = {phrase: role for role, names in _TABLES["phrases"].items() for phrase in names}
_GENERIC_FIELDS = ("data", "value")  # of topics of one number, named by the topic
_CODE = re.compile(r"(PTVEL[XYZ]|[A-Z]{4})[A-Z]{0,2}\d\d")  # of P01
_AXES = {"x": 0, "y": 1, "z": 2} | {str(index): index for index in range(6)}
_WRENCH_OF = dict(zip("uvwpqrxyzkmn", 2 * WRENCH.columns, strict=True))

#: Words before the unit N, and the unit: an axis of a force, or a force.
_FORCES = {*"xyz", "fx", "fy", "fz", *_MOTIONS, *WORDS["force"], "thrust"}
_NEWTONS = re.compile(r"[^\W_].*[^A-Za-z0-9]N\W*")

_PATH = re.compile(r"[./]")  # separates nested messages

_INDEX = re.compile(r"(?P<stem>.*[^\W\d_].*?)(?P<index>_\d|\[\d+\]|\(\d+(, ?\d+)?\))")

#: Reason of a column without a role.
NO_ROLE = "no role found"

#: A role and its confidence [%]; a reason and 0 if there is no role.
Hint = tuple[str, int]


def split_index(name: str) -> tuple[str, str]:
    """Return the name of an array and the index of its element, which is empty for a scalar."""
    match = _INDEX.fullmatch(name)
    return (match["stem"], match["index"]) if match else (name, "")


def element_of(field: str, siblings: Collection[str]) -> tuple[int, int] | None:
    """Return the index of a field in its array, from zero, and the size of the array; or None.

    A MATLAB row or column, `(3,1)`, is a vector; elements of a matrix have no single index.
    """
    stem, index = split_index(field)
    indices = [
        subscript for name, subscript in map(split_index, {*siblings, field}) if name == stem
    ]
    subscripts = [tuple(map(int, re.findall(r"\d+", text))) for text in indices if text]
    if not index or len({*map(len, subscripts)}) != 1:
        return None
    moving = [k for k, column in enumerate(zip(*subscripts, strict=True)) if len({*column}) > 1]
    if len(moving) > 1:
        return None
    axis = moving[0] if moving else 0
    first = min(subscript[axis] for subscript in subscripts) if moving and "[" not in index else 0
    return int(re.findall(r"\d+", index)[axis]) - min(first, 1), len(subscripts)


def words(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case."""
    spaced = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+", spaced.lower()) if word)


def split_unit(name: str) -> tuple[tuple[str, ...], str | None]:
    """Return the words of a name without its unit, and the unit; an index remains at the end."""
    stem, index = split_index(name)
    stem_words = words(stem)
    suffix = trailing_unit(stem_words)
    if suffix is None and _NEWTONS.fullmatch(stem) and stem_words[-2] in _FORCES:
        suffix = 1, "N"  # in other names `N` is a component, such as `tau_N`
    bare, unit = (stem_words, None) if suffix is None else (stem_words[: -suffix[0]], suffix[1])
    return (*bare, *words(index)), unit


def unit_of(topic: Topic, field: str) -> str | None:
    """Return the unit of a field, from the file, from its name, or of one number from its topic."""
    name = next(_names_of_field(topic.name, field))
    unit = parse_unit(topic.units.get(field, "")) or split_unit(name)[1]
    of_topic = split_unit(topic.name)[1]
    is_angle = of_topic in UNITS["angle"] and "linear" not in words(field)
    return of_topic if unit is None and is_angle else unit


def _names_of_field(topic: str, field: str) -> Iterator[str]:
    """Yield the name of a field; of a topic of one number its last part, then its last two."""
    levels = [level for level in _PATH.split(topic) if level]
    if code := _CODE.fullmatch(field):
        field = _TABLES["codes"].get(code[1], field)
    if field.lower() in _GENERIC_FIELDS and levels:
        yield from dict.fromkeys((levels[-1], "_".join(levels[-2:])))
    else:
        yield field


def guess_role(
    topic: str, field: str, unit: str | None, siblings: Collection[str] = (), stated: str = ""
) -> Hint:
    """Return the role that name and unit suggest, or the reason why none."""
    hints = [
        _guess_role(topic, name, unit, siblings if name == field else (name,), stated)
        for name in _names_of_field(topic, field)
    ]
    return next((hint for hint in hints if hint[1]), hints[0])


def _guess_role(
    topic: str, field: str, unit: str | None, siblings: Collection[str], stated: str
) -> Hint:
    name, topic_words = split_unit(field)[0], {*words(topic)}
    context = {*topic_words, *name}
    if excluded := context & WORDS["not_measured"] | {*name} & WORDS["not_measured_in_field"]:
        return f"not a measurement: {min(excluded)}", 0
    other_words = topic_words - WORDS["weather"] - WORDS["platform"] - WORDS["velocity"]
    if weather := ({*name} if other_words else context) & WORDS["weather"]:
        return f"of the weather or the sea: {min(weather)}", 0
    is_wrench = {"K", "M", "N"} <= {*siblings} or {"X", "Y", "N"} <= {*siblings}
    if field in WRENCH.columns and is_wrench:
        return f"wrench.{field}", 85
    stem = split_index(field)[0]
    setpoint = {*name} & WORDS["setpoint"] or _setpoint_suffix(stem, siblings)
    if setpoint and not {*name} & WORDS["commands"]:
        return f"a setpoint, not a measurement: {min(setpoint)}", 0
    bare, size = _without_qualifiers(name), 0
    is_alone = len({*split_unit(_PATH.split(field)[-1])[0]} - WORDS["qualifier"]) == 1
    if element := element_of(field, siblings):
        index, n_elements = element
        bare = (*_without_qualifiers(split_unit(stem)[0]), str(index))
        size = n_elements if n_elements > 1 else 0
    elif stem != field:
        return "an element of a matrix", 0
    guess = _role_of_words(bare, context, size, is_alone, siblings, field)
    if guess is None and split_unit(field)[1] == "rpm":
        guess = "commands", 80
    if guess is None and not context & WORDS["setpoint"]:
        guess = _body_velocity(bare, unit)
    if guess is None:
        setpoint = topic_words & WORDS["setpoint"]
        return f"a setpoint, not a measurement: {min(setpoint)}" if setpoint else NO_ROLE, 0
    topic_status = set() if context & {"output", "outputs"} else topic_words & WORDS["status"]
    if guess[0] == "commands" and (status := {*name} & WORDS["status"] | topic_status):
        return f"state of an actuator, not a command: {min(status)}", 0
    role, confidence = _velocity_axes(guess, context)
    quantity = quantity_of_role(role)
    if unit is None and quantity is not None and stated.casefold() not in NON_UNIT_WORDS:
        return f"in {stated}", 0
    if unit is None or quantity is None:
        return role, confidence
    return (role, min(95, confidence + 10)) if unit in UNITS[quantity] else (f"in {unit}", 0)


def _without_qualifiers(name: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(word for word in name if word not in WORDS["qualifier"]) or name


def _setpoint_suffix(stem: str, siblings: Collection[str]) -> set[str]:
    """Return the suffix of a setpoint (`psi_d`, `pd`), unless it means down next to north."""
    stem_words = words(stem)
    if len(stem_words) > 1 and stem_words[-1] in tuple("xyz"):
        stem_words = stem_words[:-1]
    last = stem_words[-1] if stem_words else ""
    is_desired = last in ("pd", "vd") or (last == "d" and len(stem_words) > 1)
    stems = {split_index(name)[0].casefold() for name in siblings}
    is_down = any(stem[:-1].casefold() + north in stems for north in ("n", "north"))
    return {last} if is_desired and not is_down else set()


def _velocity_axes(guess: Hint, context: set[str]) -> Hint:
    """Return the role of a linear velocity in the axes that its words name: body or world.

    A world velocity without named axes has the role velocity.x, y or z.
    """
    role, confidence = guess
    group, _, axis = role.partition(".")
    if group != "velocity" or axis not in tuple("uvw"):
        return guess
    index = "uvw".index(axis)
    if context & WORDS["body_axes"]:
        return role, confidence + 5 * ("body" in context)
    if worlds := context & _TABLES["worlds"].keys():
        return f"velocity.{_TABLES['worlds'][min(worlds)][index]}", confidence
    return (f"velocity.{'xyz'[index]}", confidence) if context & WORDS["earth_axes"] else guess


def quantity_of_role(role: str) -> str | None:
    """Return the quantity of a role; None if any is possible."""
    group, _, channel = role.partition(".")
    if group == "position":
        return quantity_of(group, channel) or "length"
    if group == "velocity" and channel in tuple("xyz"):
        return "speed"
    return quantity_of(group, channel) if channel else None


def _role_of_words(
    name: tuple[str, ...],
    context: set[str],
    size: int,
    is_alone: bool,
    siblings: Collection[str],
    field: str,
) -> Hint | None:
    """Return the role of a field from its words and the size of its array."""
    name_words, last = set(name), name[-1] if name else ""
    numbered = name_words | {word.rstrip("0123456789") for word in name}
    angle = next((_ANGLES[word] for word in name if word in _ANGLES), None)
    is_command = bool(numbered & WORDS["commands"])
    if name_words & WORDS["flag"] and angle is None:
        return ("commands" if is_command and name_words & WORDS["status"] else "flag"), 80
    if name_words & WORDS["wrench"] and (component := _wrench_component(name)):
        return f"wrench.{component}", 85
    loading = context if last in tuple("xyz") else name_words | context & WORDS["wrench"]
    is_load = last in _AXES and not context & WORDS["setpoint"] and loading & _LOADS
    if is_load and (guess := _vector_component(context - WORDS["velocity"], _AXES[last], size)):
        return guess
    if is_command:
        return "commands", 85
    is_setpoint = name_words & WORDS["setpoint"]
    if context & (WORDS["commands"] - {"control"}) and angle is None and not is_setpoint:
        return "commands", 75
    if context & WORDS["setpoint"]:
        return None
    if role := _role_of_phrase(name):
        return role, 75 if name_words & {"stw", "water"} else 80  # the course is over ground
    if angle is not None:
        if angle == "pitch" and _is_planar_pose(siblings):
            angle = "yaw"
        if name_words & WORDS["specific_force"]:
            return None  # an angular acceleration
        is_rate = name_words & (WORDS["angular_rate"] | WORDS["rate_of_angle"])
        if is_rate:
            return f"velocity.{_TABLES['rates'][angle]}", 80
        return f"attitude.{angle}", 75 if name_words & {"magnetic", "mag", "hdm"} else 85
    is_angle = context & WORDS["angle_vector"] - {"ang"} or "ang" in name_words
    if "attitude" in context and "angular" in name_words:
        is_angle = not any("orientation" in sibling for sibling in siblings)
    is_triple = last in tuple("xyz012") and size in (0, 3)
    if is_angle and is_triple and not context & WORDS["rate_of_angle"]:
        return None if "linear" in name_words else (f"attitude.{EULER[_AXES[last]]}", 80)
    if name_words & _MOTIONS.keys() and not name_words & WORDS["position"]:
        return f"velocity.{next(_MOTIONS[word] for word in name if word in _MOTIONS)}", 80
    if "rate" in context and is_alone and last in "rpy" and f"{field[:-1]}x" not in siblings:
        return f"velocity.{'pqr'['rpy'.index(last)]}", 75
    if context & WORDS["quaternion"]:
        if last in tuple("wxyz") and f"{field[:-1]}w" in siblings:
            return f"attitude.q{last}", 85
        if size == 4 and last in tuple("0123"):
            return f"attitude.q[{last}]", 60
    is_vector = last in _AXES and len(context) > 1
    if is_vector and (guess := _vector_component(context, _AXES[last], size)):
        return guess
    if last in _DIRECTIONS and not is_alone:
        group = "velocity" if name_words & WORDS["velocity"] else "position"
        return f"{group}.{_DIRECTIONS[last]}", 80
    if "depth" in name_words and not name_words & (WORDS["angular_rate"] | WORDS["velocity"]):
        return "position.depth", 75 if name_words & {"raw", "sensor"} else 85
    letters = [word for word in name if word in tuple("uvwpqr")]
    rate_words = WORDS["rate_of_angle"] if {*letters} <= {*"pqr"} else {"speed", "vel", "velocity"}
    if len(letters) == 1 < len(name) and name_words - {*letters} <= rate_words - {"dot"}:
        return f"velocity.{letters[0]}", 80
    if is_alone and last in "uvwpqr" and not context & WORDS["quaternion"] - {"q"}:
        return f"velocity.{last}", 85
    if last in _COMPOUNDS and not (last[0] == "a" and context & WORDS["position"]):
        return _COMPOUNDS[last], 80  # not the world acceleration of a position
    if len(name) == 1 and last in "xyz":
        return f"position.{last}", 60
    if is_alone and last == "n":  # propeller speed of ships
        return "commands", 60
    return (f"position.{last}", 75) if last in ("north", "east") else None


def _role_of_phrase(name: tuple[str, ...]) -> str | None:
    """Return the role of a whole name, with or without words of the vehicle and its receivers."""
    bare = [word for word in name if word.rstrip("0123456789") not in WORDS["platform"]]
    return _PHRASES.get(" ".join(name)) or _PHRASES.get(" ".join(bare))


def _is_planar_pose(siblings: Collection[str]) -> bool:
    """Return whether theta is the only angle with x and y, and so a yaw."""
    sibling_words = {word for name in siblings for word in words(name)}
    return {"x", "y"} <= sibling_words and not sibling_words & (_ANGLES.keys() - {"theta"})


def _body_velocity(name: tuple[str, ...], unit: str | None) -> Hint | None:
    """Return the role of a speed forward or sideways."""
    is_speed = unit in UNITS["speed"] or {*name} & WORDS["velocity"]
    sides = [_TABLES["body_directions"].get(word) for word in name] if is_speed else []
    return next(((f"velocity.{side}", 75) for side in sides if side), None)


def _wrench_component(name: tuple[str, ...]) -> str | None:
    """Return the component of a wrench from a name such as `tau_N` or `tau_surge`."""
    last = next((word for word in name[::-1] if word not in ("cmd", "command", "total")), "")
    axis = _MOTIONS.get(last) or _TABLES["rates"].get(last, last)
    return _WRENCH_OF.get(axis) if axis not in tuple("xyz") else None


def _vector_component(context: set[str], index: int, size: int) -> Hint | None:
    """Return the role of a component of a vector."""
    for kind, (confidence, roles) in _TABLES["vectors"].items():
        if matches := context & WORDS[kind]:
            if size == 3 and (planar := matches & _TABLES["planar"].keys()):
                return _TABLES["planar"][min(planar)][index], 65
            is_component = index < min(len(roles), size or 3)
            return (roles[index], confidence) if is_component and size in (0, 2, 3, 6) else None
    return None

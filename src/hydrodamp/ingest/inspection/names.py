"""Roles of columns from their names: words, unit suffixes, elements of vectors."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from pathlib import Path

import yaml

from hydrodamp.basis.term import check_command_name
from hydrodamp.data.channels import EULER, RESERVED, UNITS, WRENCH, parse_unit, trailing_unit
from hydrodamp.data.recording import Topic
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.mapping.channel_schema import quantity_of
from hydrodamp.ingest.mapping.columns import NON_UNIT_WORDS

_TABLES = yaml.safe_load(Path(__file__).with_name("words.yaml").read_text("utf-8"))
#: Words in names by their meaning.
WORDS = {meaning: frozenset(text.split()) for meaning, text in _TABLES["words"].items()}
_LOADS = WORDS["wrench"] | WORDS["force"] | WORDS["moment"]
_ANGLES, _MOTIONS, _DIRECTIONS = (_TABLES[name] for name in ("angles", "motions", "directions"))
_COMPOUNDS = {word: role for role, text in _TABLES["compounds"].items() for word in text.split()}
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
    """Return the unit of a field, from the file or from its name."""
    return parse_unit(topic.units.get(field, "")) or split_unit(field)[1]


def guess_role(
    topic: str, field: str, unit: str | None, siblings: Collection[str] = (), stated: str = ""
) -> Hint:
    """Return the role that name and unit suggest, or the reason why none."""
    name, topic_words = split_unit(field)[0], {*words(topic)}
    context = {*topic_words, *name}
    if excluded := context & WORDS["not_measured"] | {*name} & WORDS["not_measured_in_field"]:
        return f"not a measurement: {min(excluded)}", 0
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
        return "length"
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
    if name_words & WORDS["flag"] and angle is None:
        return "flag", 80
    if name_words & WORDS["wrench"] and (component := _wrench_component(name)):
        return f"wrench.{component}", 85
    loading = context if last in tuple("xyz") else name_words | context & WORDS["wrench"]
    is_load = last in _AXES and not context & WORDS["setpoint"] and loading & _LOADS
    if is_load and (guess := _vector_component(context - WORDS["velocity"], _AXES[last], size)):
        return guess
    if numbered & WORDS["commands"]:
        return "commands", 85
    is_setpoint = name_words & WORDS["setpoint"]
    if context & (WORDS["commands"] - {"control"}) and angle is None and not is_setpoint:
        return "commands", 75
    if context & WORDS["setpoint"]:
        return None
    if angle is not None:
        if name_words & WORDS["specific_force"]:
            return None  # an angular acceleration
        is_rate = name_words & (WORDS["angular_rate"] | {"speed"})
        return (f"velocity.{_TABLES['rates'][angle]}", 80) if is_rate else (f"attitude.{angle}", 85)
    is_angle = name_words & WORDS["angle_vector"] and not name_words & WORDS["rate_of_angle"]
    if is_angle and last in tuple("xyz012") and size in (0, 3):
        return f"attitude.{EULER[_AXES[last]]}", 80
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
    if is_alone and last in "uvwpqr" and not context & WORDS["quaternion"] - {"q"}:
        return f"velocity.{last}", 85
    if last in _COMPOUNDS and not (last[0] == "a" and context & WORDS["position"]):
        return _COMPOUNDS[last], 80  # not the world acceleration of a position
    if len(name) == 1 and last in "xyz":
        return f"position.{last}", 60
    if is_alone and last == "n":  # propeller speed of ships
        return "commands", 60
    return (f"position.{last}", 75) if last in ("north", "east") else None


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


YAML_KEYWORDS = frozenset(("y", "n", "yes", "no", "on", "off", "true", "false", "null", "none"))
_GENERIC = frozenset(["data", "value", "x", "y", "z", "output", "input", "xyz", "channels"])


def command_names(columns: Sequence[str], reserved: Collection[str] = ()) -> list[str]:
    """Return short names of commands that are valid in terms, none of the reserved."""
    names: dict[str, str] = {}
    for column in columns:
        topic, _, last = column.rpartition(".")
        is_generic = last.partition("[")[0].lower() in _GENERIC
        short = "/".join(topic.split("/")[-2:]) + f".{last}" if is_generic else last
        short = short.removesuffix(".data") if topic else short
        candidates = map(_valid_name, (short, column, *(f"{column}_{k}" for k in range(2, 99))))
        names[next(name for name in candidates if name not in (*names, *reserved))] = column
    return [*names]


def _valid_name(text: str) -> str:
    """Return a name that is valid in terms."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "command"
    name = f"c{name}" if name[0].isdigit() else name
    try:
        check_command_name(name)
    except HydrodampError:
        return f"{name}_command"
    return f"{name}_command" if name in RESERVED or name.lower() in YAML_KEYWORDS else name

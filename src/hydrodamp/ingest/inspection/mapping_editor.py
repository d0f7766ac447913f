"""Edits of the content of a mapping: role, unit and sign of a column, frame, and cleaning steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import yaml

from hydrodamp.conditioning.consistency import Fix
from hydrodamp.data.channels import UNITS
from hydrodamp.errors import LogError
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.draft_names import command_names
from hydrodamp.ingest.mapping.channel_schema import (
    CHANNEL_GROUPS,
    RECORDED_TIME,
    SINGLE_CHANNELS,
    quantity_of,
)

#: Role of commands; their names are those of the user.
COMMANDS = "commands"

Content = dict[str, Any]


class Assignment(NamedTuple):
    """The role of a column with its unit (empty: that of the channel), sign and channel."""

    column: str
    role: str
    unit: str = ""
    sign: int = 1
    channel: str = ""


class Slot(NamedTuple):
    """Where a mapping names a column: group, name in the group, and one of alternatives."""

    group: str
    name: str
    choice: Any

    @property
    def column(self) -> str:
        """Column of the choice, empty for a constant."""
        named = self.choice.get("column") if isinstance(self.choice, dict) else self.choice
        return named if isinstance(named, str) else ""

    @property
    def role(self) -> str:
        """Role of the column."""
        return self.group if self.group in (COMMANDS, *SINGLE_CHANNELS) else self.label

    @property
    def label(self) -> str:
        """Group and name."""
        return f"{self.group}.{self.name}"


def roles() -> dict[str, list[str]]:
    """Return the roles by group, as ``group.name``."""
    groups = {"": ["", "time", *(name for name in SINGLE_CHANNELS if name != "time")]}
    groups |= {
        group: [f"{group}.{name}" for name in names] for group, names in CHANNEL_GROUPS.items()
    }
    return {**groups, COMMANDS: [COMMANDS]}


def units_of(role: str) -> list[str]:
    """Return the units that a role can have, the default first."""
    group, _, name = role.partition(".")
    quantity = quantity_of(group, name)
    return [] if quantity is None else ["", *UNITS.get(quantity, ())]


def parse_content(text: str, source: str) -> Content:
    """Return the content of the text of a mapping."""
    content = parse_yaml(text, source) if text.strip() else {}
    if not isinstance(content, dict):
        raise LogError(["a mapping must be keys and values, such as `time: t`"], source=source)
    return content


def format_content(content: Content) -> str:
    """Return the text of a mapping."""
    return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=100))


def assignments(content: Mapping[str, Any]) -> Iterator[Assignment]:
    """Yield the assignments of columns, the first of alternatives."""
    slots = set()
    for slot in _slots(content):
        if slot.column and (slot.group, slot.name) not in slots:
            slots.add((slot.group, slot.name))
            options = slot.choice if isinstance(slot.choice, dict) else {}
            sign = -1 if options.get("sign") == -1 else 1
            unit = str(options.get("unit") or "")
            yield Assignment(slot.column, slot.role, unit, sign, slot.name or slot.group)


def _slots(content: Mapping[str, Any]) -> Iterator[Slot]:
    """Yield all columns that a mapping names, alternatives in order."""
    for group, value in content.items():
        if group in SINGLE_CHANNELS:
            if value != RECORDED_TIME:
                yield from (Slot(group, "", choice) for choice in _choices(value))
        elif group == COMMANDS or group in CHANNEL_GROUPS:
            for name, entry in _table(value).items():
                yield from (Slot(group, name, choice) for choice in _choices(entry))


def _choices(value: Any) -> list[Any]:
    return value if isinstance(value, list) else [] if value is None else [value]


def _table(value: Any) -> dict[str, Any]:
    """Return a group as a table; a list of commands has their names."""
    if isinstance(value, dict):
        return {str(name): entry for name, entry in value.items()}
    names = value if isinstance(value, list) else []
    return {name: name for name in names if isinstance(name, str)}


def assign(
    content: Content,
    new: Assignment,
    inherited: Mapping[str, Any] = MappingProxyType({}),
    **more: object,
) -> Content:
    """Return the content with a column in one role; an empty role removes the column.

    Other keys of the entry, such as scale and delay, stay unless ``more`` changes them, and so does
    the name of a command.
    ``inherited`` is the content with `extends` resolved; what it has alone is set to null.
    """
    known = next((slot for slot in _slots(content) if slot.column == new.column), None)
    known = known or next((slot for slot in _slots(inherited) if slot.column == new.column), None)
    options = dict(known.choice) if known and isinstance(known.choice, dict) else {}
    options = {"column": new.column, **_without(options, "unit", "sign"), **more}
    options |= {"unit": new.unit} if new.unit else {}
    options |= {"sign": -1} if new.sign < 0 else {}
    entry: Any = new.column if len(options) == 1 else options
    changed = dict(content)
    if known is not None and known.role == new.role:
        return _replace(changed, known, entry)
    if known is not None:
        changed = _replace(changed, known, None)
        if known in [*_slots(inherited)] and known not in [*_slots(content)]:
            changed[known.group] = {**_table(changed.get(known.group)), known.name: None}
    group, _, name = new.role.partition(".")
    if not new.role:
        return changed
    if group == COMMANDS:
        reserved = _table(inherited.get(COMMANDS, changed.get(COMMANDS)))
        (name,) = command_names([new.column], reserved)
    changed[group] = {**_table(changed.get(group)), name: entry} if name else entry
    return changed


def _replace(content: Content, slot: Slot, entry: Any) -> Content:
    """Return the content with another choice in a slot, None to remove it."""
    if not slot.name:
        return _set(content, slot.group, _replace_choice(content.get(slot.group), slot, entry))
    table = _table(content.get(slot.group))
    choice = _replace_choice(table.get(slot.name), slot, entry)
    return _set(content, slot.group, _set(table, slot.name, choice))


def _replace_choice(value: Any, slot: Slot, entry: Any) -> Any:
    """Return alternatives with another one in place of that of a slot."""
    if not isinstance(value, list):
        return entry
    replaced = [entry if choice == slot.choice else choice for choice in value]
    remaining = [choice for choice in replaced if choice is not None]
    return remaining or None


def _set(table: Content, key: str, value: Any) -> Content:
    """Return a table with a value at a key, without the key where nothing is left."""
    return _without(table, key) if value in (None, {}) else {**table, key: value}


def set_frame(content: Content, frame: str, world: str) -> Content:
    """Return the content with the axes of the body and of the world."""
    return {"frame": frame, "world": world, **_without(content, "frame", "world")}


def add_step(content: Content, step: str) -> Content:
    """Return the content with one more cleaning step, such as ``remove_outliers: {...}``."""
    parsed = parse_yaml(f"[{step}]", "step")
    added = parsed if isinstance(parsed, list) else []
    return {**content, "steps": [*_choices(content.get("steps")), *added]}


def correct(content: Content, fix: Fix, channels: Sequence[str], displayed: Content) -> Content:
    """Return the content with a correction of channels."""
    if fix.kind in ("step", "option"):
        return add_step(content, fix.value)
    if fix.kind == "frame":
        return set_frame(content, fix.value, "NWU")
    names = fix.value.split() if fix.kind == "omit" else channels
    for each in assignments(displayed):
        if each.channel not in names:
            continue
        delay = {"delay": float(fix.value)} if fix.kind == "delay" else {}
        new = each._replace(
            role="" if fix.kind == "omit" else each.role,
            unit=fix.value if fix.kind == "unit" else each.unit,
            sign=-each.sign if fix.kind == "sign" else each.sign,
        )
        content = assign(content, new, displayed, **delay)
    return content


def add_commands(content: Content, columns: Mapping[str, str]) -> Content:
    """Return the content with further commands of columns."""
    table = {**_table(content.get(COMMANDS)), **columns}
    return {**content, COMMANDS: table} if table else content


def mix_commands(content: Content, name: str, first: str, second: str, weight: int) -> Content:
    """Return the content with a command made of another, or of the mean of two, weighted."""
    table = _table(content.get(COMMANDS))
    known = {each.channel: each for each in assignments({COMMANDS: table})}
    entry = table[first] if isinstance(table[first], dict) else {"column": table[first]}
    scale = entry.get("scale", 1.0)
    if second:
        addend = table[second] if isinstance(table[second], dict) else {}
        share = weight * addend.get("scale", 1.0) * addend.get("sign", 1) * entry.get("sign", 1)
        plus = {known[second].column: 0.5 * share}
        entry = {**entry, "scale": 0.5 * scale, "plus": plus}
    elif weight < 0:
        entry = {**entry, "sign": -entry.get("sign", 1)}
    return {**content, COMMANDS: {**table, name: entry}}


def _without(content: Mapping[str, Any], *names: str) -> Content:
    return {key: value for key, value in content.items() if key not in names}

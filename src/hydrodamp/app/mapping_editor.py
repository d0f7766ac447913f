"""Edits of the content of a mapping: role, unit and sign of a column, frame, and cleaning steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import yaml

from hydrodamp.data.channels import UNITS
from hydrodamp.errors import LogError
from hydrodamp.files import parse_yaml
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
    """The role of a column with its unit (empty: that of the channel) and sign."""

    column: str
    role: str
    unit: str = ""
    sign: int = 1


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
    """Yield the assignments of columns."""
    for group, value in content.items():
        if group in SINGLE_CHANNELS:
            if value != RECORDED_TIME:
                yield from _assignment(group, value)
        elif group == COMMANDS:
            entries = {name: name for name in value} if isinstance(value, list) else value or {}
            for entry in entries.values():
                yield from _assignment(COMMANDS, entry)
        elif group in CHANNEL_GROUPS and isinstance(value, dict):
            for name, entry in value.items():
                if name != "quaternion":
                    yield from _assignment(f"{group}.{name}", entry)
                elif column := entry.get("column") if isinstance(entry, dict) else entry:
                    yield Assignment(str(column), "attitude.quaternion")


def _assignment(role: str, value: Any) -> Iterator[Assignment]:
    first = value[0] if isinstance(value, list) and value else value
    if isinstance(first, str):
        yield Assignment(first, role)
    elif isinstance(first, dict) and first.get("column"):
        sign = -1 if first.get("sign") == -1 else 1
        yield Assignment(str(first["column"]), role, str(first.get("unit") or ""), sign)


def assign(content: Content, new: Assignment) -> Content:
    """Return the content with a column in one role; an empty role removes the column."""
    changed = dict(content)
    for group in [*changed]:
        value = changed[group]
        if group in SINGLE_CHANNELS and _is_column(value, new.column):
            del changed[group]
        elif group == COMMANDS:
            entries = (
                {name: name for name in value} if isinstance(value, list) else dict(value or {})
            )
            changed[group] = {k: v for k, v in entries.items() if not _is_column(v, new.column)}
        elif group in CHANNEL_GROUPS and isinstance(value, dict):
            remaining = {k: v for k, v in value.items() if not _is_column(v, new.column)}
            changed[group] = remaining
    if new.role:
        entry: Any = {"column": new.column}
        entry |= {"unit": new.unit} if new.unit else {}
        entry |= {"sign": -1} if new.sign < 0 else {}
        entry = new.column if len(entry) == 1 else entry
        group, _, name = new.role.partition(".")
        if group == COMMANDS:
            commands = dict(changed.get(COMMANDS) or {})
            commands[command_name(new.column, commands)] = entry
            changed[COMMANDS] = commands
        elif name:
            changed[group] = {**(changed.get(group) or {}), name: entry}
        else:
            changed[group] = entry
    return {key: value for key, value in changed.items() if value not in ({}, [], None)}


def command_name(column: str, taken: Mapping[str, object]) -> str:
    """Return a name of a command for a column: letters, digits and underscores."""
    plain = "".join(each if each.isalnum() and each.isascii() else "_" for each in column)
    name = plain if plain and not plain[0].isdigit() else f"c_{plain}"
    name, number = name.strip("_") or "command", 1
    base = name
    while name in taken:
        number += 1
        name = f"{base}_{number}"
    return name


def _is_column(value: Any, column: str) -> bool:
    return any(each.column == column for each in _assignment("", value))


def set_frame(content: Content, frame: str, world: str) -> Content:
    """Return the content with the axes of the body and of the world."""
    return {"frame": frame, "world": world, **_without(content, "frame", "world")}


def add_step(content: Content, step: str) -> Content:
    """Return the content with one more cleaning step, such as ``remove_outliers: {...}``."""
    parsed = parse_yaml(f"[{step}]", "step")
    added = (
        [each for each in parsed if isinstance(parsed, list)] if isinstance(parsed, list) else []
    )
    return {**content, "steps": [*(content.get("steps") or []), *added]}


def _without(content: Content, *names: str) -> Content:
    return {key: value for key, value in content.items() if key not in names}

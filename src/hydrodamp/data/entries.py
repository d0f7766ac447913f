"""The entries of a mapping file, checked key by key."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.basis.command_names import check_command_name
from hydrodamp.data.columns import ACCELERATIONS, EULER, QUATERNION
from hydrodamp.data.units import factor
from hydrodamp.errors import LogError, TermError, did_you_mean

FRAMES = ("FRD", "FLU")
"""Axes a log may have; the first is ours."""

_GROUPS: dict[str, dict[str, str]] = {
    "attitude": dict.fromkeys(EULER, "angle") | dict.fromkeys(QUATERNION, "ratio"),
    "velocity": dict.fromkeys(VELOCITIES[:3], "speed")
    | dict.fromkeys(VELOCITIES[3:], "angular rate"),
    "acceleration": dict.fromkeys(ACCELERATIONS[:3], "acceleration")
    | dict.fromkeys(ACCELERATIONS[3:], "angular acceleration"),
    "wrench": dict.fromkeys(AXES[:3], "force") | dict.fromkeys(AXES[3:], "moment"),
}
_SINGLE = {"time": "time", "eta": "ratio"}
_KEYS = ("frame", *_SINGLE, "segment", *_GROUPS, "commands", "source", "note")
_ENTRY_KEYS = ("column", "unit", "sign", "hold")


@dataclass(frozen=True)
class Entry:
    """One column of a log and what becomes of it.

    Attributes
    ----------
    name : str
        The canonical column or the command it becomes.
    column : str
        Its name in the log.
    factor : float
        Unit to SI, times sign.
    hold : bool
        Whether an empty cell keeps the value before it.
    is_command : bool
        Whether it is a command; commands know no frame.
    """

    name: str
    column: str
    factor: float = 1.0
    hold: bool = False
    is_command: bool = False


def entries_of(content: object) -> tuple[tuple[Entry, ...], list[str]]:
    """Return the entries of a mapping and everything wrong with it.

    Parameters
    ----------
    content : object
        What the YAML file holds.

    Returns
    -------
    entries : tuple of Entry
        Those that could be understood.
    faults : list of str
        One sentence each, with the place in the file.
    """
    if not isinstance(content, dict):
        return (), [f"a mapping must be a table of names to columns; got {_kind(content)}"]
    faults = [*_key_faults(content)]
    entries = []
    for place, name, quantity, given in _given(content, faults):
        entry, wrong = _entry(place, name, quantity, given)
        entries.append(entry)
        faults += wrong
    return tuple(entries), faults


def _key_faults(content: dict[Any, Any]) -> Iterator[str]:
    for key in content:
        if key not in _KEYS:
            yield f"unknown key `{key}`.{did_you_mean(str(key), _KEYS)} Keys are: {' '.join(_KEYS)}"
    frame = content.get("frame", FRAMES[0])
    if frame not in FRAMES:
        yield f"`frame` must be FRD (z down) or FLU (z up); got {frame!r}"
    if "time" not in content:
        yield "`time` must name the column of the clock; it is missing"
    if not content.get("velocity"):
        yield "`velocity` must name the columns of at least one of u v w p q r; it is missing"
    if not isinstance(content.get("segment", ""), str):
        yield f"`segment` must be the name of a column; got {content['segment']!r}"


def _given(
    content: dict[Any, Any], faults: list[str]
) -> Iterator[tuple[str, str, str | None, object]]:
    """Yield place, name, quantity and content of every entry; note groups that are none."""
    for name, quantity in _SINGLE.items():
        if name in content:
            yield name, name, quantity, content[name]
    for group in (*_GROUPS, "commands"):
        known = _GROUPS.get(group)
        table = content.get(group) or {}
        if known is None and isinstance(table, list):
            table = {str(name): name for name in table}
        if not isinstance(table, dict):
            faults.append(f"`{group}` must be a table of names to columns; got {_kind(table)}")
            continue
        for name, given in table.items():
            if known is None or name in known:
                yield f"{group}.{name}", str(name), None if known is None else known[name], given
            else:
                near = did_you_mean(str(name), known)
                faults.append(f"`{group}` has no `{name}`.{near} It takes: {' '.join(known)}")


def _entry(place: str, name: str, quantity: str | None, given: object) -> tuple[Entry, list[str]]:
    """Return one entry and what is wrong with it."""
    table: dict[Any, Any] = given if isinstance(given, dict) else {"column": given}
    takes = f"It takes: {' '.join(_ENTRY_KEYS)}"
    faults = [
        f"`{place}` has no `{key}`.{did_you_mean(str(key), _ENTRY_KEYS)} {takes}"
        for key in table
        if key not in _ENTRY_KEYS
    ]
    column: object = table.get("column")
    sign, hold = table.get("sign", 1), table.get("hold", False)
    if not isinstance(column, str):
        faults.append(f"`{place}` must name a column; got {column!r}")
    if sign not in (1, -1) or isinstance(sign, bool):
        faults.append(f"`{place}.sign` must be 1 or -1; got {sign!r}")
    if not isinstance(hold, bool):
        faults.append(f"`{place}.hold` must be true or false; got {hold!r}")
    scale = 1.0
    try:
        scale = factor(str(table["unit"]), quantity) if "unit" in table else 1.0
    except LogError as error:
        faults.append(f"`{place}.unit`: {error}")
    if is_command := place.startswith("commands."):
        faults += _name_faults(place, name)
    scale *= 1.0 if faults else sign
    return Entry(name, str(column), scale, hold is True, is_command), faults


def _name_faults(place: str, name: str) -> list[str]:
    try:
        check_command_name(name)
    except TermError as error:
        return [f"`{place}`: {error}"]
    return []


def _kind(content: object) -> str:
    return "nothing" if content is None else type(content).__name__

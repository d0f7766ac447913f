"""The entries of a mapping: where each channel stands, and what becomes of its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hydrodamp.ingest.mapping.channels import DOWNWARD, GROUPS, quantity_of

if TYPE_CHECKING:
    from hydrodamp.ingest.mapping.schema import (
        ConstantForm,
        EntryForm,
        MappingForm,
        QuaternionForm,
    )

RECORDED = "recorded"
"""What `time` says where topics have a clock of their own."""


@dataclass(frozen=True)
class Source:
    """One place in a log, and what becomes of the numbers there."""

    column: str
    scale: float = 1.0
    offset: float = 0.0
    plus: tuple[tuple[str, float], ...] = ()
    unit: str | None = None
    sign: int = 1
    hold: bool | None = None
    delay: float = 0.0
    where: tuple[tuple[str, float | None], ...] = ()
    optional: bool = False
    value: float | None = None


@dataclass(frozen=True)
class Entry:
    """One channel of a mapping."""

    group: str
    name: str
    choices: tuple[Source, ...]
    quantity: str | None = None

    @property
    def column(self) -> str:
        """Its first choice of a column."""
        return self.choices[0].column

    @property
    def is_command(self) -> bool:
        """Whether it is a command; commands know no axes."""
        return self.group == "commands"


def entries_of(form: MappingForm) -> tuple[Entry, ...]:
    """Return the entries of a mapping file."""
    singles = {"time": form.time, "eta": form.eta}
    groups: dict[str, Mapping[str, Any]] = {
        name: dict(getattr(form, name) or {}) for name in GROUPS
    }
    commands = form.commands or {}
    groups["commands"] = {n: n for n in commands} if isinstance(commands, list) else commands
    entries = [_entry(name, name, given) for name, given in singles.items() if given is not None]
    for group, channels in groups.items():
        for name, given in channels.items():
            if given is None:
                continue
            if name == "quaternion":
                entries += _quaternion(given)
            else:
                entries.append(_entry(group, name, given))
    return tuple(entries)


def _entry(group: str, name: str, given: Any) -> Entry:
    called, sign = DOWNWARD.get(name, (name, 1)) if group != "commands" else (name, 1)
    choices = given if isinstance(given, list) else [given]
    sources = tuple(_source(one, int(sign)) for one in choices)
    return Entry(group, called, sources, quantity_of(group, name))


def _source(given: str | EntryForm | ConstantForm, sign: int) -> Source:
    if isinstance(given, str):
        return Source(given, sign=sign)
    content = given.model_dump()
    if "value" in content:
        return Source("", sign=sign, unit=content["unit"], value=content["value"])
    where = content.pop("where") or {}
    conditions = {where: None} if isinstance(where, str) else where
    content["sign"] *= sign
    content["plus"] = tuple(content["plus"].items())
    return Source(**content, where=tuple(conditions.items()))


def _quaternion(form: QuaternionForm) -> Iterator[Entry]:
    for part in "wxyz":
        tail = f".{part}" if form.order is None else f"[{form.order.index(part)}]"
        yield Entry("attitude", f"q{part}", (Source(f"{form.column}{tail}"),), "ratio")

"""The messages that describe the messages of an ArduPilot log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

FMT_TYPE = 128
"""The type of the messages that describe the others."""

FMT_LENGTH = 89
"""How long they are, with the mark of three bytes that every message has."""

_KINDS: dict[str, tuple[str, float]] = {
    "a": ("32<i2", 1.0),
    "b": ("i1", 1.0),
    "B": ("u1", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "g": ("<f2", 1.0),
    "n": ("S4", 1.0),
    "N": ("S16", 1.0),
    "Z": ("S64", 1.0),
    "c": ("<i2", 100.0),
    "C": ("<u2", 100.0),
    "e": ("<i4", 100.0),
    "E": ("<u4", 100.0),
    "L": ("<i4", 1e7),
    "M": ("u1", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
}
"""NumPy type and divisor of every letter of a format (ArduPilot, LogStructure.h)."""

# The field that numbers the sensors of one kind, where a log does not state it (LogStructure.h).
_INSTANCES = {"XKF": "C", "NKF": "C", "IMU": "I", "ACC": "I", "GYR": "I"}

_PREFIXES = {0.1: "d", 0.01: "c", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}


@dataclass(frozen=True)
class MessageFormat:
    """How messages of one type are laid out."""

    type: int
    name: str
    length: int
    letters: str
    columns: tuple[str, ...]

    @property
    def row(self) -> np.dtype[Any] | None:
        """The NumPy type of one message; None where letters, names and length disagree."""
        if len(self.letters) != len(self.columns) or len(set(self.columns)) < len(self.columns):
            return None
        if any(letter not in _KINDS for letter in self.letters):
            return None
        body = [
            (name, _KINDS[letter][0])
            for name, letter in zip(self.columns, self.letters, strict=True)
        ]
        row = np.dtype([("", "V3"), *body])
        return row if row.itemsize == self.length else None

    def divisor(self, name: str) -> float:
        """Return what turns the stored whole number into the value."""
        return _KINDS[self.letters[self.columns.index(name)]][1]


def format_of(message: bytes) -> MessageFormat:
    """Return the format that a message describes."""
    name, letters, columns = (
        text.partition(b"\0")[0].decode("ascii", errors="replace")
        for text in (message[5:9], message[9:25], message[25:89])
    )
    return MessageFormat(message[3], name, message[4], letters, _names(columns))


def _names(columns: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in columns.split(",")) if columns else ()


def text_format(cells: Sequence[str]) -> MessageFormat | None:
    """Return the format that a line of a log in text describes."""
    if len(cells) < 5 or not (cells[1].isdigit() and cells[2].isdigit()):
        return None
    return MessageFormat(int(cells[1]), cells[3], int(cells[2]), cells[4], tuple(cells[5:]))


@dataclass(frozen=True)
class Units:
    """Units and instance fields, as the log states them."""

    by_type: dict[int, tuple[str, str]]
    labels: dict[str, str]
    multipliers: dict[str, float]

    def instance(self, form: MessageFormat) -> str:
        """Return the field that numbers the sensors of one kind; empty for none."""
        if form.type not in self.by_type:
            known = _INSTANCES.get(form.name.rstrip("0123456789"), "")
            return known if known in form.columns else ""
        place = self.by_type[form.type][0].find("#")
        return form.columns[place] if 0 <= place < len(form.columns) else ""

    def of(self, form: MessageFormat) -> dict[str, str]:
        """Return the units of the fields that have one."""
        letters, scales = self.by_type.get(form.type, ("", ""))
        units = {}
        for place, (name, letter) in enumerate(zip(form.columns, letters, strict=False)):
            label = self.labels.get(letter, "")
            if not label or letter == "#":
                continue
            scaled = form.divisor(name) != 1.0 or place >= len(scales)
            multiplier = 1.0 if scaled else self.multipliers.get(scales[place], 1.0)
            units[name] = _prefixed(label, multiplier)
        return units


def _prefixed(label: str, multiplier: float) -> str:
    if multiplier in (0.0, 1.0):
        return label
    near = next((unit for unit in _PREFIXES if abs(unit / multiplier - 1) < 1e-6), None)
    return f"{multiplier:.4g} {label}" if near is None else _PREFIXES[near] + label

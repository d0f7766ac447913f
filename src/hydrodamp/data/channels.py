"""The table of channels of a log: names, columns and units; factors and spellings of units.

`Log`, canonical files, mappings, checks, the summary and cleaning derive their lists from
:data:`BLOCKS`. Commands are not in it: each log names its own.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.errors import LogError, did_you_mean

_TABLES = tomllib.loads(Path(__file__).with_name("units.toml").read_text("utf-8"))
#: For every quantity its units, the SI unit first, and the factor that turns each into SI.
UNITS: dict[str, dict[str, float]] = _TABLES["factors"]
_SPELLINGS: dict[str, str] = {
    spelling: unit for unit, text in _TABLES["spellings"].items() for spelling in text.split()
}
_WITHOUT_FACTOR, _NOT_IN_NAMES = (
    frozenset(_TABLES["names"][name].split()) for name in ("without_factor", "not_in_names")
)
#: A negative power at the end of a product, as in `m s-1` or `rad.s**-2`.
_INVERSE = re.compile(r"[\s.*·]*(s|sec|second|min|h|hr)(?:\^|\*\*)?-([12])$")
_SUPERSCRIPTS = str.maketrans("⁻¹²", "-12")


def si_unit(quantity: str) -> str:
    """Return the SI unit of a quantity."""
    return next(iter(UNITS[quantity]))


def unit_factor(unit: str, quantity: str | None = None) -> float:
    """Return the factor that turns a unit, in any spelling, into SI."""
    known = _known_units(quantity)
    if (canonical := parse_unit(unit, quantity)) is None:
        of = f"of {quantity} " if quantity else ""
        fault = f"'{unit}' is no unit {of}known here.{did_you_mean(unit, known)}"
        raise LogError(f"{fault} Known are: {', '.join(known)}")
    return known[canonical]


def parse_unit(text: str, quantity: str | None = None) -> str | None:
    """Return the unit of a spelling; None if it is unknown."""
    known = _known_units(quantity)
    plain = _strip_brackets(text)
    if plain in known:
        return plain
    if len(plain) == 1 and plain != "°":  # single letters are case-sensitive: v is not volt
        return None
    quotient = _INVERSE.sub(r"/\1^\2", plain.casefold().translate(_SUPERSCRIPTS))
    quotient = f"1{quotient}" if quotient.startswith("/") else quotient
    terms = re.split("/| per ", _canonical_spelling(quotient.removesuffix("^1")))
    squared = re.sub(r"/s(/s|2|²|\*\*2)$", "/s^2", "/".join(map(_canonical_spelling, terms)))
    return {name.casefold(): name for name in reversed(known)}.get(squared.casefold())


def is_unit(word: str) -> bool:
    """Return whether a word is a unit."""
    plain = _strip_brackets(word)
    if len(plain) == 1:
        return plain in _WITHOUT_FACTOR or (plain != "1" and parse_unit(plain) is not None)
    folded = plain.casefold()
    is_listed = not _WITHOUT_FACTOR.isdisjoint((folded, folded.removesuffix("s")))
    return is_listed or parse_unit(plain) is not None


def trailing_unit(words: Sequence[str]) -> tuple[int, str] | None:
    """Return the number of words of the unit at the end of a name, and the unit."""
    for count in (2, 1):
        tail = words[len(words) - count :]
        if len(words) > count and tail[0] not in _NOT_IN_NAMES:
            rate = count == 1 and tail[0] in ("rads", "degs")  # as in `gyro_rads`
            if unit := parse_unit(f"{tail[0][:-1]}/s" if rate else "/".join(tail)):
                return count, unit
    return None


def _known_units(quantity: str | None) -> dict[str, float]:
    tables = UNITS.values() if quantity is None else (UNITS[quantity],)
    return {name: value for table in tables for name, value in table.items()}


def _strip_brackets(text: str) -> str:
    return text.strip().strip("[]()").strip()


def _canonical_spelling(part: str) -> str:
    folded = part.strip()
    return _SPELLINGS.get(folded, _SPELLINGS.get(folded.removesuffix("s"), folded))


@dataclass(frozen=True)
class Block:
    """An array of a log with one entry a sample: one number, or several side by side."""

    name: str  # the attribute of Log, and the group of a mapping
    quantities: Mapping[str, str]  # of every column, in order; keys of UNITS
    is_sensed: bool = False  # written by a sensor: cleaning may replace single samples
    is_whole: bool = False  # a file holds all of its columns or none

    @property
    def columns(self) -> tuple[str, ...]:
        """What its columns are called in files."""
        return tuple(self.quantities)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one entry."""
        return () if len(self.quantities) == 1 else (len(self.quantities),)


def _six_quantities(names: tuple[str, ...], linear: str, angular: str) -> dict[str, str]:
    """Return the quantities of three linear and three angular components."""
    return dict(zip(names, [linear] * 3 + [angular] * 3, strict=True))


TIME = Block("time", {"time": "time"})
ATTITUDE = Block("attitude", dict.fromkeys(("qw", "qx", "qy", "qz"), "ratio"), is_whole=True)
VELOCITY = Block("velocity", _six_quantities(VELOCITIES, "speed", "angular rate"), is_sensed=True)
_DERIVATIVES = tuple(f"d{name}" for name in VELOCITIES)
ACCELERATION = Block(
    "acceleration",
    _six_quantities(_DERIVATIVES, "acceleration", "angular acceleration"),
    is_sensed=True,
)
PROPULSION_RATIO = Block("propulsion_ratio", {"eta": "ratio"})
WRENCH = Block("wrench", _six_quantities(AXES, "force", "moment"))
POSITION = Block(
    "position", dict.fromkeys(("north", "east", "down"), "length"), is_sensed=True, is_whole=True
)
_FORCES = dict.fromkeys(("fx", "fy", "fz"), "acceleration")
SPECIFIC_FORCE = Block("specific_force", _FORCES, is_sensed=True, is_whole=True)

#: All blocks but the commands, in the order of the columns of a canonical file.
BLOCKS = (
    *(TIME, ATTITUDE, VELOCITY, ACCELERATION),
    *(PROPULSION_RATIO, WRENCH, POSITION, SPECIFIC_FORCE),
)

#: The attitude as angles, which a file may hold instead of the quaternion.
EULER = ("roll", "pitch", "yaw")

#: The column of labels: a change of label is a join.
SEGMENT = "segment"

#: The quantity of every reserved column of numbers.
QUANTITIES: dict[str, str] = {
    **TIME.quantities,
    **dict.fromkeys(EULER, "angle"),
    **{name: quantity for block in BLOCKS[1:] for name, quantity in block.quantities.items()},
}

#: Columns with a meaning of their own; any other is a command.
RESERVED = (*QUANTITIES, SEGMENT)


def unit_of(column: str) -> str:
    """Return the SI unit of a reserved column."""
    return si_unit(QUANTITIES[column])

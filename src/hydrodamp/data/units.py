"""Units: factors to SI, and their spellings in files."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

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
    terms = re.split("/| per ", _canonical_spelling(plain.casefold()))
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

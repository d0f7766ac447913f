"""Units: factors to SI, and their spellings in files."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from hydrodamp.errors import LogError, did_you_mean

_DEGREE = math.pi / 180
_FOOT = 0.3048  # m, international foot
_MILE = 1852.0  # m, nautical
_KNOT = _MILE / 3600  # m/s
_POUND_FORCE = 4.4482216152605  # N
_GRAVITY = 9.80665  # m/s^2, standard

#: For every quantity its units, the SI unit first, and the factor that turns each into SI.
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0},
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1e3, "ft": _FOOT, "nmi": _MILE},
    "angle": {"rad": 1.0, "deg": _DEGREE, "cdeg": _DEGREE / 100, "rev": 2 * math.pi},
    "speed": {
        "m/s": 1.0,
        "cm/s": 0.01,
        "mm/s": 0.001,
        "km/h": 1 / 3.6,
        "knots": _KNOT,
        "kn": _KNOT,
        "ft/s": _FOOT,
    },
    "angular rate": {
        "rad/s": 1.0,
        "mrad/s": 1e-3,
        "deg/s": _DEGREE,
        "rpm": 2 * math.pi / 60,
        "rev/s": 2 * math.pi,
    },
    "acceleration": {"m/s^2": 1.0, "g": _GRAVITY, "mg": _GRAVITY / 1000},
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": _DEGREE},
    "force": {"N": 1.0, "kN": 1e3, "lbf": _POUND_FORCE, "kgf": _GRAVITY},
    "moment": {"N m": 1.0, "kN m": 1e3, "lbf ft": _POUND_FORCE * _FOOT},
    "ratio": {"1": 1.0, "%": 0.01},
}

# Other spellings, small and in the singular, of units and of the parts of a quotient.
_SPELLING_TABLE = """
s: second sec
min: minute
h: hour hr
ms: millisecond msec
us: microsecond usec μs
ns: nanosecond nsec
m: metre meter
ft: foot feet
rad: radian
deg: degree ° degheading
m/s: mps
m/s^2: mps2 ms2
kn: knot kt
rad/s: radps
deg/s: degps dps
rev/s: rps
rpm: rev/min revs/min 1/min
N: newton
N m: nm n*m n.m n·m
%: percent
"""
_SPELLINGS = {
    spelling: unit
    for unit, listed in (line.split(": ") for line in _SPELLING_TABLE.strip().splitlines())
    for spelling in listed.split()
}

# Units in headers that no quantity of a log has.
_NO_QUANTITY = """
- K C A V W T bool boolean raw none count pwm 1/s hz khz pa hpa kpa mbar bar dbar psi mv volt
ma amp watt °c degc kg kg/m3 g/cc psu ppt gauss mgauss tesla ut μt
"""
_WITHOUT_FACTOR = frozenset(_NO_QUANTITY.split())

# Units that mean something else as the last word of a column name.
_NOT_IN_NAMES = frozenset(["1", "%", "g", "h", "min", "rev", "n"])


def si_unit(quantity: str) -> str:
    """Return the SI unit of a quantity."""
    return next(iter(UNITS[quantity]))


def unit_factor(unit: str, quantity: str | None = None) -> float:
    """Return the factor that turns a unit, in any spelling, into SI."""
    known = _known_units(quantity)
    canonical = parse_unit(unit, quantity)
    if canonical is None:
        of = f"of {quantity} " if quantity else ""
        raise LogError(
            f"'{unit}' is no unit {of}known here.{did_you_mean(unit, known)}"
            f" Known are: {', '.join(known)}"
        )
    return known[canonical]


def parse_unit(text: str, quantity: str | None = None) -> str | None:
    """Return the unit of a spelling; None if it is unknown."""
    known = _known_units(quantity)
    plain = _strip_brackets(text)
    if plain in known:
        return plain
    if len(plain) == 1 and plain != "°":  # single letters are case-sensitive: v is not volt
        return None
    folded = "/".join(
        map(_canonical_spelling, re.split("/| per ", _canonical_spelling(plain.casefold())))
    )
    squared = re.sub(r"/s(/s|2|²|\*\*2)$", "/s^2", folded)
    return {name.casefold(): name for name in reversed(known)}.get(squared.casefold())


def is_unit(word: str) -> bool:
    """Return whether a word is a unit."""
    plain = _strip_brackets(word)
    if len(plain) == 1:
        return plain in _WITHOUT_FACTOR or (plain != "1" and parse_unit(plain) is not None)
    folded = plain.casefold()
    return parse_unit(plain) is not None or bool(
        {folded, folded.removesuffix("s")} & _WITHOUT_FACTOR
    )


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

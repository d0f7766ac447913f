"""Names of columns as they stand in a header: their units split off, doubles told apart."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from hydrodamp.data.units import UNITS

_SINGLE = frozenset(["-", "s", "m", "g", "h", "%", "N", "K", "C", "A", "V", "W", "T", "°"])
_SPELT = frozenset(unit.lower() for table in UNITS.values() for unit in table) | frozenset(
    [
        "bool",
        "boolean",
        "raw",
        "none",
        "count",
        "counts",
        "seconds",
        "second",
        "secs",
        "sec",
        "msec",
        "usec",
        "milliseconds",
        "microseconds",
        "nanoseconds",
        "minutes",
        "hours",
        "cm",
        "mm",
        "km",
        "metre",
        "meter",
        "metres",
        "meters",
        "feet",
        "ft",
        "radians",
        "radian",
        "degrees",
        "degree",
        "°/s",
        "deg/sec",
        "rad/sec",
        "m/sec",
        "mps",
        "m/s/s",
        "m/s2",
        "m/s²",
        "rad/s²",
        "knot",
        "kts",
        "nm",
        "n*m",
        "n.m",
        "n·m",
        "newton",
        "newtons",
        "pa",
        "hpa",
        "kpa",
        "mbar",
        "bar",
        "dbar",
        "psi",
        "mv",
        "volt",
        "volts",
        "ma",
        "amp",
        "amps",
        "watt",
        "watts",
        "hz",
        "khz",
        "°c",
        "degc",
        "kg",
        "kg/m3",
        "g/cc",
        "psu",
        "ppt",
        "us",
        "µs",
        "pwm",
        "rps",
        "revs/min",
        "1/min",
        "1/s",
        "gauss",
        "mgauss",
        "tesla",
        "ut",
        "µt",
    ]
)
_BRACKETED = re.compile(r"(.*?\S)[ _]*(?:\[([^\[\]]*)\]|\(([^()]*)\))$")
_ELEMENT = re.compile(r"\d+")


def is_unit(word: str) -> bool:
    """Return whether a word is a unit as logs spell them."""
    bare = word.strip().strip("[]()").strip()
    return bare in _SINGLE if len(bare) == 1 else bare.lower() in _SPELT


def split_unit(name: str) -> tuple[str, str]:
    """Split the unit off a name that carries one in brackets."""
    found = _BRACKETED.fullmatch(name)
    if found is None:
        return name, ""
    stem, square, round_ = found.groups()
    unit = (square if square is not None else round_).strip()
    told = is_unit(unit) if square is None else unit and not _ELEMENT.fullmatch(unit)
    return (stem, unit) if told else (name, "")


def unescaped(name: str) -> str:
    r"""Return a name without quotes, padding and the escapes of typesetting."""
    return name.strip().strip('"').strip().replace("\\_", "_")


def told_apart(names: Sequence[str]) -> tuple[str, ...]:
    """Give every column a name of its own."""
    given = [name or f"column {place}" for place, name in enumerate(names, start=1)]
    counts, seen = Counter(given), Counter[str]()
    taken = {name for name, count in counts.items() if count == 1}
    unique = []
    for name in given:
        if counts[name] == 1:
            unique.append(name)
            continue
        seen[name] += 1
        while f"{name} ({seen[name]})" in taken:
            seen[name] += 1
        unique.append(f"{name} ({seen[name]})")
    return tuple(unique)

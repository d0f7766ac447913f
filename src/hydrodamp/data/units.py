"""Units a mapping may name, and what they are in SI."""

from __future__ import annotations

import math
import re

from hydrodamp.errors import LogError, did_you_mean

_DEGREE = math.pi / 180
_FOOT = 0.3048  # m, international foot
_MILE = 1852.0  # m, nautical
_KNOT = _MILE / 3600  # m/s
_POUND_FORCE = 4.4482216152605  # N
_GRAVITY = 9.80665  # m/s^2, standard

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
    "acceleration": {
        "m/s^2": 1.0,
        "cm/s^2": 0.01,
        "g": _GRAVITY,
        "mg": _GRAVITY / 1000,
        "ft/s^2": _FOOT,
    },
    "angular acceleration": {"rad/s^2": 1.0, "deg/s^2": _DEGREE},
    "force": {"N": 1.0, "kN": 1e3, "lbf": _POUND_FORCE, "kgf": _GRAVITY},
    "moment": {"N m": 1.0, "kN m": 1e3, "lbf ft": _POUND_FORCE * _FOOT},
    "ratio": {"1": 1.0, "%": 0.01},
}
"""For every quantity its units, and the factor that turns each into SI."""

_WORDS = {
    "second": "s",
    "sec": "s",
    "millisecond": "ms",
    "microsecond": "us",
    "nanosecond": "ns",
    "hour": "h",
    "metre": "m",
    "meter": "m",
    "radian": "rad",
    "degree": "deg",
    "°": "deg",
    "degheading": "deg",
    "knot": "kn",
    "newton": "N",
    "percent": "%",
}
"""Other spellings of parts of a unit."""


def factor(unit: str, quantity: str | None = None) -> float:
    """Return the factor that turns a unit into SI."""
    tables = UNITS.values() if quantity is None else (UNITS[quantity],)
    known = {name: value for table in tables for name, value in table.items()}
    if unit not in known:
        called = f"of {quantity} " if quantity else ""
        raise LogError(
            f"'{unit}' is no unit {called}known here.{did_you_mean(unit, known)}"
            f" Known are: {', '.join(known)}"
        )
    return known[unit]


def spelt(text: str) -> str | None:
    """Return the unit that a file states in words of its own."""
    known = {name for table in UNITS.values() for name in table}
    plain = text.strip()
    if plain in known:
        return plain
    parts = [_word(part.strip()) for part in re.split("/| per ", plain)]
    unit = "/".join(parts).replace("/s/s", "/s^2").replace("/s2", "/s^2").replace("/s²", "/s^2")
    return unit if unit in known else None


def _word(part: str) -> str:
    lower = part.lower()
    return _WORDS.get(lower, _WORDS.get(lower.removesuffix("s"), part))

"""Names of columns taken apart into words, and the units they carry."""

from __future__ import annotations

import re

from hydrodamp.data.recording import Topic
from hydrodamp.data.units import spelt

_TAILS: dict[tuple[str, ...], str] = {
    ("rad", "s"): "rad/s",
    ("rads",): "rad/s",
    ("radps",): "rad/s",
    ("deg", "s"): "deg/s",
    ("degs",): "deg/s",
    ("degps",): "deg/s",
    ("dps",): "deg/s",
    ("m", "s2"): "m/s^2",
    ("mps2",): "m/s^2",
    ("m", "s"): "m/s",
    ("mps",): "m/s",
    ("ms2",): "m/s^2",
    ("cm", "s"): "cm/s",
    ("mm", "s"): "mm/s",
    ("knots",): "knots",
    ("kn",): "kn",
    ("rad",): "rad",
    ("deg",): "deg",
    ("rpm",): "rpm",
    ("m",): "m",
    ("cm",): "cm",
    ("mm",): "mm",
    ("us",): "us",
    ("ms",): "ms",
    ("ns",): "ns",
    ("s",): "s",
    ("sec",): "s",
    ("nsec",): "ns",
}
"""Last words of a name that are units; longer ones first."""


def words(name: str) -> tuple[str, ...]:
    """Return the words of a name, small."""
    parted = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+", parted.lower()) if word)


def parted(name: str) -> tuple[tuple[str, ...], str | None]:
    """Return the words of a name without its unit, and the unit."""
    whole = words(name)
    for tail, unit in _TAILS.items():
        if len(whole) > len(tail) and whole[-len(tail) :] == tail:
            return whole[: -len(tail)], unit
    return whole, None


def unit_of(topic: Topic, field: str) -> str | None:
    """Return the unit that the file states for a field, or that its name carries."""
    stated = spelt(topic.units[field]) if topic.units.get(field) else None
    return stated or parted(field)[1]

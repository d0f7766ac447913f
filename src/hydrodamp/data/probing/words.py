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
    """Return the words of a name, small.

    Parameters
    ----------
    name : str
        Of a topic or column.

    Returns
    -------
    words : tuple of str
        Numbers in brackets are words.

    Examples
    --------
    >>> words("IMU.GyrX"), words("twist.linear.x"), words("v_x"), words("q[3]")
    (('imu', 'gyr', 'x'), ('twist', 'linear', 'x'), ('v', 'x'), ('q', '3'))
    """
    parted = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+", parted.lower()) if word)


def parted(name: str) -> tuple[tuple[str, ...], str | None]:
    """Return the words of a name without its unit, and the unit.

    Parameters
    ----------
    name : str
        Of a column.

    Returns
    -------
    words : tuple of str
        Without the unit.
    unit : str or None
        None where it carries none.

    Examples
    --------
    >>> parted("yaw_rate_deg_s"), parted("time_s"), parted("m")
    ((('yaw', 'rate'), 'deg/s'), (('time',), 's'), (('m',), None))
    """
    whole = words(name)
    for tail, unit in _TAILS.items():
        if len(whole) > len(tail) and whole[-len(tail) :] == tail:
            return whole[: -len(tail)], unit
    return whole, None


def unit_of(topic: Topic, field: str) -> str | None:
    """Return the unit that the file states for a field, or that its name carries.

    Parameters
    ----------
    topic : Topic
        As read.
    field : str
        One of its fields.

    Returns
    -------
    unit : str or None
        As in :data:`hydrodamp.data.units.UNITS`; None where neither says one.
    """
    stated = spelt(topic.units[field]) if topic.units.get(field) else None
    return stated or parted(field)[1]

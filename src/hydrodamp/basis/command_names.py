"""What a command may be called, so that no command reads as a product of velocities."""

from __future__ import annotations

import re

from hydrodamp.basis.atoms import ABSOLUTES, DOWN, PROPULSION, SPEEDS
from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.errors import TermError

RESERVED = (
    "time",
    *("roll", "pitch", "yaw", "qw", "qx", "qy", "qz"),
    *VELOCITIES,
    *(f"d{velocity}" for velocity in VELOCITIES),
    *("eta", "segment"),
    *AXES,
    *SPEEDS,
    *DOWN,
)
"""Names with a meaning of their own, in logs or in terms."""

_SYMBOLS = sorted((*ABSOLUTES, *SPEEDS, PROPULSION, *DOWN, *VELOCITIES), key=len, reverse=True)
SYMBOL = re.compile("(" + "|".join(map(re.escape, _SYMBOLS)) + r")(?:\^([1-9]))?")
"""One reserved symbol with an optional power; the longest spelling wins."""

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def reads_as_product(text: str) -> bool:
    """Tell whether a text is made of reserved symbols only."""
    place = 0
    while found := SYMBOL.match(text, place):
        place = found.end()
    return place == len(text) > 0


def check_command_name(name: str) -> None:
    """Refuse a command name that a term could not spell."""
    if not _IDENTIFIER.fullmatch(name):
        raise TermError(
            f"Command name `{name}` must be letters, digits and underscores and start with no "
            "digit, such as 'rudder' or 'ch_forward'. Rename it."
        )
    if name in RESERVED:
        raise TermError(f"Command name `{name}` is reserved. Rename it, to 'cmd_{name}' say.")
    if reads_as_product(name):
        product = "*".join(found.group(0) for found in SYMBOL.finditer(name))
        raise TermError(
            f"Command name `{name}` reads as the product {product}. Rename it, to 'cmd_{name}' say."
        )

"""Axes and velocities, the symbols a term is a product of, and what a command may be called."""

from __future__ import annotations

import re
from collections.abc import Sequence

from hydrodamp.errors import TermError, no_such

AXES = ("X", "Y", "Z", "K", "M", "N")
"""Rows of every wrench: force X Y Z [N] and moment K M N [N m], body frame."""

VELOCITIES = ("u", "v", "w", "p", "q", "r")
"""Surge, sway, heave [m/s] and roll, pitch, yaw rate [rad/s], body frame."""

VELOCITY_OF = dict(zip(AXES, VELOCITIES, strict=True))
"""The velocity of each axis: ``VELOCITY_OF["N"] == "r"``."""


#: ``|u| ... |r|``.
ABSOLUTES = tuple(f"|{velocity}|" for velocity in VELOCITIES)

#: ``U = |nu_1|``, ``V = sqrt(v^2 + w^2)``, ``V_v = sign(v) V``, ``V_w = sign(w) V`` [m/s].
SPEEDS = ("U", "V", "V_v", "V_w")

#: The propulsion ratio less one, ``u_c / max(U, 1e-6) - 1``.
PROPULSION = "(eta-1)"

#: The unit vector that points down, in the body frame: ``R^T e_3``.
DOWN = ("down_x", "down_y", "down_z")

#: Every reserved atom in the order of the kernels' table; ``ATOMS[0]`` is the constant one.
ATOMS = ("1", *VELOCITIES, *ABSOLUTES, *SPEEDS, PROPULSION, *DOWN)

#: The place of each reserved atom in :data:`ATOMS`.
ATOM_PLACE = {atom: place for place, atom in enumerate(ATOMS)}

#: The place of the first command channel; the absolute values follow the channels.
FIRST_CHANNEL = len(ATOMS)

#: The velocities each reserved atom is computed from.
CONTENT = {
    **dict.fromkeys(ATOMS, ""),
    **{atom: atom.strip("|") for atom in (*VELOCITIES, *ABSOLUTES)},
    **dict.fromkeys(("U", PROPULSION), "uvw"),
    **dict.fromkeys(("V", "V_v", "V_w"), "vw"),
}

#: The velocities whose absence together makes an atom zero; sign(0) = 0. Empty: never zero.
ZERO_WITHOUT = {**CONTENT, PROPULSION: "", "V_v": "v", "V_w": "w"}


def is_absolute(atom: str) -> bool:
    """Whether an atom is an absolute value, ``|r|`` or ``|rudder|``."""
    return atom.startswith("|")


def atom_index(atom: str, channels: Sequence[str] = ()) -> int:
    """Return the index of an atom in the table of the C core."""
    if atom in ATOM_PLACE:
        return ATOM_PLACE[atom]
    name = atom.strip("|")
    if name not in channels:
        raise TermError(no_such("channel", name, channels))
    index = FIRST_CHANNEL + list(channels).index(name)
    return index + len(channels) if is_absolute(atom) else index


#: Names with a meaning of their own, in logs or in terms.
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

_SYMBOLS = sorted((*ABSOLUTES, *SPEEDS, PROPULSION, *DOWN, *VELOCITIES), key=len, reverse=True)
#: One reserved symbol with an optional power; the longest spelling wins.
SYMBOL = re.compile("(" + "|".join(map(re.escape, _SYMBOLS)) + r")(?:\^([1-9]))?")

#: Reserved symbols side by side.
PRODUCT = re.compile(f"(?:{SYMBOL.pattern})+")

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def check_command_name(name: str) -> None:
    """Refuse a command name that a term could not spell."""
    if not _IDENTIFIER.fullmatch(name):
        raise TermError(
            f"Command name `{name}` must be letters, digits and underscores and start with no "
            "digit, such as 'rudder' or 'ch_forward'. Rename it."
        )
    if name in RESERVED:
        raise TermError(f"Command name `{name}` is reserved. Rename it, to 'cmd_{name}' say.")
    if PRODUCT.fullmatch(name):
        product = "*".join(match.group(0) for match in SYMBOL.finditer(name))
        raise TermError(
            f"Command name `{name}` reads as the product {product}. Rename it, to 'cmd_{name}' say."
        )

"""The symbols a term is a product of, and their places in the kernels' table."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.errors import TermError, did_you_mean

ABSOLUTES = tuple(f"|{velocity}|" for velocity in VELOCITIES)
"""``|u| ... |r|``."""

SPEEDS = ("U", "V", "V_v", "V_w")
"""``U = |nu_1|``, ``V = sqrt(v^2 + w^2)``, ``V_v = sign(v) V``, ``V_w = sign(w) V`` [m/s]."""

PROPULSION = "(eta-1)"
"""The propulsion ratio less one, ``u_c / max(U, 1e-6) - 1``."""

DOWN = ("down_x", "down_y", "down_z")
"""The unit vector that points down, in the body frame: ``R^T e_3``."""

ATOMS = ("1", *VELOCITIES, *ABSOLUTES, *SPEEDS, PROPULSION, *DOWN)
"""Every reserved atom in the order of the kernels' table; ``ATOMS[0]`` is the constant one."""

ATOM_PLACE = {atom: place for place, atom in enumerate(ATOMS)}
"""The place of each reserved atom in :data:`ATOMS`."""

FIRST_CHANNEL = len(ATOMS)
"""The place of the first command channel; the absolute values follow the channels."""

CONTENT = {
    "1": "",
    **{velocity: velocity for velocity in VELOCITIES},
    **{f"|{velocity}|": velocity for velocity in VELOCITIES},
    "U": "uvw",
    "V": "vw",
    "V_v": "vw",
    "V_w": "vw",
    PROPULSION: "uvw",
    "down_x": "",
    "down_y": "",
    "down_z": "",
}
"""The velocities each reserved atom is computed from."""

ZERO_WITHOUT = {**CONTENT, PROPULSION: "", "V_v": "v", "V_w": "w"}
"""The velocities whose absence together makes an atom zero; sign(0) = 0. Empty: never zero."""


def is_absolute(atom: str) -> bool:
    """Tell whether an atom is an absolute value, ``|r|`` or ``|rudder|``."""
    return atom.startswith("|")


def atom_index(atom: str, channels: Sequence[str] = ()) -> int:
    """Return the place of an atom in the kernels' table."""
    if atom in ATOM_PLACE:
        return ATOM_PLACE[atom]
    name = atom.strip("|")
    if name not in channels:
        known = ", ".join(channels) if channels else "none"
        raise TermError(
            f"Command `{name}` is not a channel; the channels are: {known}."
            f"{did_you_mean(name, channels)}"
        )
    place = FIRST_CHANNEL + list(channels).index(name)
    return place + len(channels) if is_absolute(atom) else place

"""The channels a mapping may fill, by group, and the quantity each one is."""

from __future__ import annotations

from hydrodamp.basis.axes import AXES, VELOCITIES
from hydrodamp.data.columns import ACCELERATIONS, EULER, POSITION, QUATERNION, SPECIFIC_FORCE

COMPASS = ("north", "east", "down", "up")
"""Directions of the world; what is given along them needs the attitude to become body axes."""

GROUPS: dict[str, dict[str, str]] = {
    "attitude": dict.fromkeys((*EULER, "heading"), "angle") | dict.fromkeys(QUATERNION, "ratio"),
    "velocity": dict.fromkeys(VELOCITIES[:3], "speed")
    | dict.fromkeys(VELOCITIES[3:], "angular rate")
    | dict.fromkeys(COMPASS, "speed"),
    "acceleration": dict.fromkeys(ACCELERATIONS[:3], "acceleration")
    | dict.fromkeys(ACCELERATIONS[3:], "angular acceleration"),
    "wrench": dict.fromkeys(AXES[:3], "force") | dict.fromkeys(AXES[3:], "moment"),
    "position": dict.fromkeys((*COMPASS, "depth"), "length"),
    "accelerometer": dict.fromkeys(("x", "y", "z"), "acceleration"),
}
"""For every group its channels and their quantities; commands have names of their own."""

SINGLE = {"time": "time", "eta": "ratio"}
"""Channels that stand by themselves."""

CANONICAL = SINGLE | {
    name: quantity
    for group in ("attitude", "velocity", "acceleration", "wrench")
    for name, quantity in GROUPS[group].items()
    if name not in (*COMPASS, "heading")
}
CANONICAL |= dict.fromkeys(POSITION, "length") | dict.fromkeys(SPECIFIC_FORCE, "acceleration")
"""The columns of the canonical form, and the quantity each one is."""

DOWNWARD = {"up": ("down", -1.0), "depth": ("down", 1.0)}
"""Other names of what is counted downwards, and their sign."""


def quantity_of(group: str, name: str) -> str | None:
    """Return the quantity of a channel; None where it may be any."""
    return SINGLE.get(group) or GROUPS.get(group, {}).get(name)

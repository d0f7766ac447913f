"""The channels a mapping may fill, by group, and the quantity each one is."""

from __future__ import annotations

from hydrodamp.data.channels import ACCELERATION, ATTITUDE, EULER, VELOCITY, WRENCH

COMPASS = ("north", "east", "down", "up")
"""Directions of the world; what is given along them needs the attitude to become body axes."""

GROUPS: dict[str, dict[str, str]] = {
    "attitude": dict.fromkeys((*EULER, "heading"), "angle") | {**ATTITUDE.quantities},
    "velocity": {**VELOCITY.quantities, **dict.fromkeys(COMPASS, "speed")},
    "acceleration": {**ACCELERATION.quantities},
    "wrench": {**WRENCH.quantities},
    "position": dict.fromkeys((*COMPASS, "depth"), "length"),
    "accelerometer": dict.fromkeys(("x", "y", "z"), "acceleration"),
}
"""For every group its channels and their quantities; commands have names of their own."""

SINGLE = {"time": "time", "eta": "ratio"}
"""Channels that stand by themselves."""

DOWNWARD = {"up": ("down", -1.0), "depth": ("down", 1.0)}
"""Other names of what is counted downwards, and their sign."""


def quantity_of(group: str, name: str) -> str | None:
    """Return the quantity of a channel; None where it may be any."""
    return SINGLE.get(group) or GROUPS.get(group, {}).get(name)

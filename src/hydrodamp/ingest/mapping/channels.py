"""The channels a mapping may fill, by group, and the quantity each one is."""

from __future__ import annotations

from hydrodamp.data.channels import ATTITUDE, BLOCKS, EULER, POSITION, VELOCITY

#: Directions of the world; what is given along them needs the attitude to become body axes.
COMPASS = ("north", "east", "down", "up")

#: Other names of what is counted downwards, and their sign.
DOWNWARD = {"up": ("down", -1.0), "depth": ("down", 1.0)}

_BESIDES = {
    ATTITUDE.name: dict.fromkeys((*EULER, "heading"), "angle"),
    VELOCITY.name: dict.fromkeys(COMPASS, "speed"),
    POSITION.name: dict.fromkeys(DOWNWARD, "length"),
}

#: For every group its channels and their quantities; commands have names of their own.
GROUPS: dict[str, dict[str, str]] = {
    block.name: {**block.quantities, **_BESIDES.get(block.name, {})}
    for block in BLOCKS
    if block.shape
}

#: Channels that stand by themselves.
SINGLE = {
    name: what for block in BLOCKS if not block.shape for name, what in block.quantities.items()
}


def quantity_of(group: str, name: str) -> str | None:
    """Return the quantity of a channel; None where it may be any."""
    return SINGLE.get(group) or GROUPS.get(group, {}).get(name)

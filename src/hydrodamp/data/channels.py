"""The table of channels of a log: names, columns and units.

`Log`, canonical files, mappings, checks, the summary and cleaning derive their lists from
:data:`BLOCKS`. Commands are not in it: each log names its own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.units import si_unit


@dataclass(frozen=True)
class Block:
    """An array of a log with one entry a sample: one number, or several side by side."""

    name: str  # the attribute of Log, and the group of a mapping
    quantities: Mapping[str, str]  # of every column, in order; keys of data.units.UNITS
    is_sensed: bool = False  # written by a sensor: cleaning may replace single samples
    is_whole: bool = False  # a file holds all of its columns or none

    @property
    def columns(self) -> tuple[str, ...]:
        """What its columns are called in files."""
        return tuple(self.quantities)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one entry."""
        return () if len(self.quantities) == 1 else (len(self.quantities),)


def _six_quantities(names: tuple[str, ...], linear: str, angular: str) -> dict[str, str]:
    """Return the quantities of three linear and three angular components."""
    return dict(zip(names, [linear] * 3 + [angular] * 3, strict=True))


TIME = Block("time", {"time": "time"})
ATTITUDE = Block("attitude", dict.fromkeys(("qw", "qx", "qy", "qz"), "ratio"), is_whole=True)
VELOCITY = Block("velocity", _six_quantities(VELOCITIES, "speed", "angular rate"), is_sensed=True)
ACCELERATION = Block(
    "acceleration",
    _six_quantities(
        tuple(f"d{name}" for name in VELOCITIES), "acceleration", "angular acceleration"
    ),
    is_sensed=True,
)
PROPULSION_RATIO = Block("propulsion_ratio", {"eta": "ratio"})
WRENCH = Block("wrench", _six_quantities(AXES, "force", "moment"))
POSITION = Block(
    "position", dict.fromkeys(("north", "east", "down"), "length"), is_sensed=True, is_whole=True
)
SPECIFIC_FORCE = Block(
    "specific_force",
    dict.fromkeys(("fx", "fy", "fz"), "acceleration"),
    is_sensed=True,
    is_whole=True,
)

#: All blocks but the commands, in the order of the columns of a canonical file.
BLOCKS = (
    TIME,
    ATTITUDE,
    VELOCITY,
    ACCELERATION,
    PROPULSION_RATIO,
    WRENCH,
    POSITION,
    SPECIFIC_FORCE,
)

#: The attitude as angles, which a file may hold instead of the quaternion.
EULER = ("roll", "pitch", "yaw")

#: The column of labels: a change of label is a join.
SEGMENT = "segment"

#: The quantity of every reserved column of numbers.
QUANTITIES: dict[str, str] = {
    **TIME.quantities,
    **dict.fromkeys(EULER, "angle"),
    **{name: quantity for block in BLOCKS[1:] for name, quantity in block.quantities.items()},
}

#: Columns with a meaning of their own; any other is a command.
RESERVED = (*QUANTITIES, SEGMENT)


def unit_of(column: str) -> str:
    """Return the SI unit of a reserved column."""
    return si_unit(QUANTITIES[column])

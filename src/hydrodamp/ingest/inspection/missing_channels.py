"""Channels that identification needs and a log lacks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from difflib import get_close_matches

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.log import Log

#: Remark on a log that has no other velocity.
PLANAR_REMARK = (
    "judged for a vehicle of `axes: [X, Y, N]`, such as a boat: a vehicle that heaves, rolls or "
    "pitches also needs w p q, and the attitude."
)


def missing_channels(log: Log, is_boat: bool) -> Iterator[str]:
    """Yield what a log lacks, where no vehicle is named."""
    absent = [name for name in VELOCITIES if name not in log.velocity_names]
    if absent and not is_boat:
        yield (
            f"velocities {' '.join(absent)}: required unless the vehicle's `axes` exclude them "
            "(pass --vehicle), or a step derives them: `rates_from_attitude`, "
            "`velocity_from_position`."
        )
    if log.attitude is None and not is_boat:
        yield "attitude (roll pitch yaw or qw qx qy qz): weight and buoyancy depend on it."
    if log.wrench is None and not log.command_names:
        yield "actuation: the wrench X Y Z K M N, or command columns."


def constant_commands(log: Log, commands: Sequence[str]) -> Iterator[str]:
    """Yield the remedy for commands of actuators that no column of a log resembles."""
    recorded = log.command_names
    absent = [
        name
        for name in commands
        if name not in recorded and not get_close_matches(name, recorded, n=1, cutoff=0.7)
    ]
    if log.wrench is None and 0 < len(absent) < len(commands):
        constants = ", ".join(f"{name}: {{value: VALUE}}" for name in absent)
        yield (
            f"a column like {' or '.join(absent)}: if it was constant, add it to the mapping "
            f"(`commands: {{{constants}}}`), else pass a vehicle without that actuator."
        )

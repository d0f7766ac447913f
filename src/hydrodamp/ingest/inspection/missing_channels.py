"""Requirements of identification on a log, and channels that it lacks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.conditioning.derivatives import constant_angles
from hydrodamp.data.log import Log
from hydrodamp.ingest.inspection.command_signs import Signs

#: Remark on a log that has no other velocity.
PLANAR_REMARK = (
    "judged for a vehicle of `axes: [X, Y, N]`, such as a boat: a vehicle that heaves, rolls or "
    "pitches also needs w p q, and the attitude."
)
_MAX_TILT = np.radians(5.0)  # of a boat, in the median


@dataclass(frozen=True)
class Requirements:
    """Requirements of a vehicle on a log, and which of them the log does not meet."""

    velocities: tuple[str, ...]
    missing: tuple[str, ...] = ()
    reservations: tuple[str, ...] = ()
    suspicions: tuple[QualityIssue, ...] = ()
    length: float | None = None  # of the vehicle [m]
    signs: Signs | None = None  # of the effects of its thrusters
    commands: tuple[str, ...] = ()  # that its actuators take


def is_level(log: Log) -> bool:
    """Whether a log has no roll and pitch, or small ones."""
    return log.attitude is None or bool(np.median(log.down[:, 2]) > np.cos(_MAX_TILT))


def missing_channels(log: Log, is_boat: bool) -> Iterator[str]:
    """Yield what a log lacks, where no vehicle is named."""
    absent = [name for name in VELOCITIES if name not in log.velocity_names]
    if absent and not is_boat:
        yield (
            f"velocities {' '.join(absent)}: required unless the vehicle's `axes` exclude them "
            "(pass --vehicle), or a step derives them: `rates_from_attitude`, "
            "`velocity_from_position`."
        )
        yield from constant_angles(log, absent)
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

"""Channels that identification needs and a log lacks, where no vehicle is named."""

from __future__ import annotations

from collections.abc import Iterator

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.log import Log

#: Remark on a log that has no other velocity.
PLANAR_REMARK = (
    "judged for a vehicle of `axes: [X, Y, N]`, such as a boat: a vehicle that heaves, rolls or "
    "pitches also needs w p q, and the attitude."
)


def missing_channels(log: Log, is_boat: bool) -> Iterator[str]:
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

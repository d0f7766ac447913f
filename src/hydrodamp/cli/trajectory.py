"""A simulated trajectory as a log in canonical form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.basis.axes import VELOCITY_OF
from hydrodamp.data.canonical import write_log
from hydrodamp.data.log import Log

if TYPE_CHECKING:
    from hydrodamp.simulation.replay import Trajectory
    from hydrodamp.vehicle.vehicle import Vehicle


def write_trajectory(trajectory: Trajectory, vehicle: Vehicle, path: str) -> bool:
    """Write a trajectory as canonical CSV."""
    log = simulated_log(trajectory, vehicle)
    if log is None:
        return False
    write_log(log, path)
    return True


def simulated_log(trajectory: Trajectory, vehicle: Vehicle) -> Log | None:
    """Return what would have been measured."""
    log = trajectory.log
    keep = np.asarray(np.isfinite(trajectory.velocity).all(axis=1))
    names = np.concatenate([[part.name] * len(part) for part in log.segments])
    if not any(keep[part.start : part.stop].sum() > 1 for part in log.segments):
        return None
    free = [VELOCITY_OF[axis] for axis in vehicle.axes]
    velocity = {name: trajectory.velocity[keep, "uvwpqr".index(name)] for name in free}
    attitude = log.attitude if trajectory.attitude == "measured" else None
    return Log.from_arrays(
        log.time[keep],
        velocity,
        attitude=None if attitude is None else attitude[keep],
        commands={name: log.command(name)[keep] for name in log.command_names},
        wrench=None if log.wrench is None else log.wrench[keep],
        propulsion_ratio=None if log.propulsion_ratio is None else log.propulsion_ratio[keep],
        segment=names[keep].tolist(),
        source=f"replay of {log.source or 'log'}",
    )

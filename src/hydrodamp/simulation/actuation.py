"""The wrench of the actuators as channels of terms, so that its gains can be unknowns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: By axis, the wrench at each sample, held, and what it rises by until the next: with both, a
#: gain does not depend on whether the wrench is held, interpolated or a fraction of a step late.
CHANNELS = {axis: (f"actuation_{axis}", f"actuation_rise_{axis}") for axis in AXES}


def channel_names(vehicle: Vehicle, log: Log) -> tuple[str, ...]:
    """Return the channels that a log and a vehicle give."""
    given = vehicle.axes if log.wrench is not None or vehicle.actuators else ()
    return tuple(name for axis in given for name in CHANNELS[axis])


def actuation(vehicle: Vehicle, log: Log) -> FloatArray:
    """Return the wrench of the actuators at each sample: as recorded, else as of the vehicle."""
    if log.wrench is not None:
        return log.wrench
    commands = {name: log.command(name) for name in log.command_names}
    weightless = replace(vehicle, weight=0.0, buoyancy=0.0)
    return weightless.known_wrench(log.velocity * vehicle.free, log.down, commands)


def actuation_channels(vehicle: Vehicle, log: Log) -> dict[str, FloatArray]:
    """Return the channels of every axis."""
    wrench, last = actuation(vehicle, log), log.bounds[:, 1] - 1
    rise = np.diff(wrench, axis=0, append=wrench[-1:])
    rise[last] = 0.0
    names = [name for both in CHANNELS.values() for name in both]
    return dict(zip(names, np.stack([wrench, rise], axis=2).reshape(log.n, -1).T, strict=True))


def with_gains(vehicle: Vehicle, log: Log, model: DampingModel) -> DampingModel:
    """Return a model with a free gain on each axis that the actuators drive in a log.

    The coefficient of ``actuation_X`` on X is what the gain is more than one.
    """
    known = bool(channel_names(vehicle, log))
    driven = np.ptp(actuation(vehicle, log), axis=0) > 0.0 if known else np.zeros(6, dtype=bool)
    terms = {axis: CHANNELS[axis] for axis in np.array(AXES)[driven & vehicle.free].tolist()}
    if not terms:
        raise ProblemError(
            f"{log.source or 'log'}: no gain can be free, for there is no known wrench that "
            f"varies: record the columns X Y Z K M N, or give '{vehicle.name}' actuators."
        )
    freed = model.with_terms(terms, key=f"{model.key}+gains")
    return replace(freed, title=f"{model.title} with free gains")

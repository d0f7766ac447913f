"""Actuator wrench as channels of terms, so that actuator gains can be estimated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError
from hydrodamp.models.model import DampingModel
from hydrodamp.vehicle.vehicle import Vehicle

#: By axis, the wrench at each sample, held, and its increment until the next sample: with both, a
#: gain is independent of sample-and-hold, interpolation, and delays of a fraction of a step.
CHANNELS = {axis: (f"actuation_{axis}", f"actuation_rise_{axis}") for axis in AXES}


def channel_names(vehicle: Vehicle, log: Log) -> tuple[str, ...]:
    """Return the names of the actuation channels that log and vehicle provide."""
    axes = vehicle.axes if log.wrench is not None or vehicle.actuators else ()
    return tuple(name for axis in axes for name in CHANNELS[axis])


def actuation(vehicle: Vehicle, log: Log) -> FloatArray:
    """Return the recorded actuator wrench, else that of the vehicle's actuators, shape (n, 6)."""
    if log.wrench is not None:
        return log.wrench
    commands = {name: log.command(name) for name in log.command_names}
    weightless = replace(vehicle, weight=0.0, buoyancy=0.0)
    return weightless.known_wrench(log.velocity * vehicle.free, log.down, commands)


def actuation_channels(vehicle: Vehicle, log: Log) -> dict[str, FloatArray]:
    """Return the actuation channels of every axis."""
    wrench, last = actuation(vehicle, log), log.bounds[:, 1] - 1
    rise = np.diff(wrench, axis=0, append=wrench[-1:])
    rise[last] = 0.0
    names = [name for pair in CHANNELS.values() for name in pair]
    return dict(zip(names, np.stack([wrench, rise], axis=2).reshape(log.n, -1).T, strict=True))


def with_gains(vehicle: Vehicle, log: Log, model: DampingModel) -> DampingModel:
    """Add an actuator gain to a model on each axis with a varying wrench.

    The coefficient of ``actuation_X`` on X is the deviation of the gain from 1.
    """
    has_wrench = bool(channel_names(vehicle, log))
    driven = (
        np.ptp(actuation(vehicle, log), axis=0) > 0.0 if has_wrench else np.zeros(6, dtype=bool)
    )
    terms = {axis: CHANNELS[axis] for axis in np.array(AXES)[driven & vehicle.free].tolist()}
    if not terms:
        raise ProblemError(
            f"{log.source or 'log'}: no actuator gain can be estimated without a varying "
            f"wrench: record the columns X Y Z K M N, or add actuators to '{vehicle.name}'."
        )
    extended = model.with_terms(terms, key=f"{model.key}+gains")
    return replace(extended, title=f"{model.title} with free gains")

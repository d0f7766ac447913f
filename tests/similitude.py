"""Froude similitude: lengths scale by λ, times and speeds by √λ, masses and forces by λ³."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hydrodamp as hd
from hydrodamp.basis.term import CONTENT


def record_wrench(vehicle: hd.Vehicle, log: hd.Log) -> hd.Log:
    """Return a log with the wrench of the actuators in place of commands."""
    commands = {name: log.command(name) for name in log.command_names}
    known = vehicle.known_wrench(log.velocity, log.down, commands)
    wrench = known - vehicle.restoring_wrench(log.down)
    return replace(log, wrench=wrench, commands=np.empty((log.n, 0)), command_names=())


def scale_log(log: hd.Log, ratio: float) -> hd.Log:
    """Return the log of a vehicle that is larger by a ratio; commands have no unit."""
    root = np.sqrt(ratio)
    linear, angular = np.ones(3), np.ones(3)

    def scaled(values, force, moment):
        return None if values is None else values * np.r_[force * linear, moment * angular]

    return replace(
        log,
        time=log.time * root,
        velocity=scaled(log.velocity, root, 1.0 / root),
        wrench=scaled(log.wrench, ratio**3, ratio**4),
        acceleration=scaled(log.acceleration, 1.0, 1.0 / ratio),
        position=None if log.position is None else log.position * ratio,
    )


def scale_vehicle(vehicle: hd.Vehicle, ratio: float) -> hd.Vehicle:
    """Return a vehicle without actuators that is larger by a ratio."""
    lever = np.r_[np.ones(3), np.full(3, ratio)]
    return replace(
        vehicle,
        mass_matrix=vehicle.mass_matrix * ratio**3 * lever[:, None] * lever,
        added_mass=None,
        weight=vehicle.weight * ratio**3,
        buoyancy=vehicle.buoyancy * ratio**3,
        center_of_gravity=vehicle.center_of_gravity * ratio,
        center_of_buoyancy=vehicle.center_of_buoyancy * ratio,
        actuators=(),
    )


def coefficient_scales(model: hd.DampingModel, ratio: float) -> np.ndarray:
    """Return the ratio of each coefficient of the larger vehicle to that of the smaller one."""
    scales = []
    for axis, terms in enumerate(model.terms):
        force = ratio**3 if axis < 3 else ratio**4
        for term in terms:
            content = [CONTENT.get(factor, "") for factor in term.factors if factor != "(eta-1)"]
            powers = [0.5 if name[0] in "uvw" else -0.5 for name in content if name]
            scales.append(force / ratio ** sum(powers))
    return np.array(scales)

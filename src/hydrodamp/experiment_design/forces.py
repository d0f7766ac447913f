"""Forces of the commands: slopes of the wrench, steady speeds, and an assumed limit of thrust."""

from __future__ import annotations

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.errors import ProblemError, list_faults
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.problem import equation_table, held_channels
from hydrodamp.vehicle.vehicle import Vehicle

#: A command acts on an axis where it makes so much of the strongest there.
_ACTS = 0.05

#: Bisections and doublings in the search of a command.
_HALVINGS, _DOUBLINGS = 60, 100

#: Bollard thrust that a propeller without a limit is assumed to reach, as a share of the weight. A
#: REMUS 100 with 3.9 N/(m/s)^2 of drag (Prestero 2001) and its top speed of 2.5 m/s makes 0.08.
ASSUMED_THRUST = 0.1


class CommandForces:
    """The wrench of a vehicle straight ahead, as a function of its commands."""

    def __init__(self, vehicle: Vehicle, damping: Damping, names: tuple[str, ...]) -> None:
        self.vehicle, self.names = vehicle, names
        self.table = equation_table(vehicle, (damping.model,), actuators=bool(vehicle.actuators))
        free = damping.model.restricted_to(vehicle.axes)
        self.matrix = self.table.with_unknown(self.table.entries(free), damping.onto(free))

    def wrench(self, speed: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the wrench at speeds straight ahead, level, under commands, shape (n, 6)."""
        n = len(speed)
        velocity, down = np.zeros((n, 6)), np.tile([0.0, 0.0, 1.0], (n, 1))
        velocity[:, 0] = speed
        given = dict(zip(self.names, commands.T, strict=True))
        channels = held_channels(self.table, given, n)
        ahead = self.vehicle.propulsion_speed(given) if self.table.actuators else None
        held = np.maximum(speed, 1e-6) if ahead is None else ahead
        found: FloatArray = (
            core.regressor(self.table.plant.factors, velocity, down, channels, held) @ self.matrix
        )
        return found

    def effects(self, speed: float, most: FloatArray) -> FloatArray:
        """Return the mean slope of the wrench on each command, shape (k, 6)."""
        step = np.where(np.isfinite(most), most, 1.0)
        moved = np.vstack([np.zeros(len(step)), np.diag(step)])
        wrench = self.wrench(np.full(len(moved), speed), moved)
        found = (wrench[1:] - wrench[0]) / step[:, None]
        change = np.abs(wrench[1:] - wrench[0])
        rounding = np.abs(wrench).sum(axis=1, keepdims=True).max() * np.finfo(np.float64).eps
        found[change < np.maximum(_ACTS * change.max(axis=0), rounding)] = 0.0
        return np.asarray(found * self.vehicle.free)

    def steady(
        self,
        propeller: int,
        envelope: Envelope,
        lowest: FloatArray,
        highest: FloatArray,
        assumptions: list[str],
    ) -> tuple[FloatArray, FloatArray]:
        """Return steady speeds within the band and the propeller's commands that hold them."""
        speeds = np.linspace(*envelope.speed, 9)
        low = np.full(len(speeds), max(lowest[propeller], 0.0))
        high = np.full(len(speeds), highest[propeller])
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            commands = np.zeros((len(speeds), len(self.names)))
            commands[:, propeller] = middle
            gains = self.wrench(speeds, commands)[:, 0] > 0.0
            low, high = np.where(gains, low, middle), np.where(gains, middle, high)
        least, most = max(lowest[propeller], 0.0), highest[propeller]
        reached = (high < most * (1 - 1e-9)) & (high > least * (1 + 1e-9) + 1e-9)
        if not reached.any():
            name = self.names[propeller]
            fault = (
                f"`speed` from {envelope.speed[0]:g} to {envelope.speed[1]:g} m/s is out of reach "
                f"of `{name}` from {lowest[propeller]:g} to {highest[propeller]:g}"
            )
            raise ProblemError(list_faults("envelope", [" ".join([f"{fault}.", *assumptions])]))
        return speeds[reached], high[reached]

    def assumed_limit(self, propeller: int) -> float:
        """Return the command at which the thrust at rest is ``ASSUMED_THRUST`` of the weight."""
        thrust = ASSUMED_THRUST * self.vehicle.weight

        def reaches(command: float) -> bool:
            commands = np.zeros((1, len(self.names)))
            commands[0, propeller] = command
            return bool(self.wrench(np.zeros(1), commands)[0, 0] >= thrust)

        high = 1.0
        for _ in range(_DOUBLINGS):
            if reaches(high):
                break
            high *= 2.0
        low = 0.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if reaches(middle) else (middle, high)
        return high

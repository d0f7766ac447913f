"""Vehicles in motion side by side: equation 1 of the paper, and Runge and Kutta."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.kernels import core
from hydrodamp.kernels.plant import Plant
from hydrodamp.simulation.campaign.truth import Truth
from hydrodamp.simulation.problem import equation_table, held_channels
from hydrodamp.vehicle.actuators import Fin, Propeller
from hydrodamp.vehicle.vehicle import Vehicle

STEP = 0.02
"""Step of the Runge-Kutta integration [s]."""

VELOCITY, EULER, DEPTH, FINS = slice(0, 6), slice(6, 9), 9, slice(10, 12)
"""Columns of a state."""

MEASURED = slice(0, 10)
"""Columns of a state that sensors see."""

N_STATES = 12
"""Columns of a state, all told."""


@dataclass(frozen=True)
class Motion:
    """Equation 1 in one kind of water; columns ``fins`` of the channels are rudder and elevator."""

    truth: Truth
    plant: Plant
    matrix: FloatArray
    inverse_mass: FloatArray
    channels: FloatArray
    fins: list[int]
    thrust: FloatArray
    push: FloatArray

    @classmethod
    def of(cls, vehicle: Vehicle, truth: Truth, rpm: FloatArray) -> Motion:
        """Return the motion of a vehicle with rudder, elevator and propeller at some speeds."""
        model, n = truth.damping.model, len(rpm)
        table = equation_table(vehicle, (model,), actuators=True)
        fins = {one.command: one.channel for one in vehicle.actuators if isinstance(one, Fin)}
        propeller = next(one for one in vehicle.actuators if isinstance(one, Propeller))
        commands = {**dict.fromkeys(fins, np.zeros(n)), propeller.command: rpm}
        return cls(
            truth=truth,
            plant=table.plant,
            matrix=table.with_unknown(table.entries(model), truth.damping.coefficients),
            inverse_mass=frozen(np.linalg.inv(vehicle.mass_matrix)),
            channels=held_channels(table, commands, n),
            fins=[table.channels.index(fins[name]) for name in ("rudder", "elevator")],
            thrust=propeller.thrust * rpm * np.abs(rpm),
            push=np.zeros(6),
        )

    @property
    def steady_surge(self) -> FloatArray:
        """Surge speed of each vehicle, level and straight, shape (n,) [m/s]."""
        speed: FloatArray = np.sqrt(-self.thrust / self.truth.damping["X_u|u|"])
        return speed

    def acceleration(self, state: FloatArray) -> FloatArray:
        """Return the body acceleration."""
        velocity, channels = state[:, VELOCITY], self.channels.copy()
        channels[:, self.fins] = self.truth.effective_fins(velocity, state[:, FINS])
        terms = core.regressor(
            self.plant.factors,
            velocity,
            down_direction(state[:, EULER]),
            channels,
            np.zeros(len(state)),
        )
        wrench = core.coriolis(self.plant.mass_matrix, velocity) + terms @ self.matrix
        wrench += self.push
        if self.truth.strips is not None:
            wrench += self.truth.strips.wrench(velocity)
        return wrench @ self.inverse_mass

    def rate(self, state: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the time derivative of the state."""
        rate = np.empty_like(state)
        down = down_direction(state[:, EULER])
        rate[:, VELOCITY] = self.acceleration(state)
        rate[:, EULER] = euler_rates(down, state[:, 3:6])
        rate[:, DEPTH] = (down * state[:, :3]).sum(axis=1)
        lag = self.truth.fin_lag
        rate[:, FINS] = (commands - state[:, FINS]) / lag if lag else 0.0
        return rate

    def receive(self, state: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the state as new commands arrive: fins without lag jump to them."""
        after = state.copy()
        if not self.truth.fin_lag:
            after[:, FINS] = commands
        return after

    def advance(self, state: FloatArray, commands: FloatArray, duration: float) -> FloatArray:
        """Return the state after holding the commands for a while."""
        n_steps = round(duration / STEP)
        h = duration / n_steps
        for _ in range(n_steps):
            k1 = self.rate(state, commands)
            k2 = self.rate(state + h / 2 * k1, commands)
            k3 = self.rate(state + h / 2 * k2, commands)
            k4 = self.rate(state + h * k3, commands)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return state


def down_direction(euler: FloatArray) -> FloatArray:
    """Return the world's down in the body, ``R^T e3``."""
    roll, pitch = euler[:, 0], euler[:, 1]
    level = np.cos(pitch)
    return np.array((-np.sin(pitch), np.sin(roll) * level, np.cos(roll) * level)).T


def euler_rates(down: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the rates of roll, pitch and yaw from the body's turning rates."""
    x, y, z = down.T
    p, q, r = rates.T
    level = y * y + z * z
    yaw_rate = (q * y + r * z) / level
    return np.array((p - yaw_rate * x, (q * z - r * y) / np.sqrt(level), yaw_rate)).T

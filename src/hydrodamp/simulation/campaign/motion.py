"""Vehicles in motion side by side: equation 1 of the paper, in plain NumPy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.simulation.campaign.truth import Truth
from hydrodamp.vehicle.actuators import Fin, Propeller, wrench_of
from hydrodamp.vehicle.vehicle import Vehicle


@dataclass(frozen=True)
class Body:
    """Inertia, weight, fins and propeller of a vehicle with two pairs of fins."""

    mass_matrix: FloatArray
    restoring: FloatArray
    lift: FloatArray
    drag: FloatArray
    thrust: FloatArray

    @classmethod
    def of(cls, vehicle: Vehicle) -> Body:
        """Return the matrices of a vehicle with rudder, elevator and propeller."""
        fins = {one.command: one for one in vehicle.actuators if isinstance(one, Fin)}
        pair = (fins["rudder"], fins["elevator"])
        propeller = next(one for one in vehicle.actuators if isinstance(one, Propeller))
        return cls(
            mass_matrix=vehicle.mass_matrix,
            restoring=frozen(vehicle.restoring_matrix.T),
            lift=frozen([wrench_of(fin.force) for fin in pair]),
            drag=frozen([wrench_of(fin.drag) for fin in pair]),
            thrust=wrench_of({"X": propeller.thrust, "K": propeller.torque}),
        )

    @property
    def fins_at(self) -> float:
        """Position of the rudders, forward of the origin [m]."""
        return float(self.lift[0, 5] / self.lift[0, 1])

    @cached_property
    def inverse_mass(self) -> FloatArray:
        """Inverse of the mass matrix, shape (6, 6), symmetric."""
        return frozen(np.linalg.inv(self.mass_matrix))

    @cached_property
    def coriolis_table(self) -> FloatArray:
        """``H(M e_j) e_k`` in row ``6 j + k``, shape (36, 6)."""
        momenta = np.repeat(self.mass_matrix.T, 6, axis=0)
        return frozen(momentum_wrench(momenta, np.tile(np.eye(6), (6, 1))))

    def coriolis_wrench(self, velocity: FloatArray) -> FloatArray:
        """Return ``H(M nu) nu``, which does no work."""
        products = velocity[:, :, np.newaxis] * velocity[:, np.newaxis, :]
        return products.reshape(-1, 36) @ self.coriolis_table

    def restoring_wrench(self, down: FloatArray) -> FloatArray:
        """Return the wrench of weight and buoyancy."""
        return down @ self.restoring

    def fin_wrench(self, velocity: FloatArray, angles: FloatArray) -> FloatArray:
        """Return lift and drag of the fins."""
        surge = velocity[:, :1]
        per_flow = angles @ self.lift + angles**2 @ self.drag
        return surge * np.abs(surge) * per_flow

    def propulsion(self, rpm: FloatArray) -> FloatArray:
        """Return the wrench of the propeller."""
        return np.outer(rpm * np.abs(rpm), self.thrust)


def momentum_wrench(momentum: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return ``H(p) nu = [p1 x w ; p1 x v1 + p2 x w]`` of equation 1."""
    linear, angular = momentum[:, :3], momentum[:, 3:]
    moving, turning = velocity[:, :3], velocity[:, 3:]
    force = np.cross(linear, turning)
    moment = np.cross(linear, moving) + np.cross(angular, turning)
    return np.concatenate((force, moment), axis=1)


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
    """The equation of motion of one body in one kind of water."""

    body: Body
    truth: Truth
    propulsion: FloatArray

    @property
    def steady_surge(self) -> FloatArray:
        """Surge speed of each vehicle, level and straight, shape (n,) [m/s]."""
        speed: FloatArray = np.sqrt(-self.propulsion[:, 0] / self.truth.quadratic[0, 0])
        return speed

    def pushed(self, wrench: FloatArray) -> Motion:
        """Return the same motion with a constant wrench added."""
        return replace(self, propulsion=self.propulsion + wrench)

    def acceleration(self, state: FloatArray) -> FloatArray:
        """Return the body acceleration."""
        velocity, body = state[:, VELOCITY], self.body
        fins = self.truth.effective_fins(velocity, state[:, FINS])
        wrench = (
            body.coriolis_wrench(velocity)
            + self.truth.hull_wrench(velocity)
            + body.restoring_wrench(down_direction(state[:, EULER]))
            + body.fin_wrench(velocity, fins)
            + self.propulsion
        )
        return wrench @ body.inverse_mass

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

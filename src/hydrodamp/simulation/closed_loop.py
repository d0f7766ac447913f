"""Batched six-degree-of-freedom simulation of equation 1 by the classical Runge-Kutta method.

For n vehicles side by side, with Euler angles Theta = (roll, pitch, yaw) and position x,

    M nu_dot = H(M nu) nu + K xi(nu, c) + d,   Theta_dot = T(Theta) omega,   x_dot = R(Theta) v.

K differs between the members of an ensemble of damping coefficients; d is a disturbance wrench.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, equation_table, held_channels
from hydrodamp.vehicle.vehicle import Vehicle

VELOCITY, EULER, POSITION, DEPTH = slice(0, 6), slice(6, 9), slice(9, 12), 11
"""Columns of a state; the position is north, east and depth [m]."""

N_STATES = 12
"""Number of these columns; states of actuators may follow."""

MEASURED = [*range(9), DEPTH]
"""Columns of a state that sensors measure."""

Rate = Callable[[FloatArray, float], FloatArray]
"""From a state and the elapsed fraction of the step to the time derivative of the state."""


def rk4_step(rate: Rate, state: FloatArray, h: float) -> FloatArray:
    """Return the state after a step of ``h`` seconds."""
    k1 = rate(state, 0.0)
    k2 = rate(state + h / 2 * k1, 0.5)
    k3 = rate(state + h / 2 * k2, 0.5)
    k4 = rate(state + h * k3, 1.0)
    return state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def integrate(rate: Rate, state: FloatArray, duration: float, max_step: float) -> FloatArray:
    """Return the state after a duration, in equal steps of at most ``max_step`` seconds."""
    n_steps = int(np.ceil(duration / max_step - 1e-9))  # 1e-9: rounding of the quotient
    for _ in range(n_steps):
        state = rk4_step(rate, state, duration / n_steps)
    return state


def down_direction(euler: FloatArray) -> FloatArray:
    """Return the down vector ``R^T e3`` in body axes, shape (n, 3)."""
    (sr, sp), (cr, cp) = np.sin(euler[:, :2]).T, np.cos(euler[:, :2]).T
    return np.array((-sp, sr * cp, cr * cp)).T


def pose_rates(velocity: FloatArray, euler: FloatArray) -> FloatArray:
    """Return the time derivatives of Euler angles and position, shape (n, 6)."""
    u, v, w, p, q, r = velocity.T
    (sr, sp, sy), (cr, cp, cy) = np.sin(euler).T, np.cos(euler).T
    yaw_rate, starboard, downward = (sr * q + cr * r) / cp, cr * v - sr * w, sr * v + cr * w
    forward = cp * u + sp * downward
    rates = (
        *(p + sp * yaw_rate, cr * q - sr * r, yaw_rate),
        *(cy * forward - sy * starboard, sy * forward + cy * starboard, cp * downward - sp * u),
    )
    return np.array(rates).T


@dataclass(frozen=True, eq=False)
class EquationOfMotion:
    """Right-hand side of equation 1; vehicle k has ``matrices[k % n_members]`` for K."""

    table: EquationTable
    matrices: FloatArray
    inverse_mass: FloatArray

    @classmethod
    def of(
        cls, vehicle: Vehicle, model: DampingModel, coefficients: Sequence[FloatArray]
    ) -> EquationOfMotion:
        """Return the equation for several sets of the coefficients of one model."""
        table = equation_table(vehicle, (model,), actuators=bool(vehicle.actuators))
        entries = table.entries(model)
        matrices = frozen([table.with_unknown(entries, values) for values in coefficients])
        return cls(table, matrices, core.mass_inverse(table.plant))

    def inputs(
        self, commands: Mapping[str, FloatArray], n: int
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the channels of held commands, and the propulsion speed where it is known."""
        vehicle = self.table.vehicle
        speed = vehicle.propulsion_speed(commands) if self.table.actuators else None
        return held_channels(self.table, commands, n), speed

    def wrench(
        self,
        velocity: FloatArray,
        down: FloatArray,
        channels: FloatArray,
        propulsion_speed: FloatArray | None,
    ) -> FloatArray:
        """Return K xi, the wrench of damping, actuators and weight, shape (n, 6)."""
        if propulsion_speed is None:
            u, v, w = velocity[:, :3].T
            propulsion_speed = np.sqrt(u * u + v * v + w * w)
        factors = self.table.plant.factors
        terms = core.regressor(factors, velocity, down, channels, propulsion_speed)
        terms = terms.reshape(-1, len(self.matrices), 1, terms.shape[1])
        return np.asarray(np.matmul(terms, self.matrices)).reshape(-1, 6)

    def acceleration(
        self,
        state: FloatArray,
        channels: FloatArray,
        propulsion_speed: FloatArray | None,
        disturbance: FloatArray | float = 0.0,
    ) -> FloatArray:
        """Return the acceleration nu_dot, shape (n, 6)."""
        velocity = np.ascontiguousarray(state[:, VELOCITY])
        wrench = core.coriolis(self.table.plant.mass_matrix, velocity)
        wrench += self.wrench(velocity, down_direction(state[:, EULER]), channels, propulsion_speed)
        wrench += disturbance
        return np.asarray(wrench @ self.inverse_mass)

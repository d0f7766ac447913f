"""Vehicles in motion side by side: equation 1 of the paper, in plain NumPy."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.simulation.campaign.body import Body
from hydrodamp.simulation.campaign.truth import Truth

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
        return self._acceleration(state, down_direction(state[:, EULER]))

    def _acceleration(self, state: FloatArray, down: FloatArray) -> FloatArray:
        velocity, body = state[:, VELOCITY], self.body
        fins = self.truth.effective_fins(velocity, state[:, FINS])
        wrench = (
            body.coriolis_wrench(velocity)
            + self.truth.hull_wrench(velocity)
            + body.restoring_wrench(down)
            + body.fin_wrench(velocity, fins)
            + self.propulsion
        )
        acceleration: FloatArray = wrench @ body.inverse_mass
        return acceleration

    def rate(self, state: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the time derivative of the state."""
        rate = np.empty_like(state)
        down = down_direction(state[:, EULER])
        rate[:, VELOCITY] = self._acceleration(state, down)
        rate[:, EULER] = euler_rates(down, state[:, 3:6])
        rate[:, DEPTH] = (down * state[:, :3]).sum(axis=1)
        rate[:, FINS] = self._fin_rate(state[:, FINS], commands)
        return rate

    def _fin_rate(self, fins: FloatArray, commands: FloatArray) -> FloatArray | float:
        lag = self.truth.fin_lag
        return (commands - fins) / lag if lag else 0.0

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

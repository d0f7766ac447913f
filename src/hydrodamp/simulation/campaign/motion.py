"""Vehicles in motion side by side: equation 1 of the paper, in plain NumPy.

A state is one row a vehicle, 12 columns::

    0..5   velocity u v w p q r          [m/s, rad/s]
    6..8   attitude roll pitch yaw       [rad], north-east-down
    9      depth                         [m], positive down
    10 11  rudder and elevator angle     [rad]

``M dnu/dt = H(M nu) nu + hull + restoring + fins + propeller``, attitude by the
Euler-angle rates (the campaign pitches by less than 20 degrees), Runge-Kutta of
fourth order with steps of 0.02 s, commands held over each tenth of a second.
"""

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
    """The equation of motion of one body in one kind of water.

    Attributes
    ----------
    body : Body
        What is known of the vehicle.
    truth : Truth
        What the water does.
    propulsion : ndarray, shape (n, 6)
        Wrench of each vehicle's propeller, constant [N, N m], body frame.
    """

    body: Body
    truth: Truth
    propulsion: FloatArray

    @property
    def steady_surge(self) -> FloatArray:
        """Surge speed of each vehicle, level and straight, shape (n,) [m/s]."""
        speed: FloatArray = np.sqrt(-self.propulsion[:, 0] / self.truth.quadratic[0, 0])
        return speed

    def pushed(self, wrench: FloatArray) -> Motion:
        """Return the same motion with a constant wrench added.

        Parameters
        ----------
        wrench : ndarray, shape (n, 6)
            Force X Y Z [N] and moment K M N [N m] on each vehicle, body frame.

        Returns
        -------
        motion : Motion
            Pushed from the outside.
        """
        return replace(self, propulsion=self.propulsion + wrench)

    def acceleration(self, state: FloatArray) -> FloatArray:
        """Return the body acceleration.

        Parameters
        ----------
        state : ndarray, shape (n, 12)
            See the module.

        Returns
        -------
        acceleration : ndarray, shape (n, 6)
            Time derivative of the velocity's components [m/s^2, rad/s^2].
        """
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
        """Return the time derivative of the state.

        Parameters
        ----------
        state : ndarray, shape (n, 12)
            See the module.
        commands : ndarray, shape (n, 2)
            Rudder and elevator commands in force [rad].

        Returns
        -------
        rate : ndarray, shape (n, 12)
            Per second.
        """
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
        """Return the state as new commands arrive: fins without lag jump to them.

        Parameters
        ----------
        state : ndarray, shape (n, 12)
            The state just before.
        commands : ndarray, shape (n, 2)
            Rudder and elevator commands [rad].

        Returns
        -------
        state : ndarray, shape (n, 12)
            The state just after, a copy.
        """
        after = state.copy()
        if not self.truth.fin_lag:
            after[:, FINS] = commands
        return after

    def advance(self, state: FloatArray, commands: FloatArray, duration: float) -> FloatArray:
        """Return the state after holding the commands for a while.

        Parameters
        ----------
        state : ndarray, shape (n, 12)
            The state now.
        commands : ndarray, shape (n, 2)
            Rudder and elevator commands [rad].
        duration : float
            How long [s].

        Returns
        -------
        state : ndarray, shape (n, 12)
            The state then.
        """
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
    """Return the world's down in the body, ``R^T e3``.

    Parameters
    ----------
    euler : ndarray, shape (n, 3)
        Roll, pitch, yaw [rad].

    Returns
    -------
    down : ndarray, shape (n, 3)
        Unit vectors.

    Examples
    --------
    >>> down_direction(np.array([[0.0, np.pi / 6, 1.0]])).round(3)
    array([[-0.5  ,  0.   ,  0.866]])
    """
    roll, pitch = euler[:, 0], euler[:, 1]
    level = np.cos(pitch)
    return np.array((-np.sin(pitch), np.sin(roll) * level, np.cos(roll) * level)).T


def euler_rates(down: FloatArray, rates: FloatArray) -> FloatArray:
    """Return the rates of roll, pitch and yaw from the body's turning rates.

    Parameters
    ----------
    down : ndarray, shape (n, 3)
        The world's down in the body; the x axis must not be upright.
    rates : ndarray, shape (n, 3)
        Body rates p, q, r [rad/s].

    Returns
    -------
    euler_rates : ndarray, shape (n, 3)
        Rates of roll, pitch and yaw [rad/s].

    Examples
    --------
    >>> euler_rates(np.array([[0.0, 0.0, 1.0]]), np.array([[0.1, 0.2, 0.3]]))
    array([[0.1, 0.2, 0.3]])
    """
    x, y, z = down.T
    p, q, r = rates.T
    level = y * y + z * z
    yaw_rate = (q * y + r * z) / level
    return np.array((p - yaw_rate * x, (q * z - r * y) / np.sqrt(level), yaw_rate)).T

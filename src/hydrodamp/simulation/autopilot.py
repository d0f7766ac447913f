"""Autopilot: PID loops of heading, pitch and depth with anti-windup, and control allocation.

Each loop drives one command: c += s clip(K_P e + clip(K_I int e dt) - K_D de/dt), s = +1 or -1.
Depth and pitch are a cascade where the vehicle dives by its pitch; the propeller's command is
interpolated from steady speeds. All functions take a batch of n vehicles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray

FIN_LIMIT = float(np.radians(20.0))
"""Largest output of a loop of the VT 690 [rad]; published."""

INTEGRAL_LIMIT = float(np.radians(5.0))
"""Largest contribution of the integral to that output [rad]; published."""


@dataclass(frozen=True)
class Pid:
    """A PID controller whose integral stops at its own limit and while the output is limited."""

    proportional: float
    integral: float
    derivative: float
    limit: float = FIN_LIMIT

    def step(
        self, error: FloatArray, rate: FloatArray, integral: FloatArray, period: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the output, and the integral of the error after this sample.

        ``rate`` is the time derivative of the controlled variable.
        """
        increased = integral + error * period
        term = self.integral * increased
        max_term = INTEGRAL_LIMIT / FIN_LIMIT * self.limit
        limited_term = np.clip(term, -max_term, max_term)
        demand = self.proportional * error + limited_term - self.derivative * rate
        output = np.clip(demand, -self.limit, self.limit)
        unsaturated = (term == limited_term) & (demand == output)
        return output, np.where(unsaturated, increased, integral)


class Loop(NamedTuple):
    """A PID loop, the index of the command that it drives, and the sign of its effect."""

    pid: Pid
    command_index: int
    sign: float


class AutopilotState(NamedTuple):
    """Integrals of depth, pitch and heading error (n, 3), and recent measured depths (m, n)."""

    integrals: FloatArray
    depths: FloatArray

    @classmethod
    def initial(cls, n_vehicles: int) -> AutopilotState:
        """Return the state before the first sample."""
        return cls(np.zeros((n_vehicles, 3)), np.empty((0, n_vehicles)))


@dataclass(frozen=True, eq=False)
class Autopilot:
    """From setpoints of speed, heading and depth to commands.

    Attributes
    ----------
    names : tuple of str
        The commands.
    lowest, highest, rates : ndarray, shape (k,)
        Their limits and rate limits [1/s].
    heading, pitch, depth : Loop or None
        With a ``pitch`` loop, the output of ``depth`` is a pitch setpoint.
    propeller : int or None
        Index of the command that sets the speed; None where no single propeller does.
    speeds, propeller_commands : ndarray
        Steady speeds [m/s] and the propeller's commands that hold them.
    depth_window : float or None
        Time over which measured depths are differenced for the depth rate [s]; by default it is
        computed from velocity and attitude.
    """

    names: tuple[str, ...]
    lowest: FloatArray
    highest: FloatArray
    rates: FloatArray
    heading: Loop | None
    pitch: Loop | None
    depth: Loop | None
    propeller: int | None = None
    speeds: FloatArray | None = None
    propeller_commands: FloatArray | None = None
    depth_window: float | None = None

    def limits(self, index: int) -> tuple[float, float]:
        """Return the limits of one command."""
        return float(self.lowest[index]), float(self.highest[index])

    def propeller_command(self, speed: FloatArray) -> FloatArray:
        """Return the command of the propeller at a steady speed [m/s]."""
        assert self.speeds is not None
        assert self.propeller_commands is not None
        return np.interp(speed, self.speeds, self.propeller_commands)

    def control(
        self,
        measured: FloatArray,
        setpoints: FloatArray,
        overlay: FloatArray,
        state: AutopilotState,
        period: float,
    ) -> tuple[FloatArray, AutopilotState]:
        """Return commands within their limits, shape (n, k), and the next state.

        ``measured`` (n, 10) is velocity, Euler angles and depth, ``setpoints`` (n, 3) speed,
        heading and depth, ``overlay`` (n, k) is added to the commands.
        """
        commands, integrals = overlay.copy(), state.integrals.copy()

        def output(loop: Loop, column: int, error: FloatArray, rate: FloatArray) -> FloatArray:
            demand, integrals[:, column] = loop.pid.step(
                error, rate, state.integrals[:, column], period
            )
            return loop.sign * demand

        depths = state.depths
        if self.propeller is not None:
            commands[:, self.propeller] += self.propeller_command(setpoints[:, 0])
        if self.heading is not None:
            error = setpoints[:, 1] - measured[:, 8]
            error -= 2.0 * np.pi * np.round(error / (2.0 * np.pi))  # the shorter turn
            demand = output(self.heading, 2, error, measured[:, 5])
            commands[:, self.heading.command_index] += demand
        if self.depth is not None:
            rate, depths = self._depth_rate(measured, depths, period)
            demand = output(self.depth, 0, setpoints[:, 2] - measured[:, 9], rate)
            if self.pitch is not None:
                demand = output(self.pitch, 1, demand - measured[:, 7], measured[:, 4])
            commands[:, (self.pitch or self.depth).command_index] += demand
        return np.clip(commands, self.lowest, self.highest), AutopilotState(integrals, depths)

    def _depth_rate(
        self, measured: FloatArray, depths: FloatArray, period: float
    ) -> tuple[FloatArray, FloatArray]:
        if self.depth_window is None:
            return depth_rate(measured), depths
        n_depths = round(self.depth_window / period) + 1
        depths = np.concatenate((depths, measured[np.newaxis, :, 9]))[-n_depths:]
        return (depths[-1] - depths[0]) / (max(len(depths) - 1, 1) * period), depths


def depth_rate(measured: FloatArray) -> FloatArray:
    """Return the time derivative of depth from velocity and Euler angles, shape (n,) [m/s]."""
    roll, pitch = measured[:, 6], measured[:, 7]
    downward = np.sin(roll) * measured[:, 1] + np.cos(roll) * measured[:, 2]
    return np.asarray(np.cos(pitch) * downward - np.sin(pitch) * measured[:, 0])

"""Closed loop of equation 1 and a PID autopilot, for a batch of n vehicles (Runge-Kutta method).

With Euler angles Theta = (roll, pitch, yaw) and position x,

    M nu_dot = H(M nu) nu + K xi(nu, c) + d,   Theta_dot = T(Theta) omega,   x_dot = R(Theta) v.

K differs between the members of an ensemble of damping coefficients; d is a disturbance wrench.

Each loop of the autopilot drives one command: c += s clip(K_P e + clip(K_I int e dt) - K_D de/dt),
s = +1 or -1. Depth and pitch are a cascade where the vehicle dives by its pitch; the propeller's
command is interpolated from steady speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray, frozen
from hydrodamp.kernels import core
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, equation_table, held_channels
from hydrodamp.vehicle.vehicle import Vehicle

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


def stack_runs(columns: FloatArray) -> FloatArray:
    """Return an array of shape (n_samples, n_runs, k) as rows, one run after another."""
    return columns.swapaxes(0, 1).reshape(-1, columns.shape[-1])


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


def motion_rates(acceleration: FloatArray, state: FloatArray) -> FloatArray:
    """Return the time derivatives of velocity, Euler angles and position, shape (n, 12)."""
    return np.hstack([acceleration, pose_rates(state[:, VELOCITY], state[:, EULER])])


Setpoints = Callable[[int, FloatArray], FloatArray]
"""From the index of a sample and states to setpoints of speed, heading and depth (n, 3)."""

Advance = Callable[[int, FloatArray, FloatArray], FloatArray]
"""From the index of a sample, states and held commands to the states at the next sample."""


def simulate_closed_loop(
    autopilot: Autopilot,
    state: FloatArray,
    errors: Iterable[FloatArray],
    overlays: FloatArray,
    setpoints: Setpoints,
    advance: Advance,
    period: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return states, measurements and commands of n vehicles, shape (samples, n, ...).

    ``errors`` (n, 10) of each sample are those of the sensors; ``overlays`` (samples, n, k) are
    added to the commands, which change at most at the rate limits.
    """
    memory, max_change = AutopilotState.initial(len(state)), autopilot.rates * period
    samples: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for index, error in enumerate(errors):
        measured = state[:, MEASURED] + error
        arguments = measured, setpoints(index, state), overlays[index], memory, period
        commands, memory = autopilot.control(*arguments)
        if samples:
            last = samples[-1][2]
            commands = np.clip(commands, last - max_change, last + max_change)
        samples.append((state, measured, commands))
        state = advance(index, state, commands)
    states, measurements, sent = map(np.array, zip(*samples, strict=True))
    return states, measurements, sent


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

"""Motion of a ship in the horizontal plane under rudder and propeller, for draws of its damping.

Each draw starts from steady straight motion at the approach speed, and keeps its propeller's
command: propeller, sway and neutral rudder solve equation 1, also where the ship is unstable.
Steady turns solve it for the surge and the rudder of a yaw rate.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import ProblemError
from hydrodamp.experiment_design.autopilot_design import bisect
from hydrodamp.experiment_design.closed_loop import Trajectories
from hydrodamp.experiment_design.steady_states import solve_steady_states
from hydrodamp.simulation import closed_loop as dynamics
from hydrodamp.vehicle.vehicle import Vehicle

TURN, ZIGZAG_10, ZIGZAG_20, STOP = "turning circle", "zigzag 10/10", "zigzag 20/20", "stopping"

MANOEUVRES = {
    TURN: (35.0, np.inf, 1.0),
    ZIGZAG_10: (10.0, 10.0, 1.0),
    ZIGZAG_20: (20.0, 20.0, 1.0),
    STOP: (0.0, np.inf, -1.0),
}
"""Rudder angle, change of heading that reverses it [deg], and factor of the propeller's command."""

CIRCLE = 540.0
"""Change of heading after which a turn is steady [deg]."""

PERIOD, ZIGZAG_PERIOD, MAX_DURATION = 0.04, 0.01, 60.0
"""Steps and longest run, in lengths at the approach speed. In a step of a zigzag the heading
changes by 0.2 deg; the rudder is reversed at the nearest sample."""

MAX_RATIO = 10.0
"""A motion has diverged where a velocity is beyond this multiple of the approach speed."""

N_YAW_RATES = 61
"""Steady turns on the curve of the spiral."""

ROLES = {"rudder": "rud|helm|delta|fin|steer", "propeller": "prop|thrust|rpm|rps|ahead|engine"}
_ROWS = [AXES.index(axis) for axis in "XYN"]
_VARIED = np.radians(10.0)  # rudder that shows its sign: beyond the play of a linkage


@dataclass(frozen=True, eq=False)
class Ship:
    """Equation 1 in the horizontal plane for draws of the coefficients, and its commands.

    A steady motion (n, 4) has surge, sway, rudder angle to starboard and the propeller's command.
    """

    vehicle: Vehicle
    equation: dynamics.EquationOfMotion
    names: tuple[str, ...]
    rudder: int
    propeller: int
    speed: float
    length: float
    rudder_rate: float
    side: float = 1.0

    @property
    def time_unit(self) -> float:
        """The time for one length at the approach speed, L/V [s]."""
        return self.length / self.speed

    def commands(self, angle: FloatArray, propeller: FloatArray) -> FloatArray:
        """Return commands (n, k) of rudder angles to starboard and of the propeller."""
        commands = np.zeros((len(angle), len(self.names)))
        commands[:, self.rudder], commands[:, self.propeller] = self.side * angle, propeller
        return commands

    def acceleration(self, commands: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Return the acceleration under commands (n, k), as a function of the state."""
        values = dict(zip(self.names, commands.T, strict=True))
        inputs = self.equation.inputs(values, len(commands))
        return lambda state: self.equation.acceleration(state, *inputs)

    def advance(self, state: FloatArray, commands: FloatArray, period: float) -> FloatArray:
        """Return the states after a period."""
        acceleration = self.acceleration(commands)

        def rate(state: FloatArray, _: float) -> FloatArray:
            return dynamics.motion_rates(acceleration(state), state)

        return dynamics.rk4_step(rate, state, period)

    def residual(self, steady: FloatArray, yaw_rate: float) -> FloatArray:
        """Return the accelerations (..., n, 3) of steady motions, in units of L and V."""
        rows = steady.reshape(-1, 4)
        state = np.zeros((len(rows), dynamics.N_STATES))
        state[:, :2], state[:, 5] = rows[:, :2], yaw_rate
        acceleration = self.acceleration(self.commands(*rows[:, 2:].T))(state)[:, _ROWS]
        acceleration *= np.array([1.0, 1.0, self.length]) * self.time_unit / self.speed
        return acceleration.reshape(*steady.shape[:-1], 3)

    def solve_steady(self, start: FloatArray, yaw_rate: float, known: int) -> FloatArray:
        """Return the steady motion at a yaw rate, one column known; NaN where there is none."""
        scale = np.array([self.speed, self.speed, 1.0, np.abs(start[0, 3])])
        free = [column for column in range(4) if column != known]
        residual = partial(self.residual, yaw_rate=yaw_rate)
        steady, is_solved = solve_steady_states(residual, start, scale, free)
        is_solved &= np.abs(steady[:, 2]) < np.pi / 2.0
        return np.where(is_solved[:, None], steady, np.nan)

    def simulate(self, name: str, steady: FloatArray) -> Trajectories:
        """Simulate to starboard and port, two vehicles per draw, until all ended or diverged."""
        angle, heading = np.radians(MANOEUVRES[name][:2])
        signs, stage = np.repeat([1.0, -1.0], len(steady)), np.zeros(2 * len(steady))
        steady, samples = np.tile(steady, (2, 1)), []
        period = self.time_unit * (PERIOD if np.isinf(heading) else ZIGZAG_PERIOD)
        state = np.zeros((len(steady), dynamics.N_STATES))
        state[:, :2], commands = steady[:, :2], self.commands(*steady[:, 2:].T)
        max_change = np.full(len(self.names), np.inf)
        max_change[self.rudder] = self.rudder_rate * period
        for _ in range(round(MAX_DURATION * self.time_unit / period)):
            turned = signs * (-1.0) ** stage * (state[:, 8] + 0.5 * period * state[:, 5])
            stage[(turned >= heading) & (stage < 2.0)] += 1.0
            order = signs * (-1.0) ** stage * angle, MANOEUVRES[name][2] * steady[:, 3]
            change = self.commands(*order) - commands
            commands = commands + np.clip(change, -max_change, max_change)
            samples.append((state, commands))
            ended = (stage == 2.0) & (signs * state[:, 5] >= 0.0) | (state[:, 0] <= 0.0)
            ended |= np.abs(state[:, 8]) >= np.radians(CIRCLE)
            if np.all(ended | np.isnan(state[:, 0])):
                break
            state = self.advance(state, commands, period)
            sizes = np.abs(state[:, [0, 1, 5]] * [1.0, 1.0, self.length]).max(axis=1)
            state[ended | ~(sizes < MAX_RATIO * self.speed)] = np.nan
        states, sent = map(np.array, zip(*samples, strict=True))
        return Trajectories(np.zeros_like(states[..., :3]), states, states, sent, period)


def find_command(role: str, name: str, names: tuple[str, ...], vehicle: Vehicle) -> int:
    """Return the index of the rudder or the propeller: as named, or by the names of commands."""
    fitting = [each for each in names if re.search(ROLES[role], each.lower())]
    fitting = [each for each in names if each == name] if name else fitting
    if len(fitting) != 1:
        raise ProblemError(
            f"'{vehicle.name}' must have one {role}; got {name or ', '.join(fitting) or 'none'}. "
            f"The commands of its actuators and model are: {', '.join(names) or 'none'}. Name the "
            f"{role} among them, or use a model with one."
        )
    return names.index(fitting[0])


def approach(ship: Ship, n: int) -> tuple[Ship, FloatArray]:
    """Return the ship with the sign of its rudder, and steady straight motion at its speed."""
    start = np.tile([ship.speed, 0.0, 0.0, 0.0], (n, 1))

    def accelerates(exponent: FloatArray) -> BoolArray:
        start[:, 3] = 10.0**exponent
        return ship.residual(start, 0.0)[:, 0] > 0.0

    exponent = bisect(accelerates, np.full(n, -9.0), np.full(n, 9.0))
    if not accelerates(exponent)[0]:
        propeller = ship.names[ship.propeller]
        raise ProblemError(
            f"no value of `{propeller}` holds {ship.speed:g} m/s: state a lower speed, or another "
            "propeller."
        )
    angle = np.array([0.0, 0.0, _VARIED, 0.0])
    turn = ship.residual(start + angle, 0.0)[0, 2] - ship.residual(start - angle, 0.0)[0, 2]
    if turn == 0.0:
        rudder = ship.names[ship.rudder]
        raise ProblemError(f"`{rudder}` does not turn the ship: name another command as rudder.")
    ship = replace(ship, side=float(np.sign(turn)))
    steady = ship.solve_steady(start, 0.0, known=0)
    if np.isnan(steady[0, 0]):
        rudder = ship.names[ship.rudder]
        raise ProblemError(
            f"no angle of `{rudder}` within 90 deg holds {ship.speed:g} m/s straight ahead: check "
            "the constant terms and those of the propeller on Y and N."
        )
    return ship, steady


def trace_spiral(ship: Ship, steady: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return yaw rates between those of two turns, and rudder angles continued from straight on."""
    rates = np.linspace(-ends[1], ends[0], N_YAW_RATES)
    angles = np.full((N_YAW_RATES, len(steady)), np.nan)
    for order in (np.flatnonzero(rates >= 0.0), np.flatnonzero(rates < 0.0)[::-1]):
        motion = steady
        for index in order:
            motion = ship.solve_steady(motion, rates[index], known=3)
            angles[index] = motion[:, 2]
    return rates, angles

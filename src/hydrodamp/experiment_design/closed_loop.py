"""Closed-loop simulation of a dive for every member of an ensemble, and constraint violations.

Vehicle k of a batch has the damping of member k mod n_members. A constraint violation is g = (x -
limit) / range for depth and area and g = |x| / limit - 1 for angles and speed, feasible where g <=
0 at every sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.basis.term import AXES, VELOCITY_OF
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.log import Log
from hydrodamp.experiment_design.autopilot_design import DesignedAutopilot, bisect
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.simulation import closed_loop as dynamics
from hydrodamp.vehicle.vehicle import Vehicle

MAX_STEP = 0.1
"""Longest step of the Runge-Kutta integration [s]; as in the windows of output error."""

COURSE_RATE = float(np.radians(5.0))
"""Rate limit of the course setpoint [rad/s]. At an error near half a turn some members turn to port
and others to starboard, and their tracks diverge. At 10 deg/s the turns of a VT 690 to the next
course held its rudder at the stop for 13 % of a dive of 300 s, at 5 deg/s for 9 %."""

DIVERGENCE_LIMIT = 20.0
"""A member with a velocity beyond this has diverged [m/s, rad/s]."""

LIMIT_TOLERANCE = 1e-6
"""A command within this share of its limit counts as saturated."""

Disturbance = Callable[[FloatArray, FloatArray], FloatArray]
"""From velocities (n, 6) and commands (n, k) to an additional wrench (n, 6)."""

Course = Callable[[int, FloatArray], float]
"""From the index of a sample and positions (n, 2) to a course, added to heading setpoints [rad]."""

Excitation = tuple[FloatArray, FloatArray]
"""Setpoints (samples, n, 3) and overlays of commands (samples, n, k) of n dives."""

Guidance = Callable[[FloatArray], FloatArray]
"""From states (n, 12) to setpoints of speed, heading and depth (n, 3)."""


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Simulated time series of n vehicles, arrays of shape (samples, n, ...).

    ``setpoints`` are speed, heading and depth; ``states`` velocity, Euler angles and position;
    ``measured`` the velocity, Euler angles and depth with sensor noise.
    """

    setpoints: FloatArray
    states: FloatArray
    measured: FloatArray
    commands: FloatArray
    period: float

    def select(self, vehicles: slice | list[int] | IntArray) -> Trajectories:
        """Return the trajectories of some vehicles."""
        arrays = (self.setpoints, self.states, self.measured, self.commands)
        setpoints, states, measured, commands = (array[:, vehicles] for array in arrays)
        return Trajectories(setpoints, states, measured, commands, self.period)

    def log(self, vehicle: Vehicle, names: tuple[str, ...], *, exact: bool = False) -> Log:
        """Return the measured or the exact time series as a log, one segment per vehicle."""
        series = self.states[:, :, dynamics.MEASURED] if exact else self.measured
        n, n_vehicles = series.shape[:2]
        motion, commands = dynamics.stack_runs(series[:, :, :9]), dynamics.stack_runs(self.commands)
        position = np.dstack([self.states[:, :, 9:11], series[:, :, 9]])
        planar = set(vehicle.axes) <= {"X", "Y", "N"}
        return Log.from_arrays(
            np.tile(self.period * np.arange(n), n_vehicles),
            {VELOCITY_OF[axis]: motion[:, AXES.index(axis)] for axis in vehicle.axes},
            attitude=None if planar else quaternion_from_euler(motion[:, dynamics.EULER]),
            commands=dict(zip(names, commands.T, strict=True)),
            position=dynamics.stack_runs(position),
            segment=np.repeat([f"dive-{index}" for index in range(n_vehicles)], n).tolist(),
            source="planned dive",
        )

    def limit_violations(self, envelope: Envelope, *, area: bool = True) -> dict[str, FloatArray]:
        """Return the violation g of each limit, shape (samples, n); feasible where g <= 0.

        Violations of depth and area are relative to the width of their bands.
        """
        states = self.states
        speed = np.linalg.norm(states[:, :, :3], axis=2)
        max_speed = (1.0 + envelope.margin) * envelope.speed[1]
        violations = {
            "pitch": np.abs(np.degrees(states[:, :, 7])) / envelope.pitch - 1.0,
            "roll": np.abs(np.degrees(states[:, :, 6])) / envelope.roll - 1.0,
            "speed": speed / max_speed - 1.0,
        }
        bands = dict(envelope.area) if area and envelope.area is not None else {}
        bands["depth"] = (envelope.depth[0], envelope.max_depth)
        columns = {"north": 9, "east": 10, "depth": dynamics.DEPTH}
        for name, (low, high) in bands.items():
            value = states[:, :, columns[name]]
            violations[name] = np.maximum(value - high, low - value) / (high - low)
        return violations

    def saturation(self, autopilot: dynamics.Autopilot) -> dict[str, FloatArray]:
        """Return the share of time at a limit or rate limit, shape (n,), by command.

        The propeller is excluded: its steady commands are within its limits by design.
        """
        commands, lowest, highest = self.commands, autopilot.lowest, autopilot.highest
        margin = LIMIT_TOLERANCE * (highest - lowest)
        step = np.abs(np.diff(commands, axis=0, prepend=commands[:1]))
        max_step = autopilot.rates * self.period
        at_limit = (commands <= lowest + margin) | (commands >= highest - margin)
        shares = np.mean(at_limit | (step >= (1.0 - LIMIT_TOLERANCE) * max_step), axis=0).T
        pairs = enumerate(zip(autopilot.names, shares, strict=True))
        return dict(pair for index, pair in pairs if index != autopilot.propeller)


@dataclass(frozen=True, eq=False)
class ClosedLoopSimulator:
    """A vehicle with its autopilot, simulated for each member of an ensemble."""

    vehicle: Vehicle
    autopilot: DesignedAutopilot
    envelope: Envelope
    ensemble: DampingEnsemble
    equation: dynamics.EquationOfMotion
    disturbance: Disturbance | None = None

    @classmethod
    def of(
        cls,
        vehicle: Vehicle,
        autopilot: DesignedAutopilot,
        envelope: Envelope,
        ensemble: DampingEnsemble,
    ) -> ClosedLoopSimulator:
        """Return the simulator of a vehicle for an ensemble."""
        free = ensemble.extended_model.restricted_to(vehicle.axes)
        coefficients = [damping.onto(free) for damping in ensemble.dampings]
        equation = dynamics.EquationOfMotion.of(vehicle, free, coefficients)
        return cls(vehicle, autopilot, envelope, ensemble, equation)

    @property
    def n_members(self) -> int:
        """Number of members."""
        return len(self.ensemble.dampings)

    def with_members(self, indices: list[int]) -> ClosedLoopSimulator:
        """Return the simulator of some members, in that order."""
        dampings = tuple(self.ensemble.dampings[index] for index in indices)
        return replace(
            self,
            ensemble=replace(self.ensemble, dampings=dampings),
            equation=replace(self.equation, matrices=self.equation.matrices[indices]),
        )

    def simulate(
        self,
        excitation: Excitation,
        seed: int | None = None,
        course: Course = lambda *_: 0.0,
        guidance: Guidance | None = None,
    ) -> Trajectories:
        """Simulate each dive in closed loop for each member; a seed adds sensor noise.

        ``guidance`` replaces all setpoints but the first, which give the initial state.
        """
        setpoints, overlays = (np.repeat(each, self.n_members, axis=1) for each in excitation)
        n_samples, n = setpoints.shape[:2]
        noise = np.zeros((n_samples, 1, 10))
        if seed is not None:
            rng = np.random.default_rng(seed)
            noise = rng.standard_normal((n_samples, n, 10)) * self.envelope.noise_std
        noise[:, :, np.flatnonzero(~self.vehicle.free)] = 0.0
        period, state = self.envelope.period, np.zeros((n, dynamics.N_STATES))
        limited_course = np.full(n, course(0, state[:, 9:11]))
        state[:, 0], state[:, 8], state[:, dynamics.DEPTH] = setpoints[0].T
        state[:, 8] += limited_course
        if self.autopilot.propeller is None:
            state[:, 0] = 0.0

        def setpoints_of(index: int, state: FloatArray) -> FloatArray:
            nonlocal limited_course
            if guidance is not None:
                setpoints[index] = guidance(state)
            target = np.full(n, course(index, state[:, 9:11]))
            limited_course = limit_course_rate(limited_course, target, period)
            setpoints[index, :, 1] += limited_course
            return np.asarray(setpoints[index])

        motion = dynamics.simulate_closed_loop(
            self.autopilot, state, noise, overlays, setpoints_of, self._advance, period
        )
        return Trajectories(setpoints, *motion, period)

    def reachable_speeds(self) -> FloatArray:
        """Return the steady speed of each member at full thrust ahead [m/s]."""
        n = self.n_members
        commands = np.tile(self.autopilot.full_ahead, (n, 1))
        acceleration = self._acceleration(commands)

        def decelerates(speed: FloatArray) -> BoolArray:
            state = np.zeros((n, dynamics.N_STATES))
            state[:, 0] = speed
            return acceleration(state)[:, 0] <= 0.0

        return bisect(decelerates, np.zeros(n), np.full(n, DIVERGENCE_LIMIT))

    def worst_violation(self, trajectories: Trajectories) -> FloatArray:
        """Return the largest violation of any limit, shape (n, members)."""
        violations = trajectories.limit_violations(self.envelope, area=False).values()
        worst = np.max([violation.max(axis=0) for violation in violations], axis=0)
        return np.reshape(worst, (-1, self.n_members))

    def _acceleration(self, commands: FloatArray) -> Callable[[FloatArray], FloatArray]:
        """Return the acceleration under commands, as a function of the state."""
        values, disturbance = (
            dict(zip(self.autopilot.names, commands.T, strict=True)),
            self.disturbance,
        )
        inputs = self.equation.inputs(values, len(commands))

        def acceleration(state: FloatArray) -> FloatArray:
            wrench = disturbance(state[:, dynamics.VELOCITY], commands) if disturbance else 0.0
            return self.equation.acceleration(state, *inputs, wrench)

        return acceleration

    def _advance(self, _: int, state: FloatArray, commands: FloatArray) -> FloatArray:
        acceleration = self._acceleration(commands)

        def rate(state: FloatArray, _: float) -> FloatArray:
            return dynamics.motion_rates(acceleration(state), state)

        following = dynamics.integrate(rate, state, self.envelope.period, MAX_STEP)
        # Freeze diverged members at a pitch of -90 deg, which violates every envelope.
        diverged = ~np.all(np.abs(following[:, dynamics.VELOCITY]) < DIVERGENCE_LIMIT, axis=1)
        following[diverged, dynamics.VELOCITY] = 0.0
        following[diverged, 6:] = state[diverged, 6:]
        following[diverged, 7] = -np.pi / 2.0
        return following


def limit_course_rate(course: FloatArray, target: FloatArray, time: float) -> FloatArray:
    """Return courses after a time, changed towards the target at the rate limit."""
    error = (target - course + np.pi) % (2.0 * np.pi) - np.pi
    return course + np.clip(error, -COURSE_RATE * time, COURSE_RATE * time)

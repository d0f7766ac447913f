"""Batched closed-loop simulation: the vehicle under its autopilot, for an ensemble of damping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.experiment_design.autopilot import Autopilot
from hydrodamp.experiment_design.ensemble import DampingEnsemble
from hydrodamp.experiment_design.envelope import Envelope
from hydrodamp.kernels import core
from hydrodamp.simulation.problem import EquationTable, equation_table, held_channels
from hydrodamp.vehicle.vehicle import Vehicle

#: Longest step of the Runge-Kutta integration [s], as in the windows of output error.
STEP = 0.1

#: Rate limit of the course setpoint [rad/s]. At an error near half a turn some members turn to port
#: and others to starboard, and their tracks diverge. At 10 deg/s the turns of a VT 690 to the next
#: course held its rudder at the stop for 13 % of a dive of 300 s, at 5 deg/s for 9 %.
_TURNING = np.radians(5.0)

#: A member with a velocity beyond this has diverged [m/s, rad/s].
_DIVERGED = 20.0

#: Bisections in the search of a reachable speed.
_HALVINGS = 40

#: A command within this share of its limit counts as saturated.
_AT_LIMIT = 1e-6

#: From velocities (n, 6) and commands (n, k) to a wrench beside the damping (n, 6).
Beside = Callable[[FloatArray, FloatArray], FloatArray]

#: From the number of a sample and where the vehicles are (n, 2) to what is added to headings [rad].
Course = Callable[[int, FloatArray], float]

#: Setpoints of each vehicle at each sample, shape (samples, n, 3), and excitation of its commands.
Orders = tuple[FloatArray, FloatArray]

#: From states (n, 12) to setpoints of speed, heading and depth (n, 3).
Guidance = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Simulated time series of n vehicles, arrays of shape (samples, n, ...).

    ``setpoints`` are speed, heading and depth; ``states`` velocity, roll, pitch, yaw, north, east
    and depth; ``measured`` the velocity, attitude and depth with sensor noise.
    """

    setpoints: FloatArray
    states: FloatArray
    measured: FloatArray
    commands: FloatArray
    period: float

    def select(self, chosen: slice | IntArray | list[int]) -> Trajectories:
        """Return some of the vehicles."""
        return self._each(lambda one: one[:, chosen])

    def until(self, n: int) -> Trajectories:
        """Return the first samples."""
        return self._each(lambda one: one[:n])

    def _each(self, change: Callable[[FloatArray], FloatArray]) -> Trajectories:
        return replace(
            self,
            setpoints=change(self.setpoints),
            states=change(self.states),
            measured=change(self.measured),
            commands=change(self.commands),
        )

    def log(self, vehicle: Vehicle, names: tuple[str, ...], *, exact: bool = False) -> Log:
        """Return what the vehicles recorded, or what was, a segment each."""
        seen = self.states[:, :, :9] if exact else self.measured[:, :, :9]
        n, n_vehicles = seen.shape[:2]
        motion, commands = (_joined(one) for one in (seen, self.commands))
        free = {VELOCITY_OF[axis]: motion[:, AXES.index(axis)] for axis in vehicle.axes}
        down = self.states[:, :, 11] if exact else self.measured[:, :, 9]
        position = np.stack([self.states[:, :, 9], self.states[:, :, 10], down], axis=2)
        planar = set(vehicle.axes) <= {"X", "Y", "N"}
        return Log.from_arrays(
            np.tile(self.period * np.arange(n), n_vehicles),
            free,
            attitude=None if planar else motion[:, 6:9],
            commands=dict(zip(names, commands.T, strict=True)),
            position=_joined(position),
            segment=np.repeat([f"dive-{one}" for one in range(n_vehicles)], n).tolist(),
            source="planned dive",
        )


def _joined(columns: FloatArray) -> FloatArray:
    return np.ascontiguousarray(columns.swapaxes(0, 1)).reshape(-1, columns.shape[-1])


@dataclass(frozen=True, eq=False)
class ClosedLoopSimulator:
    """A vehicle with its autopilot, simulated for each member of an ensemble."""

    vehicle: Vehicle
    autopilot: Autopilot
    envelope: Envelope
    ensemble: DampingEnsemble
    table: EquationTable
    matrices: FloatArray
    inverse: FloatArray
    baseline: Beside | None = None

    @classmethod
    def of(
        cls, vehicle: Vehicle, autopilot: Autopilot, envelope: Envelope, ensemble: DampingEnsemble
    ) -> ClosedLoopSimulator:
        """Return the closed loop of a vehicle for an ensemble of damping."""
        table = equation_table(vehicle, (ensemble.wide,), actuators=bool(vehicle.actuators))
        free = ensemble.wide.restricted_to(vehicle.axes)
        entries = table.entries(free)
        matrices = [table.with_unknown(entries, one.onto(free)) for one in ensemble.dampings]
        inverse = core.mass_inverse(table.plant)
        return cls(vehicle, autopilot, envelope, ensemble, table, frozen(matrices), inverse)

    def with_members(self, chosen: list[int]) -> ClosedLoopSimulator:
        """Return the vehicle in some of the ensemble, in that order."""
        dampings = tuple(self.ensemble.dampings[place] for place in chosen)
        ensemble = replace(self.ensemble, dampings=dampings)
        return replace(self, ensemble=ensemble, matrices=self.matrices[chosen])

    def simulate(
        self,
        orders: Orders,
        seed: int | None = None,
        course: Course = lambda *_: 0.0,
        guidance: Guidance | None = None,
    ) -> Trajectories:
        """Simulate orders of n vehicles, member by member in turn; a seed adds sensor noise.

        ``guidance`` replaces all setpoints but the first, which give the initial state.
        """
        setpoints, overlays = orders[0].copy(), orders[1]
        samples, n = setpoints.shape[:2]
        errors = np.zeros((samples, 1, 10))
        if seed is not None:
            rng = np.random.default_rng(seed)
            errors = rng.standard_normal((samples, n, 10)) * self.envelope.noise_std
        period = self.envelope.period
        state, totals = np.zeros((n, 12)), np.zeros((n, 3))
        base = np.full(n, course(0, state[:, 9:11]))
        state[:, 0], state[:, 8], state[:, 11] = setpoints[0].T
        state[:, 8] += base
        if self.autopilot.propeller is None:
            state[:, 0] = 0.0
        last, locked = None, np.flatnonzero(~self.vehicle.free)
        states, measured, sent = [], [], []
        for place in range(samples):
            seen = state[:, [*range(9), 11]] + errors[place]
            seen[:, locked] = 0.0
            if guidance is not None:
                setpoints[place] = guidance(state)
            base = limit_course_rate(base, np.full(n, course(place, state[:, 9:11])), period)
            setpoints[place, :, 1] += base
            commands, totals = self.autopilot.control(
                seen, setpoints[place], overlays[place], totals, period
            )
            if last is not None:
                most = self.autopilot.rates * period
                commands = np.clip(commands, last - most, last + most)
            last = commands
            states.append(state)
            measured.append(seen)
            sent.append(commands)
            state = self._advance(state, commands, period)
        return Trajectories(setpoints, np.array(states), np.array(measured), np.array(sent), period)

    def reachable_speeds(self) -> FloatArray:
        """Return the steady speed of each member with all thrust ahead [m/s]."""
        n = len(self.matrices)
        commands = np.tile(self.autopilot.full_ahead, (n, 1))
        channels, held = self._inputs(commands)
        low, high = np.zeros(n), np.full(n, _DIVERGED)
        for _ in range(_HALVINGS):
            state = np.zeros((n, 12))
            state[:, 0] = 0.5 * (low + high)
            faster = self._rate(state, commands, channels, held)[:, 0] > 0.0
            low, high = np.where(faster, state[:, 0], low), np.where(faster, high, state[:, 0])
        return high

    def _inputs(self, commands: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return derived channels of commands, and the speed that propulsion sustains."""
        given = dict(zip(self.autopilot.names, commands.T, strict=True))
        channels = held_channels(self.table, given, len(commands))
        return channels, self.vehicle.propulsion_speed(given) if self.table.actuators else None

    def _advance(self, state: FloatArray, commands: FloatArray, period: float) -> FloatArray:
        channels, held = self._inputs(commands)
        before, n_steps = state, int(np.ceil(period / STEP - 1e-9))
        h = period / n_steps
        for _ in range(n_steps):
            k1 = self._rate(state, commands, channels, held)
            k2 = self._rate(state + h / 2 * k1, commands, channels, held)
            k3 = self._rate(state + h / 2 * k2, commands, channels, held)
            k4 = self._rate(state + h * k3, commands, channels, held)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        # Freeze diverged members at a pitch of -90 deg, which violates every envelope.
        diverged = ~np.all(np.abs(state[:, :6]) < _DIVERGED, axis=1)
        state[diverged, :6] = 0.0
        state[diverged, 6:] = before[diverged, 6:]
        state[diverged, 7] = -np.pi / 2.0
        return state

    def _rate(
        self, state: FloatArray, commands: FloatArray, channels: FloatArray, held: FloatArray | None
    ) -> FloatArray:
        velocity = np.ascontiguousarray(state[:, :6])
        u, v, w, p, q, r = velocity.T
        (sr, sp, sy), (cr, cp, cy) = np.sin(state[:, 6:9]).T, np.cos(state[:, 6:9]).T
        down = np.array((-sp, sr * cp, cr * cp)).T
        speed = np.sqrt(u * u + v * v + w * w) if held is None else held
        terms = core.regressor(self.table.plant.factors, velocity, down, channels, speed)
        wrench = core.coriolis(self.vehicle.mass_matrix, velocity)
        terms = terms.reshape(-1, len(self.matrices), 1, terms.shape[1])
        wrench += np.matmul(terms, self.matrices).reshape(-1, 6)
        if self.baseline is not None:
            wrench += self.baseline(velocity, commands)
        rate = np.empty_like(state)
        rate[:, :6] = wrench @ self.inverse
        turning, across, sinking = (sr * q + cr * r) / cp, cr * v - sr * w, sr * v + cr * w
        ahead = cp * u + sp * sinking
        rate[:, 6:].T[:] = (
            *(p + sp * turning, cr * q - sr * r, turning),
            *(cy * ahead - sy * across, sy * ahead + cy * across, cp * sinking - sp * u),
        )
        return rate


def limit_course_rate(course: FloatArray, wanted: FloatArray, time: float) -> FloatArray:
    """Return courses after a time, moved towards the wanted ones at the rate limit."""
    left = (wanted - course + np.pi) % (2.0 * np.pi) - np.pi
    return course + np.clip(left, -_TURNING * time, _TURNING * time)


def limit_violations(
    envelope: Envelope, trajectories: Trajectories, *, area: bool = True
) -> dict[str, FloatArray]:
    """Return each limit's violation as a share of the limit, shape (samples, n); <= 0 inside.

    A violation of depth is a share of the band's height, of the area a share of its width.
    """
    states = trajectories.states
    depth, speed = states[:, :, 11], np.linalg.norm(states[:, :, :3], axis=2)
    room = envelope.max_depth - envelope.depth[0]
    found = {
        "depth": np.maximum(depth - envelope.max_depth, envelope.depth[0] - depth) / room,
        "pitch": np.abs(np.degrees(states[:, :, 7])) / envelope.pitch - 1.0,
        "roll": np.abs(np.degrees(states[:, :, 6])) / envelope.roll - 1.0,
        "speed": speed / ((1.0 + envelope.margin) * envelope.speed[1]) - 1.0,
    }
    bands = {} if envelope.area is None or not area else dict(envelope.area)
    for column, (name, band) in enumerate(bands.items(), start=9):
        place = states[:, :, column]
        found[name] = np.maximum(place - band[1], band[0] - place) / (band[1] - band[0])
    return found


def saturation(autopilot: Autopilot, trajectories: Trajectories) -> dict[str, FloatArray]:
    """Return the share of time at a limit or rate limit, shape (n,), by command.

    The propeller is left out: steady speeds are checked against its limit before.
    """
    commands, found = trajectories.commands, {}
    for index, name in enumerate(autopilot.names):
        if index == autopilot.propeller:
            continue
        (lowest, highest), values = autopilot.band(index), commands[:, :, index]
        margin = _AT_LIMIT * (highest - lowest)
        step = np.abs(np.diff(values, axis=0, prepend=values[:1]))
        at_rate = step >= (1.0 - _AT_LIMIT) * autopilot.rates[index] * trajectories.period
        at_limit = (values <= lowest + margin) | (values >= highest - margin)
        found[name] = np.mean(at_limit | at_rate, axis=0)
    return found

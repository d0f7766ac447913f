"""Dives sailed in simulation, side by side: each under its own orders, in its own water."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray, frozen
from hydrodamp.basis.atoms import AXES, VELOCITY_OF
from hydrodamp.data.log import Log
from hydrodamp.kernels import core
from hydrodamp.planning.envelope import Envelope
from hydrodamp.planning.helm import Helm
from hydrodamp.planning.waters import Waters
from hydrodamp.simulation.problem import Columns, columns, held_channels
from hydrodamp.vehicle.vehicle import Vehicle

#: Longest step of the Runge-Kutta integration [s], as in the windows of output error.
STEP = 0.1

#: How fast the course that is told turns [rad/s]. At an error near half a turn one draw turns to
#: port and the next to starboard, and they part for good.
_TURNING = np.radians(10.0)

#: A velocity beyond this is lost [m/s, rad/s].
_LOST = 20.0

#: From velocities (n, 6) and commands (n, k) to a wrench beside the damping (n, 6).
Beside = Callable[[FloatArray, FloatArray], FloatArray]

#: From the number of a sample and where the vehicles are (n, 2) to what is added to headings [rad].
Course = Callable[[int, FloatArray], float]

#: What is told to each vehicle at each sample, shape (samples, n, 3), and added to its commands.
Orders = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Voyage:
    """What happened, arrays of shape (samples, n, ...).

    ``told`` are speed, heading and depth; ``states`` velocity, roll, pitch, yaw, north, east and
    depth; ``measured`` the velocity, attitude and depth that the sensors saw.
    """

    told: FloatArray
    states: FloatArray
    measured: FloatArray
    commands: FloatArray
    period: float

    def part(self, chosen: slice | IntArray | list[int]) -> Voyage:
        """Return some of the vehicles."""
        return self._each(lambda one: one[:, chosen])

    def until(self, n: int) -> Voyage:
        """Return the first samples."""
        return self._each(lambda one: one[:n])

    def _each(self, change: Callable[[FloatArray], FloatArray]) -> Voyage:
        return replace(
            self,
            told=change(self.told),
            states=change(self.states),
            measured=change(self.measured),
            commands=change(self.commands),
        )

    def log(self, vehicle: Vehicle, names: tuple[str, ...], *, exact: bool = False) -> Log:
        """Return what the vehicles recorded, or what was, a segment each."""
        seen = self.states[:, :, :9] if exact else self.measured[:, :, :9]
        n, n_vehicles = seen.shape[:2]
        joined, commands = (_joined(one) for one in (seen, self.commands))
        free = {VELOCITY_OF[axis]: joined[:, AXES.index(axis)] for axis in vehicle.axes}
        down = self.states[:, :, 11] if exact else self.measured[:, :, 9]
        position = np.stack([self.states[:, :, 9], self.states[:, :, 10], down], axis=2)
        planar = set(vehicle.axes) <= {"X", "Y", "N"}
        return Log.from_arrays(
            np.tile(self.period * np.arange(n), n_vehicles),
            free,
            attitude=None if planar else joined[:, 6:9],
            commands=dict(zip(names, commands.T, strict=True)),
            position=_joined(position),
            segment=np.repeat([f"dive-{one}" for one in range(n_vehicles)], n).tolist(),
            source="planned dive",
        )


def _joined(columns: FloatArray) -> FloatArray:
    return np.ascontiguousarray(columns.swapaxes(0, 1)).reshape(-1, columns.shape[-1])


@dataclass(frozen=True, eq=False)
class Fleet:
    """A vehicle in several waters, and who steers it."""

    vehicle: Vehicle
    helm: Helm
    envelope: Envelope
    waters: Waters
    table: Columns
    matrices: FloatArray
    inverse: FloatArray
    beside: Beside | None = None

    @classmethod
    def of(cls, vehicle: Vehicle, helm: Helm, envelope: Envelope, waters: Waters) -> Fleet:
        """Return a vehicle in some waters."""
        table = columns(vehicle, (waters.wide,), actuators=bool(vehicle.actuators))
        free = waters.wide.restricted_to(vehicle.axes)
        entries = table.entries(free)
        matrices = [table.with_unknown(entries, one.onto(free)) for one in waters.dampings]
        inverse = core.mass_inverse(table.plant)
        return cls(vehicle, helm, envelope, waters, table, frozen(matrices), inverse)

    def in_waters(self, chosen: list[int]) -> Fleet:
        """Return the vehicle in some of the waters, in that order."""
        dampings = tuple(self.waters.dampings[place] for place in chosen)
        waters = replace(self.waters, dampings=dampings)
        return replace(self, waters=waters, matrices=self.matrices[chosen])

    def sail(
        self, orders: Orders, seed: int | None = None, course: Course = lambda *_: 0.0
    ) -> Voyage:
        """Sail orders, a vehicle each, water by water in turn; with noise where there is a seed."""
        told, overlays = orders[0].copy(), orders[1]
        samples, n = told.shape[:2]
        errors = np.zeros((samples, 1, 10))
        if seed is not None:
            rng = np.random.default_rng(seed)
            errors = rng.standard_normal((samples, n, 10)) * self.envelope.deviations
        period = self.envelope.period
        state, totals = np.zeros((n, 12)), np.zeros((n, 3))
        base = np.full(n, course(0, state[:, 9:11]))
        state[:, 0], state[:, 8], state[:, 11] = told[0].T
        state[:, 8] += base
        if self.helm.propeller is None:
            state[:, 0] = 0.0
        last, locked = None, np.flatnonzero(~self.vehicle.free)
        states, measured, sent = [], [], []
        for place in range(samples):
            seen = state[:, [*range(9), 11]] + errors[place]
            seen[:, locked] = 0.0
            base = turned(base, np.full(n, course(place, state[:, 9:11])), period)
            told[place, :, 1] += base
            commands, totals = self.helm.steer(seen, told[place], overlays[place], totals, period)
            if last is not None:
                most = self.helm.rates * period
                commands = np.clip(commands, last - most, last + most)
            last = commands
            states.append(state)
            measured.append(seen)
            sent.append(commands)
            state = self._advance(state, commands, period)
        return Voyage(told, np.array(states), np.array(measured), np.array(sent), period)

    def _advance(self, state: FloatArray, commands: FloatArray, period: float) -> FloatArray:
        given = dict(zip(self.helm.names, commands.T, strict=True))
        channels = held_channels(self.table, given, len(state))
        held = self.vehicle.propulsion_speed(given) if self.table.actuators else None
        before, n_steps = state, int(np.ceil(period / STEP - 1e-9))
        h = period / n_steps
        for _ in range(n_steps):
            k1 = self._rate(state, commands, channels, held)
            k2 = self._rate(state + h / 2 * k1, commands, channels, held)
            k3 = self._rate(state + h / 2 * k2, commands, channels, held)
            k4 = self._rate(state + h * k3, commands, channels, held)
            state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        # One that is lost stands on its bow, where it is: it must not spoil the others.
        lost = ~np.all(np.abs(state[:, :6]) < _LOST, axis=1)
        state[lost, :6] = 0.0
        state[lost, 6:] = before[lost, 6:]
        state[lost, 7] = -np.pi / 2.0
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
        if self.beside is not None:
            wrench += self.beside(velocity, commands)
        rate = np.empty_like(state)
        rate[:, :6] = wrench @ self.inverse
        turning, across, sinking = (sr * q + cr * r) / cp, cr * v - sr * w, sr * v + cr * w
        ahead = cp * u + sp * sinking
        rate[:, 6:].T[:] = (
            *(p + sp * turning, cr * q - sr * r, turning),
            *(cy * ahead - sy * across, sy * ahead + cy * across, cp * sinking - sp * u),
        )
        return rate


def turned(course: FloatArray, wanted: FloatArray, time: float) -> FloatArray:
    """Return courses some time later, turned towards others."""
    left = (wanted - course + np.pi) % (2.0 * np.pi) - np.pi
    return course + np.clip(left, -_TURNING * time, _TURNING * time)


def passed(envelope: Envelope, voyage: Voyage, *, area: bool = True) -> dict[str, FloatArray]:
    """Return by how much each limit is passed, as a share of it, shape (samples, n); else <= 0.

    Depth counts against the band's height, and an area against its width.
    """
    states = voyage.states
    depth, speed = states[:, :, 11], np.linalg.norm(states[:, :, :3], axis=2)
    room = envelope.deepest - envelope.depth[0]
    found = {
        "depth": np.maximum(depth - envelope.deepest, envelope.depth[0] - depth) / room,
        "pitch": np.abs(np.degrees(states[:, :, 7])) / envelope.pitch - 1.0,
        "roll": np.abs(np.degrees(states[:, :, 6])) / envelope.roll - 1.0,
        "speed": speed / ((1.0 + envelope.margin) * envelope.speed[1]) - 1.0,
    }
    bands = {} if envelope.area is None or not area else dict(envelope.area)
    for column, (name, band) in enumerate(bands.items(), start=9):
        place = states[:, :, column]
        found[name] = np.maximum(place - band[1], band[0] - place) / (band[1] - band[0])
    return found

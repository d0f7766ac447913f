"""Vehicles of the benchmark that have no two pairs of fins: an ROV under its pilot, a tanker.

What moves them is written here in NumPy, apart from the package that replays them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import hydrodamp as hd
from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITY_OF
from hydrodamp.simulation.campaign.conditions import Conditions
from hydrodamp.simulation.closed_loop import down_direction, integrate, pose_rates

STEP = 0.05
"""Longest step of the Runge-Kutta integration [s]."""

STARTING_DEPTH = 10.0
"""Depth at which every run starts [m]."""

Steered = Callable[[int, FloatArray, FloatArray], FloatArray]
"""From the number of a sample, what is measured and the last commands to new commands."""


def momentum_wrench(momentum: FloatArray, velocity: FloatArray) -> FloatArray:
    """Return ``H(p) nu = [p1 x w ; p1 x v1 + p2 x w]`` of equation 1."""
    linear, angular = momentum[:, :3], momentum[:, 3:]
    moving, turning = velocity[:, :3], velocity[:, 3:]
    force = np.cross(linear, turning)
    moment = np.cross(linear, moving) + np.cross(angular, turning)
    return np.concatenate((force, moment), axis=1)


@dataclass(frozen=True)
class Craft:
    """A vehicle that moves by equation 1 under commands.

    Attributes
    ----------
    vehicle : Vehicle
        Mass and restoring forces.
    names : tuple of str
        Of the commands that a log has.
    wrench : callable
        From velocity, shape (n, 6), and what its actuators do, to the wrench on it.
    recorded : callable
        From the same and the commands to what a log has of the actuation.
    lag, fastest : float
        Time constant of the actuators [s] and their largest rate [1/s].
    """

    vehicle: hd.Vehicle
    names: tuple[str, ...]
    wrench: Callable[[FloatArray, FloatArray], FloatArray]
    recorded: Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
    lag: float = 0.0
    fastest: float = np.inf

    @cached_property
    def inverse_mass(self) -> FloatArray:
        """Inverse of the mass matrix on the free axes."""
        free = np.flatnonzero(self.vehicle.free)
        inverse = np.zeros((6, 6))
        block = np.ix_(free, free)
        inverse[block] = np.linalg.inv(self.vehicle.mass_matrix[block])
        return inverse

    @cached_property
    def mass(self) -> FloatArray:
        """Mass matrix, zero on locked axes."""
        return np.nan_to_num(self.vehicle.mass_matrix) * np.outer(*[self.vehicle.free] * 2)

    def acceleration(self, state: FloatArray, push: FloatArray) -> FloatArray:
        """Return the body acceleration, equation 1."""
        velocity = state[:, :6]
        wrench = momentum_wrench(velocity @ self.mass, velocity)
        wrench += self.wrench(velocity, state[:, 10:])
        wrench += down_direction(state[:, 6:9]) @ self.vehicle.restoring_matrix.T + push
        return wrench @ self.inverse_mass

    def rate(self, state: FloatArray, commands: FloatArray, push: FloatArray) -> FloatArray:
        """Return the time derivative of the state: velocity, attitude, depth, actuators."""
        rate, pose = np.zeros_like(state), pose_rates(state[:, :6], state[:, 6:9])
        rate[:, :6] = self.acceleration(state, push)
        rate[:, 6:10] = pose[:, [0, 1, 2, 5]]
        if self.lag:
            towards = (commands - state[:, 10:]) / self.lag
            rate[:, 10:] = np.clip(towards, -self.fastest, self.fastest)
        return rate

    def advance(
        self, state: FloatArray, commands: FloatArray, push: FloatArray, period: float
    ) -> FloatArray:
        """Return the state after holding commands and push for a while."""
        return integrate(lambda value, _: self.rate(value, commands, push), state, period, STEP)


@dataclass(frozen=True)
class Sailed:
    """The runs of a craft as logs: as measured, and as they were with exact accelerations."""

    measured: hd.Log
    exact: hd.Log


def sail(
    craft: Craft,
    steered: Steered,
    speeds: Sequence[float],
    seed: int,
    duration: float,
    conditions: Conditions,
    period: float,
) -> Sailed:
    """Return runs that begin at some speeds ahead, all side by side, a segment each."""
    n, n_runs = round(duration / period) + 1, len(speeds)
    errors = conditions.sample_sensor_errors(seed, n_runs, n, period)
    pushes = conditions.sample_disturbances(seed, n_runs, n, period)
    state = np.zeros((n_runs, 10 + steered(0, errors[0], np.zeros((n_runs, 0))).shape[1]))
    state[:, 0], state[:, 9] = speeds, STARTING_DEPTH
    commands = np.zeros_like(state[:, 10:])
    seen, were, rates, sent = [], [], [], []
    for place, (error, push) in enumerate(zip(errors, pushes, strict=True)):
        measured = state[:, :10] + error
        commands = steered(place, measured, commands)
        if not craft.lag:
            state[:, 10:] = commands
        seen.append(measured)
        were.append(state[:, :10])
        rates.append(craft.acceleration(state, push))
        sent.append(craft.recorded(state[:, :6], state[:, 10:], commands))
        state = craft.advance(state, commands, push, period)
    logs = (_log(craft, period, seen, sent), _log(craft, period, were, sent, rates))
    return Sailed(*logs)


def _log(
    craft: Craft,
    period: float,
    states: list[FloatArray],
    sent: list[FloatArray],
    rates: list[FloatArray] | None = None,
) -> hd.Log:
    joined, commands = (np.swapaxes(one, 0, 1) for one in (states, sent))
    n_runs, n = joined.shape[:2]
    velocity, attitude = joined[..., :6].reshape(-1, 6), joined[..., 6:9].reshape(-1, 3)
    free = {VELOCITY_OF[axis]: "XYZKMN".index(axis) for axis in craft.vehicle.axes}
    planar = len(free) < 6
    return hd.Log.from_arrays(
        np.tile(period * np.arange(n), n_runs),
        {name: velocity[:, place] for name, place in free.items()},
        attitude=None if planar else attitude,
        commands=dict(zip(craft.names, commands.reshape(n_runs * n, -1).T, strict=True)),
        acceleration=None if rates is None else np.swapaxes(rates, 0, 1).reshape(-1, 6),
        segment=[f"run-{run}" for run in range(n_runs) for _ in range(n)],
        source="benchmark",
    )


CHANNELS = ("ch_forward", "ch_lateral", "ch_heave", "ch_roll", "ch_pitch", "ch_yaw")
"""The pilot's channels, -1 to 1, one an axis."""

THRUST: FloatArray = np.diag([12.0, 12.0, 14.0, 1.2, 1.2, 2.0])
THRUST[0, 4], THRUST[1, 3], THRUST[1, 5] = 0.4, -0.4, 0.3
"""Wrench per unit of each channel, a row a channel [N, N m]; the horizontal thrusters leak."""


@dataclass(frozen=True)
class Joystick:
    """A pilot who tries one or two channels at a time, and comes back to the starting depth."""

    table: FloatArray

    @classmethod
    def drawn(cls, seed: int, n_runs: int, duration: float, period: float) -> Joystick:
        """Return steps of 2 to 6 s, the rotations gently, from a seed."""
        rng = np.random.default_rng([seed, 2022])
        table = np.zeros((round(duration / period) + 1, n_runs, 6))
        for run in range(n_runs):
            begin = 1.0
            while begin < duration:
                end = begin + rng.uniform(2.0, 6.0)
                active = rng.choice(6, size=rng.integers(1, 3), replace=False)
                level = rng.uniform(0.2, 0.8, active.size) * rng.choice((-1.0, 1.0), active.size)
                span = slice(round(begin / period), round(end / period))
                table[span, run, active] = np.round(level * np.where(active > 2, 0.5, 1.0), 2)
                begin = end + rng.uniform(0.0, 2.0)
        return cls(table)

    def __call__(self, place: int, measured: FloatArray, last: FloatArray) -> FloatArray:
        commands: FloatArray = self.table[place].copy()
        back = np.clip(0.15 * (STARTING_DEPTH - measured[:, 9]), -0.4, 0.4)
        commands[:, 2] += np.round(back * (commands[:, 2] == 0.0), 1)
        return commands


def rov_drag() -> hd.Damping:
    """Return the published drag of the BlueROV2, but for linear damping of roll and pitch."""
    found = hd.published["bluerov2"]
    return hd.Damping.from_dict(found.model, {**found.as_dict(), "K_p": -0.4, "M_q": -0.4})


def rov() -> Craft:
    """Return the BlueROV2; its thrust is proportional to the channels."""
    linear, square = _diagonals(rov_drag())

    def wrench(velocity: FloatArray, channels: FloatArray) -> FloatArray:
        water: FloatArray = velocity * linear + velocity * np.abs(velocity) * square
        return water + channels @ THRUST

    return Craft(hd.fleet["bluerov2"], CHANNELS, wrench, lambda _, __, commands: commands)


def heavy_rov() -> Craft:
    """Return the BlueROV2 Heavy with lift, and thrust that bends and lags: like no model here."""
    linear, square = _diagonals(hd.published["bluerov2-heavy"])
    linear = linear + np.array([0.0, -20.0, 0.0, -0.8, 0.0, -0.5])
    gains = THRUST * [2.0, 2.0, 2.0, 0.7, 0.7, 1.6]

    def wrench(velocity: FloatArray, channels: FloatArray) -> FloatArray:
        u, v, w, _, q, r = velocity.T
        lift = np.array((-8 * v * r, -30 * u * v, -40 * u * w, 0 * u, 8 * u * w, 5 * u * v)).T
        lift[:, 4:] += np.array((-0.8 * np.abs(u) * q, -0.6 * np.abs(u) * r)).T
        bent = 0.3 * channels + 0.7 * channels * np.abs(channels)
        water: FloatArray = velocity * linear + velocity * np.abs(velocity) * square + lift
        return water + bent @ gains

    recorded = lambda _, __, commands: commands  # noqa: E731
    return Craft(hd.fleet["bluerov2-heavy"], CHANNELS, wrench, recorded, lag=0.15)


def _diagonals(drag: hd.Damping) -> tuple[FloatArray, FloatArray]:
    pairs = list(zip("XYZKMN", "uvwpqr", strict=True))
    linear = np.array([drag[f"{axis}_{name}"] for axis, name in pairs])
    return linear, np.array([drag[f"{axis}_{name}|{name}|"] for axis, name in pairs])


@dataclass(frozen=True)
class Tanker:
    """KVLCC2 at 7 m by the MMG standard method.

    Yasukawa and Yoshimura (2015), "Introduction of MMG standard method for ship maneuvering
    predictions", J. Mar. Sci. Technol. 20, 37-52; coefficients by way of ShipMMG.jl, data.jl.
    """

    length: float = 7.0
    draught: float = 0.455
    rps: float = 10.4

    def __call__(self, velocity: FloatArray, acting: FloatArray) -> FloatArray:
        u, v, r = velocity[:, 0], velocity[:, 1], velocity[:, 5]
        speed = np.maximum(np.hypot(u, v), 1e-6)
        wrench = np.zeros_like(velocity)
        wrench[:, [0, 1, 5]] = self._hull(speed, v / speed, r * self.length / speed)
        wrench[:, [0, 1, 5]] += self._rudder(u, v, r, acting[:, 0])
        wrench[:, 0] += (1 - 0.220) * self.thrust(velocity)
        return wrench

    def _hull(self, speed: FloatArray, v: FloatArray, r: FloatArray) -> FloatArray:
        x = -0.022 - 0.040 * v**2 + 0.002 * v * r + 0.011 * r**2 + 0.771 * v**4
        y = -0.315 * v + 0.083 * r - 1.607 * v**3 + 0.379 * v**2 * r - 0.391 * v * r**2
        n = -0.137 * v - 0.049 * r - 0.030 * v**3 - 0.294 * v**2 * r + 0.055 * v * r**2
        y, n = y + 0.008 * r**3, n - 0.013 * r**3
        scale = 500.0 * self.length * self.draught * speed**2
        return np.array((scale * x, scale * y, scale * self.length * n)).T

    def _inflow(self, u: FloatArray, v: FloatArray, r: FloatArray) -> tuple[FloatArray, ...]:
        """Return what is left of surge at the propeller, its advance ratio and K_T."""
        speed = np.maximum(np.hypot(u, v), 1e-6)
        angle = np.arctan2(-v, u) + 0.48 * r * self.length / speed
        more = (1 - np.exp(-2.0 * np.abs(angle))) * np.where(angle > 0, 0.6, 0.1)
        left = np.minimum(0.60 * (1 + more), 1.0)
        ratio = u * left / (self.rps * 0.216)
        return left, ratio, 0.2931 - 0.2753 * ratio - 0.1385 * ratio**2

    def thrust(self, velocity: FloatArray) -> FloatArray:
        """Return the thrust of the propeller [N]."""
        gain = self._inflow(velocity[:, 0], velocity[:, 1], velocity[:, 5])[2]
        return 1000.0 * self.rps**2 * 0.216**4 * gain

    def _rudder(self, u: FloatArray, v: FloatArray, r: FloatArray, angle: FloatArray) -> FloatArray:
        left, ratio, gain = self._inflow(u, v, r)
        speed = np.maximum(np.hypot(u, v), 1e-6)
        drift = np.arctan2(-v, u) + 0.710 * r * self.length / speed
        across = speed * drift * np.where(drift > 0, 0.640, 0.395)
        race = 1 + 0.50 * (np.sqrt(1 + 8 * gain / (np.pi * ratio**2)) - 1)
        share = 0.216 / 0.345
        along = 1.09 * u * left * np.sqrt(share * race**2 + 1 - share)
        force = 500.0 * 0.0539 * (along**2 + across**2) * 2.747
        force = force * np.sin(angle - np.arctan2(across, along))
        lever = self.length * (0.500 + 0.312 * 0.464)
        side = force * np.cos(angle)
        return np.array((-(1 - 0.387) * force * np.sin(angle), -1.312 * side, lever * side)).T


def tanker(vehicle: hd.Vehicle) -> Craft:
    """Return the tanker of the zigzags of HSVA; the rudder and the thrust are recorded."""
    water, added = Tanker(), vehicle.added_mass
    assert added is not None
    munk = added[0, 0] - added[1, 1]

    def wrench(velocity: FloatArray, acting: FloatArray) -> FloatArray:
        # The hull's moment is measured with the added mass's own in it; equation 1 has that apart.
        total = water(velocity, acting)
        total[:, 5] -= munk * velocity[:, 0] * velocity[:, 1]
        return total

    def recorded(velocity: FloatArray, acting: FloatArray, _: FloatArray) -> FloatArray:
        return np.column_stack((acting[:, 0], water.thrust(velocity)))

    fastest = np.radians(15.8)  # 2.34 degrees a second at full size, by the root of 45.7
    return Craft(vehicle, ("rudder", "thrust"), wrench, recorded, lag=0.1, fastest=fastest)


@dataclass(frozen=True)
class Zigzag:
    """Rudder to one side until the heading has gone to that side, then to the other [rad]."""

    rudder: FloatArray
    heading: FloatArray

    @classmethod
    def of(cls, *angles: tuple[float, float]) -> Zigzag:
        """Return one zigzag a run: angles of rudder and heading [deg], starboard positive."""
        rudder, heading = np.radians(angles).T
        return cls(rudder, heading)

    def __call__(self, place: int, measured: FloatArray, last: FloatArray) -> FloatArray:
        way = np.sign(last[:, 0]) if place else np.sign(self.rudder)
        gone = way * measured[:, 8] > np.abs(self.heading)
        way = np.where(gone, -way, way)
        return (way * np.abs(self.rudder))[:, np.newaxis]

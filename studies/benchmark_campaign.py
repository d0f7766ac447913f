"""What a campaign of the benchmark is, and how one is sailed and recorded."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

import hydrodamp as hd
from benchmark_crafts import Craft, Steered, sail
from benchmark_plans import Sea
from hydrodamp.simulation.campaign.conditions import WHITE_NOISE, Conditions
from hydrodamp.vehicle.actuators import Actuator


class Logs(NamedTuple):
    """What is told of a vehicle and what was measured.

    For a check, where they are known: what really happened to which vehicle in the test, and the
    coefficients of its water where a table of terms is all there is to it.
    """

    vehicle: hd.Vehicle
    train: hd.Log
    test: hd.Log
    exact: hd.Log | None = None
    body: hd.Vehicle | None = None
    true: hd.Damping | None = None


@dataclass(frozen=True, eq=False)
class Campaign:
    """A vehicle, a log to identify from and one to replay; made when first asked for.

    Attributes
    ----------
    name : str
        Such as ``"sname/200s"``: what is sailed, and how.
    models : tuple of DampingModel
        Which make sense: the paper's eight, with more terms where the actuation is unknown.
    make : callable
        Sails or reads the logs.
    group : str
        ``"seen"``, or ``"unseen"`` for those that nobody looks at while making a method.
    """

    name: str
    models: tuple[hd.DampingModel, ...]
    make: Callable[[], Logs]
    group: str = "seen"

    @cached_property
    def logs(self) -> Logs:
        """All three, made once."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hd.HydrodampWarning)
            return self.make()

    @property
    def vehicle(self) -> hd.Vehicle:
        """All that a method is told of the vehicle."""
        return self.logs.vehicle

    @property
    def train(self) -> hd.Log:
        """What a method identifies from."""
        return self.logs.train

    @property
    def test(self) -> hd.Log:
        """What its results replay."""
        return self.logs.test


@dataclass(frozen=True)
class Recording:
    """How a log departs from the plainest one, and what is told of the actuators.

    Attributes
    ----------
    acceleration : float or None
        Standard deviation of recorded accelerations, in those of a strapdown unit (``IMU``);
        None where none are recorded.
    wrench : float or None
        Where given, the log has the actuators' wrench in place of commands, times this.
    fins : float
        Fins are told to be so many times as strong as they are.
    """

    acceleration: float | None = None
    wrench: float | None = None
    fins: float = 1.0

    def __call__(self, vehicle: hd.Vehicle, log: hd.Log, exact: hd.Log, seed: int) -> hd.Log:
        """Return the log as recorded."""
        if self.acceleration is not None and exact.acceleration is not None:
            errors = np.random.default_rng([seed, 1]).standard_normal((log.n, 6)) * IMU
            acceleration = exact.acceleration + self.acceleration * errors
            log = replace(log, acceleration=acceleration)
        if self.wrench is None:
            return log
        commands = {name: log.command(name) for name in log.command_names}
        acting = vehicle.known_wrench(log.velocity, log.down, commands)
        acting -= vehicle.restoring_wrench(log.down)
        speed = np.linalg.norm(log.velocity[:, :3], axis=1)
        ahead = vehicle.propulsion_speed(commands)
        return replace(
            log,
            wrench=self.wrench * acting,
            propulsion_ratio=None if ahead is None else ahead / speed,
            command_names=(),
            commands=np.empty((log.n, 0)),
        )

    def told(self, vehicle: hd.Vehicle) -> hd.Vehicle:
        """Return what is told of the vehicle."""
        if self.wrench is not None:
            return replace(vehicle, actuators=())
        return replace(vehicle, actuators=tuple(self._told(one) for one in vehicle.actuators))

    def _told(self, one: Actuator) -> Actuator:
        if not isinstance(one, hd.Fin):
            return one
        force = {axis: self.fins * gain for axis, gain in dict(one.force).items()}
        return replace(one, force=force)


PLAIN = Recording()
"""Commands, no accelerations, and the truth about the fins."""

IMU = np.array([1.96e-3] * 3 + [1.23e-2] * 3)
"""Of a strapdown unit: accelerometers, and published gyros by differences at 10 Hz."""


@dataclass(frozen=True)
class Sail:
    """How the campaign of a vehicle with two pairs of fins is made."""

    sea: Callable[[], Sea]
    seed: int
    duration: float
    conditions: Conditions = WHITE_NOISE
    rate: float = 10.0
    recording: Recording = PLAIN

    def __call__(self) -> Logs:
        sea = self.sea().at(self.rate)
        (found,) = sea.plan.simulate((self.seed,), self.duration, self.conditions)
        vehicle, record = found.vehicle, self.recording
        return Logs(
            record.told(vehicle),
            record(vehicle, found.train, found.exact_train, self.seed),
            record(vehicle, found.test, found.exact_test, self.seed + 1),
            found.exact_test,
            vehicle,
            sea.true,
        )


@dataclass(frozen=True)
class Pilot:
    """How the campaign of an ROV or a ship is made: the last two runs are held out."""

    craft: Callable[[], Craft]
    steered: Callable[[int, int, float, float], Steered]
    seed: int
    duration: float
    conditions: Conditions = WHITE_NOISE
    rate: float = 10.0
    n_runs: int = 6
    speed: float = 0.0
    true: Callable[[], hd.Damping] | None = None
    recording: Recording = PLAIN

    def __call__(self) -> Logs:
        craft, period = self.craft(), 1.0 / self.rate
        steered = self.steered(self.seed, self.n_runs, self.duration, period)
        speeds = [self.speed] * self.n_runs
        found = sail(craft, steered, speeds, self.seed, self.duration, self.conditions, period)
        names = [segment.name for segment in found.exact.segments]
        (train, seen), (test, exact) = (
            (found.measured.select(*part), found.exact.select(*part))
            for part in (names[:-2], names[-2:])
        )
        return Logs(
            craft.vehicle,
            self.recording(craft.vehicle, train, seen, self.seed),
            self.recording(craft.vehicle, test, exact, self.seed + 1),
            exact,
            craft.vehicle,
            None if self.true is None else self.true(),
        )

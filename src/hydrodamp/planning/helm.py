"""How a vehicle is steered: which command does what, and the loops that hold depth and heading."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import ProblemError, list_faults
from hydrodamp.kernels import core
from hydrodamp.models.damping import Damping
from hydrodamp.planning.envelope import Envelope, Gains, Loops, checked
from hydrodamp.simulation.campaign.autopilot import FIN_LIMIT, Pid
from hydrodamp.simulation.problem import columns, held_channels
from hydrodamp.vehicle.actuators import Matrix
from hydrodamp.vehicle.vehicle import Vehicle

#: Natural frequency of a loop of heading or pitch, and of depth where a command lifts [rad/s].
_FAST, _SLOW = 1.5, 0.5

#: Damping ratio of both, and gain of the integral against the proportional one [1/s].
_RATIO, _INTEGRAL = 0.9, 0.02

#: From an error of depth [m] to a pitch: slope of the path, and time of the derivative [s].
_CLIMB, _AHEAD = 0.14, 1.4

#: A command acts on an axis where it makes so much of the strongest there.
_ACTS = 0.05

#: Halvings in the search of the command that holds a speed.
_HALVINGS = 60


class Loop(NamedTuple):
    """A loop: gains, and the place and the sense of the command that it moves."""

    pid: Pid
    place: int
    sense: float


@dataclass(frozen=True, eq=False)
class Helm:
    """What is told, and by which commands.

    Attributes
    ----------
    names : tuple of str
        The commands.
    lowest, highest, rates : ndarray, shape (k,)
        Their limits and largest rates [1/s].
    propeller : int or None
        Place of the one that drives a vehicle without thrusters; none where commands lift at rest.
    heading, pitch, depth : Loop or None
        Of a vehicle that dives by its pitch ``depth`` gives a pitch.
    hovers : bool
        Whether a command lifts, or turns the vehicle, at rest.
    """

    names: tuple[str, ...]
    lowest: FloatArray
    highest: FloatArray
    rates: FloatArray
    propeller: int | None
    heading: Loop | None
    pitch: Loop | None
    depth: Loop | None
    hovers: bool
    speeds: FloatArray
    turns: FloatArray

    @property
    def overlays(self) -> list[int]:
        """Places of the commands to which something is added."""
        return [place for place in range(len(self.names)) if place != self.propeller]

    def band(self, place: int) -> tuple[float, float]:
        """Return the limits of one command."""
        return float(self.lowest[place]), float(self.highest[place])

    def driving(self, speed: FloatArray) -> FloatArray:
        """Return the command of the propeller at a steady speed ahead [m/s]."""
        return np.interp(speed, self.speeds, self.turns)

    def steer(
        self,
        seen: FloatArray,
        told: FloatArray,
        overlay: FloatArray,
        totals: FloatArray,
        step: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Return commands within their limits, and the integrals of the loops.

        Of each vehicle: what is measured (10), what is told (speed, heading, depth), what is added
        to each command (k), and the integrals of depth, pitch and heading (3).
        """
        commands, after = overlay.copy(), totals.copy()
        if self.propeller is not None:
            commands[:, self.propeller] += self.driving(told[:, 0])
        if self.heading is not None:
            error = np.arctan2(np.sin(told[:, 1] - seen[:, 8]), np.cos(told[:, 1] - seen[:, 8]))
            asked, after[:, 2] = self.heading.pid.step(error, seen[:, 5], totals[:, 2], step)
            commands[:, self.heading.place] += self.heading.sense * asked
        if self.depth is not None:
            sinking = sunk(seen)
            deeper, after[:, 0] = self.depth.pid.step(
                told[:, 2] - seen[:, 9], sinking, totals[:, 0], step
            )
            if self.pitch is None:
                commands[:, self.depth.place] += self.depth.sense * deeper
            else:
                error = -deeper - seen[:, 7]
                asked, after[:, 1] = self.pitch.pid.step(error, seen[:, 4], totals[:, 1], step)
                commands[:, self.pitch.place] += self.pitch.sense * asked
        return np.clip(commands, self.lowest, self.highest), after


def sunk(seen: FloatArray) -> FloatArray:
    """Return how fast each vehicle sinks, from its velocity and attitude [m/s]."""
    roll, pitch = seen[:, 6], seen[:, 7]
    across = np.sin(roll) * seen[:, 1] + np.cos(roll) * seen[:, 2]
    found: FloatArray = np.cos(pitch) * across - np.sin(pitch) * seen[:, 0]
    return found


def helm(vehicle: Vehicle, damping: Damping, envelope: Envelope) -> Helm:
    """Find which command does what for a vehicle in its water."""
    names = tuple(dict.fromkeys((*vehicle.commands, *damping.model.commands)))
    if not names:
        raise ProblemError(
            f"nothing can be steered: vehicle '{vehicle.name}' has no actuators, and the model has "
            "no terms of commands. Give the vehicle `actuators`, or a model and a prior with gains."
        )
    checked(envelope, names)
    acting = _Acting(vehicle, damping, names)
    cruise = float(np.mean(envelope.speed))
    lowest, highest = _limits(vehicle, envelope, names)
    most = np.maximum(highest, -lowest)
    still, moving = acting.effects(0.0, most), acting.effects(cruise, most)
    lifts = [place for place in range(len(names)) if np.any(np.abs(still[place, [2, 5]]) > 0.0)]
    hovers = bool(lifts)
    propeller = None if hovers or not np.any(still[:, 0]) else int(np.argmax(np.abs(still[:, 0])))
    effects = still if hovers else moving
    others = [place for place in range(len(names)) if place != propeller]
    speeds, turns = np.zeros(2), np.zeros(2)
    if propeller is not None:
        speeds, turns = acting.steady(propeller, envelope, lowest, highest)
        lowest[propeller] = max(lowest[propeller], min(turns[0], 0.0))
        highest[propeller] = min(highest[propeller], turns[-1])
    if not np.all(np.isfinite(np.concatenate([lowest, highest]))):
        places = np.flatnonzero(~np.isfinite(lowest) | ~np.isfinite(highest))
        lacking = ", ".join(names[place] for place in places)
        told = f"say under `commands` how far {lacking} may go: {{lowest: ..., highest: ...}}"
        raise ProblemError(list_faults("envelope", [told]))
    rates = np.array(
        [
            np.inf if (one := envelope.commands.get(name)) is None or one.rate is None else one.rate
            for name in names
        ]
    )
    loops: dict[str, Loop | None] = {"heading": None, "pitch": None, "depth": None}
    if envelope.steering == "autopilot":
        loops = _loops(vehicle, envelope, effects, others, most, cruise, hovers)
    return Helm(
        names, lowest, highest, rates, propeller, **loops, hovers=hovers, speeds=speeds, turns=turns
    )


def _limits(
    vehicle: Vehicle, envelope: Envelope, names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return how far each command may go: by the envelope, and by the vehicle file."""
    own = {one.command: one.limit for one in vehicle.actuators if not isinstance(one, Matrix)}
    most = np.array([own.get(name) or np.inf for name in names])
    lowest, highest = -most, most.copy()
    for place, name in enumerate(names):
        if (given := envelope.commands.get(name)) is not None:
            lowest[place] = max(lowest[place], given.lowest)
            highest[place] = min(highest[place], given.highest)
    return lowest, highest


class _Acting:
    """What the commands do to a vehicle in its water."""

    def __init__(self, vehicle: Vehicle, damping: Damping, names: tuple[str, ...]) -> None:
        self.vehicle, self.names = vehicle, names
        self.table = columns(vehicle, (damping.model,), actuators=bool(vehicle.actuators))
        free = damping.model.restricted_to(vehicle.axes)
        self.matrix = self.table.with_unknown(self.table.entries(free), damping.onto(free))

    def wrench(self, speed: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the wrench at speeds straight ahead, level, under commands, shape (n, 6)."""
        n = len(speed)
        velocity, down = np.zeros((n, 6)), np.tile([0.0, 0.0, 1.0], (n, 1))
        velocity[:, 0] = speed
        given = dict(zip(self.names, commands.T, strict=True))
        channels = held_channels(self.table, given, n)
        ahead = self.vehicle.propulsion_speed(given) if self.table.actuators else None
        held = np.maximum(speed, 1e-6) if ahead is None else ahead
        found: FloatArray = (
            core.regressor(self.table.plant.factors, velocity, down, channels, held) @ self.matrix
        )
        return found

    def effects(self, speed: float, most: FloatArray) -> FloatArray:
        """Return the mean slope of the wrench on each command, shape (k, 6)."""
        step = np.where(np.isfinite(most), most, 1.0)
        moved = np.vstack([np.zeros(len(step)), np.diag(step)])
        wrench = self.wrench(np.full(len(moved), speed), moved)
        found = (wrench[1:] - wrench[0]) / step[:, None]
        strongest = np.maximum(np.abs(found * step[:, None]).max(axis=0), 1e-9)
        found[np.abs(found * step[:, None]) < _ACTS * strongest] = 0.0
        return np.asarray(found * self.vehicle.free)

    def steady(
        self, propeller: int, envelope: Envelope, lowest: FloatArray, highest: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return speeds of the band and the commands of the propeller that hold them."""
        speeds = np.linspace(*envelope.speed, 9)
        low = np.full(len(speeds), max(lowest[propeller], 0.0))
        high = np.full(len(speeds), min(highest[propeller], 1e6))
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            commands = np.zeros((len(speeds), len(self.names)))
            commands[:, propeller] = middle
            gains = self.wrench(speeds, commands)[:, 0] > 0.0
            low, high = np.where(gains, low, middle), np.where(gains, middle, high)
        least, most = max(lowest[propeller], 0.0), min(highest[propeller], 1e6)
        reached = (high < most * (1 - 1e-9)) & (high > least * (1 + 1e-9) + 1e-9)
        if not reached.any():
            name = self.names[propeller]
            told = (
                f"`speed` from {envelope.speed[0]:g} to {envelope.speed[1]:g} m/s is out of reach "
                f"of `{name}` from {lowest[propeller]:g} to {highest[propeller]:g}"
            )
            raise ProblemError(list_faults("envelope", [told]))
        return speeds[reached], high[reached]


def _pid(gains: Gains, limit: float) -> Pid:
    proportional, integral, derivative = (abs(float(one)) for one in gains)
    return Pid(proportional, integral, derivative, limit)


def _loops(
    vehicle: Vehicle,
    envelope: Envelope,
    effects: FloatArray,
    others: list[int],
    most: FloatArray,
    cruise: float,
    hovers: bool,
) -> dict[str, Loop | None]:
    """Return the loops: gains as given, or for a settled response of the nominal vehicle."""
    given, inertia = envelope.autopilot or Loops(), vehicle.mass_matrix.diagonal()

    def loop(axis: str, gains: Gains | None, frequency: float) -> Loop | None:
        number = AXES.index(axis)
        strength = np.abs(effects[others, number] * most[others])
        if axis not in vehicle.axes or not np.any(strength > 0.0):
            return None
        place = others[int(np.argmax(strength))]
        slope = effects[place, number] / inertia[number]
        stiff = frequency**2 / abs(slope)
        usual = stiff, _INTEGRAL * stiff, 2.0 * _RATIO * frequency / abs(slope)
        return Loop(_pid(gains or usual, float(most[place])), place, float(np.sign(slope)))

    heading = loop("N", given.heading, _FAST)
    if hovers:
        return {"heading": heading, "pitch": None, "depth": loop("Z", given.depth, _SLOW)}
    pitch = loop("M", given.pitch, _FAST)
    if pitch is None:
        return {"heading": heading, "pitch": None, "depth": None}
    climb = _CLIMB / cruise
    steep = min(FIN_LIMIT, 0.6 * float(np.radians(envelope.pitch)))
    diving = given.depth or (climb, climb * _INTEGRAL, climb * _AHEAD)
    # As published, the loop of depth gives a pitch, which is up where the vehicle is to rise.
    return {
        "heading": heading,
        "pitch": pitch,
        "depth": Loop(_pid(diving, steep), pitch.place, 1.0),
    }

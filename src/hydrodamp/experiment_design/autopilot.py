"""The autopilot: control allocation, limits of the actuators, loops of depth and heading."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES
from hydrodamp.errors import ProblemError, list_faults
from hydrodamp.experiment_design.envelope import Envelope, Gains, Loops, checked
from hydrodamp.experiment_design.forces import ASSUMED_THRUST, CommandForces
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.campaign.autopilot import FIN_LIMIT, Pid
from hydrodamp.vehicle.actuators import Fin, Matrix
from hydrodamp.vehicle.vehicle import Vehicle

#: Natural frequency of a loop of heading or pitch, and of depth where a command lifts [rad/s].
_FAST, _SLOW = 1.5, 0.5

#: Damping ratio of both, and gain of the integral against the proportional one [1/s].
_RATIO, _INTEGRAL = 0.9, 0.02

#: From an error of depth [m] to a pitch: slope of the path, and time of the derivative [s].
_CLIMB, _AHEAD = 0.14, 1.4


#: Rate of a fin where none is given [rad/s]. A fin of a REMUS 100 with stops at 15 deg and a lag of
#: 0.1 s (T. I. Fossen, PythonVehicleSimulator) starts at 2.6 rad/s: this is on the safe side.
FIN_RATE = 1.0


class Loop(NamedTuple):
    """A loop: gains, and the place and the sense of the command that it moves."""

    pid: Pid
    command_index: int
    sign: float


@dataclass(frozen=True, eq=False)
class Autopilot:
    """Setpoints to commands.

    Attributes
    ----------
    names : tuple of str
        The commands.
    lowest, highest, rates : ndarray, shape (k,)
        Their limits and rate limits [1/s].
    propeller : int or None
        Index of the one that drives a vehicle without thrusters; None where commands lift at rest.
    heading, pitch, depth : Loop or None
        Of a vehicle that dives by its pitch ``depth`` gives a pitch.
    hovers : bool
        Whether the vehicle can keep its station: a command lifts it, or turns it, at rest.
    speeds, turns : ndarray
        Steady speeds and the commands of the propeller that hold them.
    full_ahead : ndarray, shape (k,)
        Commands that push ahead with all that their limits allow.
    excites : bool
        Whether excitation is added to commands, beside setpoints.
    assumptions : tuple of str
        What neither vehicle nor envelope states.
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
    full_ahead: FloatArray
    excites: bool = True
    assumptions: tuple[str, ...] = ()

    @property
    def overlays(self) -> list[int]:
        """Indices of the commands to which excitation is added."""
        if not self.excites:
            return []
        return [place for place in range(len(self.names)) if place != self.propeller]

    def band(self, place: int) -> tuple[float, float]:
        """Return the limits of one command."""
        return float(self.lowest[place]), float(self.highest[place])

    def driving(self, speed: FloatArray) -> FloatArray:
        """Return the command of the propeller at a steady speed ahead [m/s]."""
        return np.interp(speed, self.speeds, self.turns)

    def control(
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
            commands[:, self.heading.command_index] += self.heading.sign * asked
        if self.depth is not None:
            sinking = sunk(seen)
            deeper, after[:, 0] = self.depth.pid.step(
                told[:, 2] - seen[:, 9], sinking, totals[:, 0], step
            )
            if self.pitch is None:
                commands[:, self.depth.command_index] += self.depth.sign * deeper
            else:
                error = -deeper - seen[:, 7]
                asked, after[:, 1] = self.pitch.pid.step(error, seen[:, 4], totals[:, 1], step)
                commands[:, self.pitch.command_index] += self.pitch.sign * asked
        return np.clip(commands, self.lowest, self.highest), after


def sunk(seen: FloatArray) -> FloatArray:
    """Return how fast each vehicle sinks, from its velocity and attitude [m/s]."""
    roll, pitch = seen[:, 6], seen[:, 7]
    across = np.sin(roll) * seen[:, 1] + np.cos(roll) * seen[:, 2]
    found: FloatArray = np.cos(pitch) * across - np.sin(pitch) * seen[:, 0]
    return found


def design_autopilot(vehicle: Vehicle, damping: Damping, envelope: Envelope) -> Autopilot:
    """Find which command does what for a vehicle of nominal damping."""
    names = tuple(dict.fromkeys((*vehicle.commands, *damping.model.commands)))
    if not names:
        raise ProblemError(
            f"nothing can be steered: vehicle '{vehicle.name}' has no actuators, and the model has "
            "no terms of commands. Give the vehicle `actuators`, or a model and a prior with gains."
        )
    checked(envelope, names)
    acting = CommandForces(vehicle, damping, names)
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
    full_ahead = np.zeros(len(names))
    assumptions, rates = _rates(vehicle, envelope, names)
    if propeller is not None:
        if not np.isfinite(highest[propeller]):
            highest[propeller] = acting.assumed_limit(propeller)
            lowest[propeller] = max(lowest[propeller], -highest[propeller])
            assumptions.append(
                f"No limit of `{names[propeller]}` is given: {highest[propeller]:.4g} is assumed, "
                f"where its thrust is {ASSUMED_THRUST:.0%} of the vehicle's weight. State it in "
                f"the envelope: `commands: {{{names[propeller]}: {{lowest: 0, highest: ...}}}}`."
            )
        full_ahead[propeller] = highest[propeller]
        speeds, turns = acting.steady(propeller, envelope, lowest, highest, assumptions)
        lowest[propeller] = max(lowest[propeller], min(turns[0], 0.0))
        highest[propeller] = min(highest[propeller], turns[-1])
    else:
        full_ahead = np.where(still[:, 0] > 0.0, highest, np.where(still[:, 0] < 0.0, lowest, 0.0))
    if not np.all(np.isfinite(np.concatenate([lowest, highest]))):
        places = np.flatnonzero(~np.isfinite(lowest) | ~np.isfinite(highest))
        lacking = ", ".join(names[place] for place in places)
        told = f"say under `commands` how far {lacking} may go: {{lowest: ..., highest: ...}}"
        raise ProblemError(list_faults("envelope", [told]))
    loops: dict[str, Loop | None] = {"heading": None, "pitch": None, "depth": None}
    if envelope.steering == "autopilot":
        loops = _loops(vehicle, envelope, effects, others, most, cruise, hovers)
    return Autopilot(
        names,
        lowest,
        highest,
        rates,
        propeller,
        loops["heading"],
        loops["pitch"],
        loops["depth"],
        hovers=hovers,
        speeds=speeds,
        turns=turns,
        full_ahead=full_ahead,
        assumptions=tuple(assumptions),
    )


def _rates(
    vehicle: Vehicle, envelope: Envelope, names: tuple[str, ...]
) -> tuple[list[str], FloatArray]:
    """Return the rate limit of each command, and what is assumed of fins."""
    fins = {one.command for one in vehicle.actuators if isinstance(one, Fin)}
    given = {name: one.rate for name, one in envelope.commands.items() if one.rate is not None}
    default = {name: FIN_RATE if name in fins else np.inf for name in names}
    rates = np.array([given.get(name, default[name]) for name in names])
    lacking = [name for name in names if name in fins and name not in given]
    if not lacking:
        return [], rates
    return [
        f"No rate of {', '.join(f'`{name}`' for name in lacking)} is given: {FIN_RATE:g} rad/s is "
        f"assumed. State it in the envelope: `commands: {{{lacking[0]}: {{rate: ...}}}}`."
    ], rates


def _limits(
    vehicle: Vehicle, envelope: Envelope, names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return how far each command may go: by the envelope, and by the vehicle file."""
    own = {one.command: one.limit for one in vehicle.actuators if not isinstance(one, Matrix)}
    most = np.array([own.get(name) or np.inf for name in names])
    lowest, highest = -most, most.copy()
    for place, name in enumerate(names):
        if (given := envelope.commands.get(name)) is not None:
            lowest[place] = max(lowest[place], -np.inf if given.lowest is None else given.lowest)
            highest[place] = min(highest[place], np.inf if given.highest is None else given.highest)
    return lowest, highest


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
        "depth": Loop(_pid(diving, steep), pitch.command_index, 1.0),
    }

"""PID autopilot by pole placement on a double integrator, each axis paired with one command.

With b = (d wrench / d command) / inertia of a command on an axis, a loop of natural frequency w
and damping ratio z has K_P = w^2 / |b|, K_D = 2 z w / |b| and an integral gain of a fixed ratio;
each axis is driven by the command of the largest authority. The depth loop of a vehicle that does
not hover has the published gains of the VT 690, scaled. Propeller commands solve equation 1 for
steady speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES
from hydrodamp.errors import ProblemError, list_faults
from hydrodamp.experiment_design.envelope import Envelope, Gains, LoopGains
from hydrodamp.models.damping import Damping
from hydrodamp.simulation.checks import CHANNEL_AXES
from hydrodamp.simulation.closed_loop import FIN_LIMIT, Autopilot, EquationOfMotion, Loop, Pid
from hydrodamp.simulation.ranges import ranges_of
from hydrodamp.vehicle.actuators import Fin, Matrix
from hydrodamp.vehicle.vehicle import Vehicle

FAST_FREQUENCY, SLOW_FREQUENCY = 1.5, 0.5
"""Natural frequencies of the loops of heading and pitch, and of depth by lift [rad/s]; assumed."""

DAMPING_RATIO = 0.9
"""Damping ratio of these loops; assumed."""

INTEGRAL_RATIO = 0.02
"""Integral gain over proportional gain [1/s]; assumed."""

CLIMB_GAIN, CLIMB_LEAD = 0.14, 1.4
"""From a depth error to pitch times speed [1/s], and lead time [s]; the VT 690's, rounded."""

FIN_RATE = 1.0
"""Rate of a fin where none is stated [rad/s]. A fin of a REMUS 100 with stops at 15 deg and a lag
of 0.1 s (T. I. Fossen, PythonVehicleSimulator) starts at 2.6 rad/s: this value is conservative."""

MIN_AUTHORITY = 0.05
"""A command acts on an axis if its wrench is at least this share of the largest; assumed."""

ASSUMED_THRUST = 0.1
"""Bollard thrust of a propeller without a limit, as a share of the weight. A REMUS 100 with
3.9 N/(m/s)^2 of drag (Prestero 2001) and its top speed of 2.5 m/s has 0.08."""

N_BISECTIONS, N_DOUBLINGS = 60, 100
"""Bisections of a bracketed command, and doublings until it is bracketed."""

N_STEADY_SPEEDS = 9
"""Steady speeds between which the propeller's command is interpolated."""


@dataclass(frozen=True, eq=False, kw_only=True)
class DesignedAutopilot(Autopilot):
    """An autopilot with what its design found.

    Attributes
    ----------
    hovers : bool
        Whether the vehicle can keep station: a command lifts it, or turns it, at rest.
    full_ahead : ndarray, shape (k,)
        Commands of the largest forward thrust within their limits.
    adds_excitation : bool
        Whether excitation is added to commands, besides setpoints.
    assumptions : tuple of str
        Values assumed because neither vehicle nor envelope states them.
    """

    hovers: bool
    full_ahead: FloatArray
    adds_excitation: bool = True
    assumptions: tuple[str, ...] = ()

    @property
    def overlays(self) -> list[int]:
        """Indices of the commands to which excitation is added."""
        indices = range(len(self.names)) if self.adds_excitation else range(0)
        return [index for index in indices if index != self.propeller]


def bisect(
    is_above: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the least values, element by element, for which a monotonic condition holds."""
    for _ in range(N_BISECTIONS):
        middle = 0.5 * (low + high)
        above = is_above(middle)
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return high


class _CommandForces:
    """Wrench of the nominal vehicle, level and straight ahead, as a function of its commands."""

    def __init__(self, vehicle: Vehicle, damping: Damping, names: tuple[str, ...]) -> None:
        self.vehicle, self.names = vehicle, names
        free = damping.model.restricted_to(vehicle.axes)
        self.equation = EquationOfMotion.of(vehicle, free, [damping.onto(free)])

    def wrench(self, speed: FloatArray, commands: FloatArray) -> FloatArray:
        """Return the wrench at speeds (n,) under commands (n, k), shape (n, 6)."""
        n = len(speed)
        velocity, down = np.zeros((n, 6)), np.tile([0.0, 0.0, 1.0], (n, 1))
        velocity[:, 0] = speed
        values = dict(zip(self.names, commands.T, strict=True))
        channels, propulsion_speed = self.equation.inputs(values, n)
        if propulsion_speed is None:
            propulsion_speed = np.maximum(speed, 1e-6)
        return self.equation.wrench(velocity, down, channels, propulsion_speed)

    def effectiveness(self, speed: float, amplitude: FloatArray) -> FloatArray:
        """Return the secant slope of the wrench on each command, shape (k, 6)."""
        step = np.where(np.isfinite(amplitude), amplitude, 1.0)
        wrench = self.wrench(
            np.full(len(step) + 1, speed), np.vstack([np.zeros(len(step)), np.diag(step)])
        )
        slope, change = (wrench[1:] - wrench[0]) / step[:, None], np.abs(wrench[1:] - wrench[0])
        rounding = np.abs(wrench).sum(axis=1, keepdims=True).max() * np.finfo(np.float64).eps
        slope[change < np.maximum(MIN_AUTHORITY * change.max(axis=0), rounding)] = 0.0
        return np.asarray(slope * self.vehicle.free)

    def surge_force(self, speed: FloatArray, index: int, command: FloatArray) -> FloatArray:
        """Return the force ahead at speeds under values of one command, shape (n,)."""
        commands = np.zeros((len(speed), len(self.names)))
        commands[:, index] = command
        return self.wrench(speed, commands)[:, 0]

    def steady_commands(
        self, propeller: int, band: tuple[float, float], lowest: float, highest: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the steady speeds of a band that are reachable, and their propeller commands."""
        speeds, least = np.linspace(*band, N_STEADY_SPEEDS), max(lowest, 0.0)
        commands = bisect(
            lambda command: self.surge_force(speeds, propeller, command) > 0.0,
            np.full(len(speeds), least),
            np.full(len(speeds), highest),
        )
        reachable = (commands < highest * (1 - 1e-9)) & (commands > least * (1 + 1e-9) + 1e-9)
        return speeds[reachable], commands[reachable]

    def assumed_limit(self, propeller: int) -> float:
        """Return the command at which the thrust at rest is ``ASSUMED_THRUST`` of the weight."""
        thrust, at_rest, high = ASSUMED_THRUST * self.vehicle.weight, np.zeros(1), np.ones(1)

        def is_enough(command: FloatArray) -> BoolArray:
            return self.surge_force(at_rest, propeller, command) >= thrust

        for _ in range(N_DOUBLINGS):
            if is_enough(high)[0]:
                break
            high = 2.0 * high
        return float(bisect(is_enough, at_rest, high)[0])


def design_autopilot(vehicle: Vehicle, damping: Damping, envelope: Envelope) -> DesignedAutopilot:
    """Allocate commands to axes, and choose gains, for a vehicle of nominal damping."""
    of_terms = (name for name in damping.model.commands if name not in CHANNEL_AXES)
    names = tuple(dict.fromkeys((*vehicle.commands, *of_terms)))
    if not names:
        raise ProblemError(
            f"vehicle '{vehicle.name}' cannot be steered: it has no actuators, and the model has "
            "no terms of commands. Give the vehicle `actuators`, or a model and a prior with gains."
        )
    if len(names) < len({*vehicle.commands, *damping.model.commands}):
        raise ProblemError(
            f"'{damping.model.key}' has gains of the actuators' wrench: scale the `actuators` of "
            f"'{vehicle.name}' by them, and identify a model without"
        )
    envelope.check_commands(names)
    forces = _CommandForces(vehicle, damping, names)
    lowest, highest = _limits(vehicle, envelope, names)
    amplitude = np.maximum(highest, -lowest)
    at_rest = forces.effectiveness(0.0, amplitude)
    hovers = bool(np.any(at_rest[:, [2, 5]] != 0.0))
    propeller = None
    if not hovers and np.any(at_rest[:, 0]):
        propeller = int(np.argmax(np.abs(at_rest[:, 0])))
    speeds = propeller_commands = None
    rates, assumptions = _rates(vehicle, envelope, names)
    if propeller is None:
        thrust = at_rest[:, 0]
        full_ahead = np.where(thrust > 0.0, highest, np.where(thrust < 0.0, lowest, 0.0))
    else:
        name = names[propeller]
        if not np.isfinite(highest[propeller]):
            highest[propeller] = forces.assumed_limit(propeller)
            lowest[propeller] = max(lowest[propeller], -highest[propeller])
            assumptions.append(
                f"No limit of `{name}` is given: {highest[propeller]:.4g} is assumed, where its "
                f"thrust is {ASSUMED_THRUST:.0%} of the vehicle's weight. State it in "
                f"the file of `--envelope`: `commands: {{{name}: {{lowest: 0, highest: ...}}}}`."
            )
        full_ahead = np.zeros(len(names))
        full_ahead[propeller] = highest[propeller]
        limits = float(lowest[propeller]), float(highest[propeller])
        speeds, propeller_commands = forces.steady_commands(propeller, envelope.speed, *limits)
        if not len(speeds):
            fault = (
                f"`speed` from {envelope.speed[0]:g} to {envelope.speed[1]:g} m/s cannot be "
                f"reached with `{name}` from {limits[0]:g} to {limits[1]:g}."
            )
            raise ProblemError(list_faults("envelope", [" ".join([fault, *assumptions])]))
        lowest[propeller] = max(limits[0], min(propeller_commands[0], 0.0))
        highest[propeller] = min(limits[1], propeller_commands[-1])
    unlimited = ~np.isfinite(lowest) | ~np.isfinite(highest)
    if unlimited.any():
        missing = ", ".join(np.array(names)[unlimited])
        fault = f"state limits of {missing} under `commands`: {{lowest: ..., highest: ...}}"
        raise ProblemError(list_faults("envelope", [fault]))
    slopes = at_rest
    if not hovers:
        slopes = forces.effectiveness(float(np.mean(envelope.speed)), amplitude)
    if propeller is not None:
        slopes[propeller] = 0.0
    loops = _loops(vehicle, envelope, slopes, amplitude, hovers)
    assumptions += _gain_assumptions(envelope, loops)
    heading, pitch, depth = loops
    return DesignedAutopilot(
        *(names, lowest, highest, rates, heading, pitch, depth),
        *(propeller, speeds, propeller_commands),
        hovers=hovers,
        full_ahead=full_ahead,
        assumptions=tuple(assumptions),
    )


def _gain_assumptions(envelope: Envelope, loops: Sequence[Loop | None]) -> Iterator[str]:
    """Yield the gains that the envelope does not state."""
    stated = envelope.autopilot or LoopGains()
    gains = {
        name: ", ".join(f"{abs(gain):.3g}" for gain in astuple(loop.pid)[:3])
        for name, loop in zip(("heading", "pitch", "depth"), loops, strict=True)
        if loop is not None and getattr(stated, name) is None
    }
    if gains:
        entries = ", ".join(f"{name}: [{values}]" for name, values in gains.items())
        yield (
            f"The autopilot's gains are assumed: {entries}. With other gains the dive may leave "
            f"its limits. State the vehicle's: `autopilot: {{{entries}}}` in the file "
            "of `--envelope`."
        )


def _rates(
    vehicle: Vehicle, envelope: Envelope, names: tuple[str, ...]
) -> tuple[FloatArray, list[str]]:
    """Return the rate limit of each command, and the assumption on fins."""
    fins = {item.command for item in vehicle.actuators if isinstance(item, Fin)}
    stated = {name: item.rate for name, item in envelope.commands.items() if item.rate is not None}
    default = {name: FIN_RATE if name in fins else np.inf for name in names}
    rates = np.array([stated.get(name, default[name]) for name in names])
    missing = [name for name in names if name in fins and name not in stated]
    if not missing:
        return rates, []
    return rates, [
        f"No rate of {', '.join(f'`{name}`' for name in missing)} is given: {FIN_RATE:g} rad/s is "
        "assumed. State it in the file of `--envelope`: "
        f"`commands: {{{missing[0]}: {{rate: ...}}}}`."
    ]


def _limits(
    vehicle: Vehicle, envelope: Envelope, names: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return the limits of each command: the narrower of the envelope's and the vehicle's."""
    limits = {
        item.command: item.limit for item in vehicle.actuators if not isinstance(item, Matrix)
    }
    highest = np.array([limits.get(name) or np.inf for name in names])
    lowest, faults = -highest, []
    plausible = ranges_of(vehicle, names, actuators=True).largest
    for index, name in enumerate(names):
        if (stated := envelope.commands.get(name)) is not None:
            faults += [
                f"`commands.{name}.{key}` must be within ±{plausible[index]:.4g}, beyond which no "
                f"actuator of '{vehicle.name}' can be; got {limit:g}"
                for key, limit in (("lowest", stated.lowest), ("highest", stated.highest))
                if limit is not None and abs(limit) > plausible[index]
            ]
            if stated.lowest is not None:
                lowest[index] = max(lowest[index], stated.lowest)
            if stated.highest is not None:
                highest[index] = min(highest[index], stated.highest)
    if faults:
        raise ProblemError(list_faults("envelope", faults))
    return lowest, highest


def _loops(
    vehicle: Vehicle, envelope: Envelope, slopes: FloatArray, amplitude: FloatArray, hovers: bool
) -> tuple[Loop | None, Loop | None, Loop | None]:
    """Return the loops of heading, pitch and depth, with gains as stated or by pole placement."""
    if envelope.steering == "direct":
        return None, None, None
    stated, inertia = envelope.autopilot or LoopGains(), vehicle.mass_matrix.diagonal()

    def loop(axis: str, gains: Gains | None, frequency: float) -> Loop | None:
        number = AXES.index(axis)
        authority = np.abs(slopes[:, number])
        authority[authority > 0.0] *= amplitude[authority > 0.0]
        if axis not in vehicle.axes or not np.any(authority > 0.0):
            return None
        index = int(np.argmax(authority))
        slope = slopes[index, number] / inertia[number]
        stiffness = frequency**2 / abs(slope)
        lead = 2.0 * DAMPING_RATIO * frequency / abs(slope)
        p, i, d = gains or (stiffness, INTEGRAL_RATIO * stiffness, lead)
        pid = Pid(p, i, d, float(amplitude[index]))
        return Loop(pid, index, float(np.sign(slope)))

    heading = loop("N", stated.heading, FAST_FREQUENCY)
    if hovers:
        return heading, None, loop("Z", stated.depth, SLOW_FREQUENCY)
    pitch = loop("M", stated.pitch, FAST_FREQUENCY)
    if pitch is None:
        return heading, None, None
    climb = CLIMB_GAIN / float(np.mean(envelope.speed))
    gains = stated.depth or (climb, climb * INTEGRAL_RATIO, climb * CLIMB_LEAD)
    max_pitch = min(FIN_LIMIT, 0.6 * float(np.radians(envelope.pitch)))
    # A positive pitch decreases the depth.
    return heading, pitch, Loop(Pid(*gains, max_pitch), pitch.command_index, -1.0)

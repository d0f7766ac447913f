"""Turning circle, zigzags, stopping and spiral of a ship, with bands and limits of the IMO.

Definitions and limits are those of IMO resolution MSC.137(76), Standards for ship manoeuvrability
(4 December 2002), annex, sections 4.2 and 5.3, for the origin of the body frame; distances are in
ship lengths L. Bands and probabilities are of draws of the coefficients from their covariance.
The loop width of the spiral is that of the curve of steady turns: how far the rudder angle
falls while the yaw rate rises, zero for a ship that is stable straight ahead.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.errors import ProblemError, demand
from hydrodamp.experiment_design.closed_loop import Trajectories
from hydrodamp.experiment_design.ensemble import draw_ensemble
from hydrodamp.experiment_design.ship_motion import (
    CIRCLE,
    MANOEUVRES,
    ROLES,
    STOP,
    TURN,
    ZIGZAG_10,
    ZIGZAG_20,
    Ship,
    approach,
    find_command,
    trace_spiral,
)
from hydrodamp.identification.dissipativity import find_exceedances, velocity_ranges
from hydrodamp.identification.fit import Fit
from hydrodamp.identification.predicted_error import predict_error
from hydrodamp.models.damping import Damping
from hydrodamp.progress import count_items, progress
from hydrodamp.simulation import closed_loop as dynamics
from hydrodamp.simulation.checks import CHANNEL_AXES, estimate_length
from hydrodamp.vehicle.vehicle import Vehicle

SIDES = ("starboard", "port")

RUDDER_RATE = float(np.radians(2.32)), 320.0
"""Rate [rad/s] of the rudder of a ship of this length [m]: case 1.2 of SIMMAN 2020. Other lengths
by Froude similitude, as for the model of 7 m there."""

N_DRAWS = 100
"""Draws of the coefficients, so that probabilities are exact to 0.05."""

LEVEL = 0.95
"""Confidence level of bands."""


@dataclass(frozen=True, eq=False)
class Characteristic:
    """A number of a manoeuvre for each draw, the estimate first; NaN where a draw fails."""

    manoeuvre: str
    side: str
    name: str
    unit: str
    draws: FloatArray
    limit: float | None = None

    @property
    def value(self) -> float | None:
        """The number of the estimate; None where it fails."""
        return float(self.draws[0]) if np.isfinite(self.draws[0]) else None

    @property
    def band(self) -> tuple[float, float] | None:
        """Percentiles of the draws that succeed; None without draws."""
        finite = self.draws[1:][np.isfinite(self.draws[1:])]
        if not len(finite):
            return None
        low, high = np.quantile(finite, [0.5 - LEVEL / 2.0, 0.5 + LEVEL / 2.0]).tolist()
        return low, high

    @property
    def completed_share(self) -> float | None:
        """Share of the draws that succeed; None without draws."""
        return float(np.isfinite(self.draws[1:]).mean()) if len(self.draws) > 1 else None

    @property
    def is_outside(self) -> bool:
        """Whether the number of the estimate is outside the band of the draws."""
        value, band = self.value, self.band
        return value is not None and band is not None and not band[0] <= value <= band[1]


@dataclass(frozen=True, eq=False)
class ShipManoeuvres:
    """Results: ``spiral`` has yaw rates (m,) and rudder angles (m, n) of steady turns."""

    ship: Ship
    steady: FloatArray
    trajectories: dict[str, Trajectories]
    spiral: tuple[FloatArray, FloatArray]
    characteristics: tuple[Characteristic, ...]
    extrapolation: dict[str, dict[str, tuple[float, float, float | None]]] = field(
        default_factory=dict
    )
    drawn_extrapolation: dict[str, dict[str, tuple[float, float]]] = field(default_factory=dict)
    reservations: tuple[str, ...] = ()  # of the fit

    @property
    def is_met(self) -> BoolArray:
        """Whether each draw is within each limit, shape (limits, n)."""
        limited = (each for each in self.characteristics if each.limit is not None)
        return np.array([each.draws <= (each.limit or 0.0) for each in limited])

    @property
    def probability(self) -> float | None:
        """Share of the draws that meet all limits; None without draws."""
        is_met = self.is_met[:, 1:]
        return float(np.mean(np.all(is_met, axis=0))) if is_met.size else None


def imo_limits(time_unit: float) -> dict[tuple[str, str], float]:
    """Return the limits of MSC.137(76), section 5.3, for a ratio L/V [s]."""
    ratio = min(max(time_unit, 10.0), 30.0)  # the limits are constant outside
    return {
        (TURN, "advance"): 4.5,
        (TURN, "tactical diameter"): 5.0,
        (ZIGZAG_10, "initial turning"): 2.5,
        (ZIGZAG_10, "first overshoot"): 5.0 + 0.5 * ratio,
        (ZIGZAG_10, "second overshoot"): 17.5 + 0.75 * ratio,
        (ZIGZAG_20, "first overshoot"): 25.0,
        (STOP, "track reach"): 15.0,
    }


def evaluate_ship(
    vehicle: Vehicle,
    damping: Damping,
    speed: float | None = None,
    *,
    fit: Fit | None = None,
    length: float | None = None,
    rudder_rate: float | None = None,
    **chosen: str,
) -> ShipManoeuvres:
    """Simulate all manoeuvres from a speed, by default the middle of the fit's range.

    ``rudder`` and ``propeller`` are names of commands; by default their names decide.
    """
    if not set("XYN") <= set(vehicle.axes):
        axes = " ".join(vehicle.axes)
        raise ProblemError(f"'{vehicle.name}' must be free in X, Y and N; its axes are {axes}.")
    ranges = {} if fit is None else fit.training_range
    if speed is None and "u" not in ranges:
        raise ProblemError(
            "the damping has no log whose speeds give the approach speed: state it in m/s by "
            "`--speed`, in Python by `speed`."
        )
    speed = float(np.mean(ranges["u"])) if speed is None else speed
    length = (estimate_length(vehicle) or 0.0) if length is None else length
    draws = draw_ensemble(vehicle, damping, N_DRAWS).dampings
    demand(0.0 < speed < np.inf, "speed", "positive, in m/s", speed)
    demand(0.0 < length < np.inf, "length", "positive, in m", length)
    if rudder_rate is None:
        rudder_rate = RUDDER_RATE[0] * float(np.sqrt(RUDDER_RATE[1] / length))
    demand(rudder_rate > 0.0, "rudder rate", "positive", rudder_rate)
    used = dict.fromkeys((*vehicle.commands, *damping.model.commands))
    names = tuple(name for name in used if name not in CHANNEL_AXES)
    rudder, propeller = (find_command(each, chosen.get(each, ""), names, vehicle) for each in ROLES)
    model = damping.model.restricted_to(("X", "Y", "N"))
    planar = replace(vehicle, axes=("X", "Y", "N"))
    equation = dynamics.EquationOfMotion.of(planar, model, [each.onto(model) for each in draws])
    ship = Ship(planar, equation, names, rudder, propeller, speed, length, rudder_rate)
    with np.errstate(all="ignore"):  # a draw may diverge
        ship, steady = approach(ship, len(equation.matrices))
        manoeuvres = count_items(MANOEUVRES, "simulating manoeuvres", len(MANOEUVRES))
        runs = {name: ship.simulate(name, steady) for name in manoeuvres}
        numbers = [each for name, run in runs.items() for each in _measure(ship, name, run)]
        ends = [each.draws[0] for each in numbers if each.name == "steady yaw rate"]
        with progress("simulating the spiral"):
            spiral = trace_spiral(ship, steady, np.radians(ends))
        falls = np.fmax.accumulate(spiral[1], axis=0) - spiral[1]
    width = np.degrees(np.fmax.reduce(falls, axis=0))
    numbers.append(Characteristic("spiral", "", "loop width", "deg", width))
    result = ShipManoeuvres(ship, steady, runs, spiral, tuple(numbers))
    if fit is None:
        return result
    extrapolation = {key: _exceedances(ship, run, fit) for key, run in runs.items()}
    drawn = {key: _drawn_exceedances(run, fit) for key, run in runs.items()}
    return replace(result, extrapolation=extrapolation, drawn_extrapolation=drawn)


def _at_crossing(quantity: FloatArray, level: float, values: FloatArray) -> FloatArray:
    """Return values at the first sample of each column where a quantity reaches a level."""
    is_reached = quantity >= level
    after = is_reached.argmax(axis=0)[None]
    pairs = [np.take_along_axis(x, k, 0)[0] for x in (quantity, values) for k in (after - 1, after)]
    share = (level - pairs[0]) / (pairs[1] - pairs[0])
    return np.where(is_reached.any(axis=0), pairs[2] + share * (pairs[3] - pairs[2]), np.nan)


def _measure(ship: Ship, name: str, run: Trajectories) -> list[Characteristic]:
    """Return the numbers of a manoeuvre to both sides; arrays are (samples, sides, draws)."""
    states = run.states.reshape(len(run.states), 2, -1, dynamics.N_STATES)
    signs, level = np.array([[1.0], [-1.0]]), MANOEUVRES[name][1]
    ahead, aside = states[..., 9] / ship.length, signs * states[..., 10] / ship.length
    heading, yaw_rate = np.degrees(signs * states[..., 8]), np.degrees(signs * states[..., 5])
    speed = np.hypot(states[..., 0], states[..., 1])
    path = np.cumsum(speed, axis=0) - 0.5 * (speed + speed[:1])
    path *= run.period / ship.length
    if name == TURN:
        final = [_at_crossing(heading, CIRCLE, each) for each in (speed, yaw_rate)]
        numbers = {
            "advance [L]": _at_crossing(heading, 90.0, ahead),
            "transfer [L]": _at_crossing(heading, 90.0, aside),
            "tactical diameter [L]": _at_crossing(heading, 180.0, aside),
            "final diameter [L]": 2.0 * final[0] / np.radians(final[1]) / ship.length,
            "steady speed [m/s]": final[0],
            "steady yaw rate [deg/s]": final[1],
        }
    elif name == STOP:
        time = np.broadcast_to(run.period * np.arange(len(path))[:, None, None], path.shape)
        pairs = {"track reach [L]": path, "head reach [L]": ahead, "time [s]": time}
        numbers = {key: _at_crossing(-states[..., 0], 0.0, each)[:1] for key, each in pairs.items()}
    else:
        reversed_once = np.logical_or.accumulate(heading >= level, axis=0)
        opposite = np.where(reversed_once, -heading, np.nan)
        reversed_twice = np.logical_or.accumulate(opposite >= level, axis=0)
        ended = np.any(reversed_twice & (yaw_rate >= 0.0), axis=0)
        first = np.fmax.reduce(np.where(reversed_twice, np.nan, heading), axis=0) - level
        second = np.fmax.reduce(opposite, axis=0) - level
        numbers = {
            "initial turning [L]": _at_crossing(heading, level, path),
            "first overshoot [deg]": np.where(reversed_twice.any(axis=0), first, np.nan),
            "second overshoot [deg]": np.where(ended, second, np.nan),
        }
    limits = imo_limits(ship.time_unit)
    names = [(key, *key[:-1].split(" [")) for key in numbers]
    return [
        Characteristic(name, side, title, unit, numbers[key][index], limits.get((name, title)))
        for index, side in enumerate(SIDES if name != STOP else ("",))
        for key, title, unit in names
    ]


def _exceedances(
    ship: Ship, run: Trajectories, fit: Fit
) -> dict[str, tuple[float, float, float | None]]:
    """Return the velocities beyond the log: largest there, largest here, and predicted error."""
    largest = dict[str, tuple[float, float, float | None]]()
    for column in (0, run.states.shape[1] // 2):  # the estimate to both sides
        n = int(np.isfinite(run.states[:, column, 0]).sum())
        if n < 2:  # diverges at once
            continue
        known = {
            key: getattr(run, key)[:n, [column]]
            for key in ("setpoints", "states", "measured", "commands")
        }
        log = replace(run, **known).log(ship.vehicle, ship.names, exact=True)
        ranges = velocity_ranges(log.velocity, ship.vehicle.axes)
        exceeded, errors = find_exceedances(fit.training_range, ranges), dict[str, float | None]()
        if exceeded and fit.damping.covariance is not None:
            errors = predict_error(ship.vehicle, fit, log).rms_by_axis(ship.vehicle.axes, "deg")
        for key, pair in exceeded.items():
            if key not in largest or pair[1] > largest[key][1]:
                largest[key] = (*pair, errors.get(key))
    return largest


def _drawn_exceedances(run: Trajectories, fit: Fit) -> dict[str, tuple[float, float]]:
    """Return the velocities beyond the log that 5 % of the draws exceed: largest there, and here.

    A draw has the largest of both sides.
    """
    sizes = np.fmax.reduce(np.abs(run.states[..., [0, 1, 5]]), axis=0)
    drawn = sizes.reshape(2, -1, 3).max(axis=0)[1:]
    if not len(drawn):
        return {}
    ends = np.quantile(drawn, LEVEL, axis=0).tolist()
    ranges = {key: (-end, end) for key, end in zip("uvr", ends, strict=True)}
    return find_exceedances(fit.training_range, ranges)

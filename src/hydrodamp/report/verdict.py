"""Is a log fit for the job: what is missing, and what will not be determined."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import IntArray
from hydrodamp.basis.axes import VELOCITIES, VELOCITY_OF
from hydrodamp.conditioning.attitude_jumps import LEAST_LEAP, leaps
from hydrodamp.conditioning.current import estimate_current
from hydrodamp.conditioning.suspicions import suspicions
from hydrodamp.data.log import Log
from hydrodamp.errors import HydrodampError
from hydrodamp.ingest.probing.delay import Delay
from hydrodamp.models.model import DampingModel
from hydrodamp.report.survey import Survey
from hydrodamp.simulation.fitness import check_log, nothing_drives
from hydrodamp.vehicle.righting import without_righting
from hydrodamp.vehicle.vehicle import Vehicle

STILL = {"m/s": 0.02, "rad/s": 0.01}
"""Standard deviation below which a velocity is hardly excited."""

WELL = 2.0
"""How many times that deviation is excitation worth speaking of."""

SEEN = 0.05
"""Share of the growth of a velocity from which a command is seen to act."""

MOTIONS = {
    "u": "surge",
    "v": "sway",
    "w": "heave",
    "p": "roll",
    "q": "pitch",
    "r": "yaw",
}
"""Velocities by the names of their motions."""

_SHIP = {"u", "v", "r"}
_MANY = 60_000  # samples, beyond which a current is not looked for
_TIDE = 300.0  # s, below which a current is not looked for
_DRIFT = 0.05  # m/s, less is the tether or the tank
_BLOCK = 4096  # samples, in which leaps are looked for where there is a long step
_LONG = 4.0  # times the median turn from sample to sample

SLOW = 0.25
"""Median step [s] above which angular accelerations are hardly resolved."""

SHORT = 60.0
"""Recorded time [s] below which little is determined."""


@dataclass(frozen=True)
class Verdict:
    """What a log lacks and what to expect of it."""

    missing: tuple[str, ...]
    reservations: tuple[str, ...]
    promises: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """The verdict itself."""
        if self.missing:
            return "Not fit for the job as it is: see what is missing."
        if self.doubts:
            return "Not fit for the job yet: correct what looks wrong first."
        if self.reservations:
            return "Fit for the job, with reservations."
        return "Fit for the job."


def verdict(
    survey: Survey,
    log: Log,
    vehicle: Vehicle | None = None,
    delays: Sequence[Delay] = (),
    completed: Survey | None = None,
) -> Verdict:
    """Judge a log."""
    missing = _missing(log) if vehicle is None else _missing_for(vehicle, log)
    axes = VELOCITIES if vehicle is None else tuple(VELOCITY_OF[axis] for axis in vehicle.axes)
    reservations = [*_reservations(survey, log, axes)]
    if vehicle is not None:
        reservations += _reservations_about(vehicle, log)
    promises = tuple(_promises(survey if completed is None else completed, axes, delays))
    doubts = tuple(f"{each}." for each in suspicions(log))
    return Verdict(tuple(missing), tuple(reservations), promises, doubts)


def _promises(survey: Survey, axes: Iterable[str], delays: Sequence[Delay]) -> Iterator[str]:
    """Say what can be identified: excited axes, and gains of commands that were seen to act."""
    wanted = set(axes)
    moving = [c for c in survey.velocities if c.name in wanted and c.std >= STILL[c.unit]]
    well = [c for c in moving if c.std >= WELL * STILL[c.unit]]
    if well:
        told = ", ".join(f"{MOTIONS[c.name]} (std {c.std:.2g} {c.unit})" for c in well)
        yield f"it can identify damping in {told}."
    sure = [one for one in delays if one.share >= SEEN]
    if sure:
        told = ", ".join(f"{one.command} ({MOTIONS[one.velocity]})" for one in sure)
        yield f"gains can be fitted for commands that are seen to act: {told}."
    if {c.name for c in survey.velocities} == _SHIP and wanted == set(VELOCITIES):
        yield "for a vehicle of `axes: [X, Y, N]`, no velocity is missing."


def _missing(log: Log) -> Iterator[str]:
    absent = [name for name in VELOCITIES if name not in log.velocity_names]
    if absent:
        yield (
            f"velocities {' '.join(absent)}: needed unless the vehicle's `axes` leave them out "
            f"(ask again with --vehicle).{_completed(log, absent)}"
        )
    if log.attitude is None:
        yield "attitude (roll pitch yaw or qw qx qy qz): weight and buoyancy act along it."
    if log.wrench is None and not log.command_names:
        yield "actuation: the wrench X Y Z K M N, or command columns."


def _completed(log: Log, absent: Sequence[str]) -> str:
    """Say how absent velocities can be had from what is there."""
    ways = []
    if set(log.velocity_names) == _SHIP:
        return ""
    if log.attitude is not None and set(absent) & set("pqr"):
        ways.append("`rates_from_attitude` derives rates")
    if log.position is not None and set(absent) & set("uvw"):
        ways.append("`velocity_from_position` derives speeds")
    return f" {' and '.join(ways)}." if ways else ""


def _missing_for(vehicle: Vehicle, log: Log) -> Iterator[str]:
    try:
        check_log(vehicle, log, _using(vehicle, log))
    except HydrodampError as error:
        lines = str(error).split("\n  - ")
        yield from lines[1:] or [lines[0].removeprefix(f"{log.source or 'log'}: ")]


def _reservations_about(vehicle: Vehicle, log: Log) -> Iterator[str]:
    """Say what the vehicle lacks for this log."""
    told, strange = nothing_drives(vehicle, log), _strange(vehicle, log)
    if told and strange and not vehicle.commands:
        yield told
    elif strange and not told:
        yield (
            f"commands that no actuator of '{vehicle.name}' takes: {' '.join(strange)}; use models "
            f"with terms for them, such as `terms: {{X: {strange[0]}}}` in a model file, or leave "
            "them out."
        )
    if told := without_righting(vehicle):
        yield told


def _strange(vehicle: Vehicle, log: Log) -> list[str]:
    """Return the commands that no actuator of the vehicle takes."""
    return [name for name in log.command_names if name not in vehicle.commands]


def _using(vehicle: Vehicle, log: Log) -> tuple[DampingModel, ...]:
    """Return a model with a term for every command that no actuator takes."""
    if vehicle.commands and nothing_drives(vehicle, log):
        return ()
    terms = {vehicle.axes[0]: " ".join(_strange(vehicle, log))}
    return (DampingModel.from_table(terms, key="probe"),)


def _leaps(log: Log) -> Iterator[str]:
    """Say where the attitude leaps there and back."""
    places = _leaping(log)
    if places.size:
        where = "one sample," if places.size == 1 else f"{places.size} samples, the first"
        of = next(part for part in log.segments if part.start <= places[0] < part.stop)
        when = f"{log.time[places[0]]:.2f} s"
        when += f" of {of.name}" if len(log.segments) > 1 else ""
        yield (
            f"the attitude leaps there and back at {where} at {when}, as where angles were "
            "averaged across a wrap: the step `steady_attitude` takes that out."
        )


def _leaping(log: Log) -> IntArray:
    """Return the samples whose attitude leaps, found in the blocks that hold a long step."""
    if log.attitude is None or log.n < 2:
        return np.empty(0, dtype=np.intp)
    step = 1.0 - np.abs(np.sum(log.attitude[1:] * log.attitude[:-1], axis=1))
    # Of small turns this is an eighth of the square of the angle.
    long = step > np.maximum(_LONG**2 * np.median(step), LEAST_LEAP**2 / 8)
    blocks = [
        (low, min(low + _BLOCK, stop))
        for start, stop in log.bounds.tolist()
        for low in range(start, stop, _BLOCK)
        if long[low : min(low + _BLOCK, stop - 1)].any()
    ]
    if not blocks:
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero(leaps(log.time, log.attitude, np.array(blocks)))


def _current(log: Log) -> Iterator[str]:
    """Say where velocities are over ground and a current is in them."""
    if log.n > _MANY or log.duration < _TIDE:
        return
    try:
        current = estimate_current(log)
    except HydrodampError:
        return
    sizes = np.linalg.norm(current.velocity, axis=1)
    doubt = np.linalg.norm(current.standard_error, axis=1)
    if current.determined and float(np.median(sizes - 3 * doubt)) > _DRIFT:
        yield (
            "velocities are over ground, in a current of "
            f"{sizes.min():.2g} to {sizes.max():.2g} m/s: the step `without_current` takes it out."
        )


def _reservations(survey: Survey, log: Log, axes: Iterable[str]) -> Iterator[str]:
    wanted = set(axes)
    if survey.duration < SHORT:
        yield f"only {survey.duration:.3g} s were recorded; minutes of manoeuvres are better."
    if max(stretch.step for stretch in survey.stretches) > SLOW:
        yield f"samples are more than {SLOW:g} s apart; ten a second are better."
    for channel in survey.velocities:
        if channel.name in wanted and channel.std < STILL[channel.unit]:
            yield (
                f"{channel.name} hardly varies (std {channel.std:.2g} {channel.unit}): "
                f"coefficients with {channel.name} will not be determined."
            )
        elif channel.name in wanted and channel.std < WELL * STILL[channel.unit]:
            yield (
                f"{channel.name} varies little (std {channel.std:.2g} {channel.unit}): "
                f"coefficients with {channel.name} will be uncertain."
            )
    one_way = [c.name for c in survey.velocities if c.name in wanted and c.low * c.high > 0.0]
    for name in one_way:
        yield (
            f"{name} never changes sign: {name}^2 and {name}|{name}|, {name} and |{name}| cannot "
            "be told apart."
        )
    constant = [channel.name for channel in survey.commands if channel.low == channel.high]
    if constant:
        yield f"commands that never change: {' '.join(constant)}."
    yield from _leaps(log)
    yield from _current(log)
    if log.acceleration is None and survey.n_samples:
        yield "no recorded acceleration: least squares differentiates the velocities."

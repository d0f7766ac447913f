"""The columns of a recording: what their names, units and clocks say, and several on one clock."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Topic
from hydrodamp.data.units import UNITS, spelt, unit_at_end
from hydrodamp.errors import LogError
from hydrodamp.ingest.clock import Clock, Stamps, Ticks, brackets, interpolated, matched, set_right
from hydrodamp.ingest.mapping.schema import quantity_of


def _set(listed: str) -> frozenset[str]:
    return frozenset(listed.split())


#: Words of fields that are about others, and measure nothing themselves.
NOISE = _set(
    "covariance cov cova var variance std sigma error err bias innov innovation integral reset "
    "derivative counter dop"
)
_COMMANDS = _set(
    "cmd command commands thruster thrusters thrust rpm rudder fin fins flaps elevator pwm servo "
    "rcout rcou ch chan channel channels motor motors propeller prop screw delta stern "
    "aileron actuator actuators torque throttle force wrench output outputs control voltage "
    "esc joystick plane planes"
)
_WANTED = _set("setpoint sp target desired ref reference goal des wanted")
_FLAGS = _set("good valid ok lock flag status quality is healthy")
_ANGULAR = _set("angular gyro gyr gyroscope omega rate rates angvel pqr dot")
_FORCE = _set("accel acceleration acc accelerometer accelerations")
_TURNED = _set("orientation quaternion quat attitude q")
_SPEED = _set("velocity velocities vel twist linear v speed dvl nu vbody")
_PLACE = _set("position pose pos translation location point")
_ANGLES = {name: name for name in ("roll", "pitch", "yaw", "heading")}
_ANGLES |= {"phi": "roll", "theta": "pitch", "psi": "yaw", "hdg": "heading", "compass": "heading"}
_RATE_OF = {"roll": "p", "pitch": "q", "yaw": "r", "heading": "r"}
_LETTERS = {"n": "north", "e": "east", "d": "down"}
_COMPASS = {word: word for word in ("north", "east", "down", "up")} | _LETTERS
_AXES = {"x": 0, "y": 1, "z": 2, "0": 0, "1": 1, "2": 2}
_VECTORS = (
    (_FORCE, tuple(f"specific_force.f{axis}" for axis in "xyz"), 85),
    (_ANGULAR, tuple(f"velocity.{rate}" for rate in "pqr"), 85),
    (_SPEED, tuple(f"velocity.{speed}" for speed in "uvw"), 80),
    (_PLACE, tuple(f"position.{axis}" for axis in "xyz"), 75),
)


def _fused() -> Iterator[tuple[str, str]]:
    """Yield names of which the first letters say what is measured, and their roles."""
    for axis, speed, rate in zip("xyz", "uvw", "pqr", strict=True):
        yield f"v{axis}", f"velocity.{speed}"
        yield from ((f"{kind}{axis}", f"velocity.{rate}") for kind in ("w", "g", "gyr"))
        yield from ((f"{kind}{axis}", f"specific_force.f{axis}") for kind in ("a", "acc"))
    yield from ((f"q{part}", f"attitude.q{part}") for part in "wxyz")
    for letter, way in _LETTERS.items():
        yield f"v{letter}", f"velocity.{way}"
        yield f"p{letter}", f"position.{way}"


_FUSED = dict(_fused())

#: A role, and how sure the name is of it [%].
Hint = tuple[str, int]


def words(name: str) -> tuple[str, ...]:
    """Return the words of a name, small."""
    apart = re.sub(r"([a-z0-9])([A-Z])", r"\1 \2", name)
    return tuple(word for word in re.split(r"[^A-Za-z0-9]+", apart.lower()) if word)


def parted(name: str) -> tuple[tuple[str, ...], str | None]:
    """Return the words of a name without its unit, and the unit."""
    whole = words(name)
    found = unit_at_end(whole)
    return (whole, None) if found is None else (whole[: -found[0]], found[1])


def unit_of(topic: Topic, field: str) -> str | None:
    """Return the unit that the file states for a field, or that its name carries."""
    return spelt(topic.units.get(field, "")) or parted(field)[1]


def hint(topic: str, field: str, unit: str | None) -> Hint | None:
    """Return the role that a name and a unit speak for."""
    name = parted(field)[0]
    around = {*words(topic), *name}
    if around & NOISE or field.startswith("header."):
        return None
    found = _role(name, around)
    quantity = None if found is None else quantity_of_role(found[0])
    if found is None or unit is None or quantity is None:
        return found
    return (found[0], min(95, found[1] + 10)) if unit in UNITS[quantity] else None


def quantity_of_role(role: str) -> str | None:
    """Return the quantity of a role; None where it may be any."""
    group, _, channel = role.partition(".")
    if group == "position":
        return "length"
    return quantity_of(group, channel) if channel else None


def _role(name: tuple[str, ...], around: set[str]) -> Hint | None:
    """Return what words say."""
    own, last, is_alone = set(name), name[-1] if name else "", len(name) == 1
    angle = next((_ANGLES[word] for word in name if word in _ANGLES), None)
    if own & _FLAGS and angle is None:
        return "flag", 80
    if own & _COMMANDS:
        return "commands", 85
    if around & (_COMMANDS - {"control"}) and angle is None and not own & _WANTED:
        return "commands", 75
    if around & _WANTED:
        return None
    if angle is not None:
        is_rate = bool(own & (_ANGULAR | {"speed"}))
        return (f"velocity.{_RATE_OF[angle]}", 80) if is_rate else (f"attitude.{angle}", 85)
    if "rate" in around and is_alone and last in "rpy":
        return f"velocity.{'pqr'['rpy'.index(last)]}", 75
    if around & _TURNED and last in ("w", "x", "y", "z"):
        return f"attitude.q{last}", 85
    if name[:1] == ("q",) and last in ("0", "1", "2", "3"):
        return f"attitude.q[{last}]", 80
    if last in _AXES and len(around) > 1:
        for kind, role, sure in _VECTORS:
            if around & kind:
                return role[_AXES[last]], sure
    if last in _COMPASS and not is_alone:
        return f"{'velocity' if own & _SPEED else 'position'}.{_COMPASS[last]}", 80
    if "depth" in own:
        return "position.depth", 75 if own & {"raw", "sensor", "setpoint"} else 85
    if is_alone and last in "uvwpqr":
        return f"velocity.{last}", 85
    if last in _FUSED and not (last[0] == "a" and around & _PLACE):
        return _FUSED[last], 80  # but not the world's acceleration beside a position
    if is_alone and last in "xyz":
        return f"position.{last}", 60
    return (f"position.{last}", 75) if last in ("north", "east") else None


_TIMES = {"time", "timestamp", "t", "stamp", "secs", "seconds", "clock", "elapsed", "timeus"}
_INCREASES = 0.98  # share of steps; the rest are repeats and joins
_EPOCHS = {"ns": 1e17, "us": 1e14, "ms": 1e11}  # 1973 and later, counted from 1970
_LARGEST = 1e30  # of any unit; more was not measured
_SLOW = 5.0  # s, a median step longer than that of any log
_MANY = 60_000  # samples; a longer clock is thinned, as motion is slower than that


@dataclass(frozen=True, eq=False)
class Ticking:
    """The clock of a topic."""

    column: str | None
    seconds: FloatArray
    unit: str
    confidence: int
    evidence: str


def ticking(topic: Topic) -> Ticking | None:
    """Return the clock of a topic, or None where no column increases."""
    if topic.time is not None and np.isfinite(_measured(topic.time)).any():
        return Ticking(None, _measured(topic.time), "s", 100, "stamped by the file")
    fields = {name: _measured(values) for name, values in topic.fields.items()}
    rising = [name for name, values in fields.items() if _share_rising(values) >= _INCREASES]
    if not rising:
        return None
    named = [name for name in rising if _TIMES & set(words(name))]
    name = (named or rising)[0]
    sure, why = (95, "its name, and it increases") if named else (70, "it increases")
    stated = unit_of(topic, name)
    is_stated = stated in UNITS["time"]
    unit = stated if stated and is_stated else _unit_by_size(fields[name])
    told = f"{why}; {unit} by its {'file or name' if is_stated else 'size'}"
    return Ticking(name, fields[name] * UNITS["time"][unit], unit, sure, told)


def _measured(values: FloatArray) -> FloatArray:
    return np.where(np.abs(values) < _LARGEST, values, np.nan)


def _unit_by_size(values: FloatArray) -> str:
    """Return the unit that makes an epoch or a step of a likely size."""
    finite = values[np.isfinite(values)]
    for unit, least in _EPOCHS.items():
        if float(np.median(finite)) > least:
            return unit
    step = float(np.median(np.diff(finite)))
    units = {"s": _SLOW, "ms": _SLOW * 1e3, "us": _SLOW * 1e6}
    return next((unit for unit, most in units.items() if step < most), "ns")


def _share_rising(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    if len(finite) < max(2, len(values) // 2):
        return 0.0
    return float(np.mean(np.diff(finite) > 0.0))


@dataclass(frozen=True, eq=False)
class Series:
    """A field of numbers and when each was sent."""

    topic: str
    field: str
    unit: str | None
    seconds: FloatArray
    values: FloatArray

    @property
    def column(self) -> str:
        """How a mapping calls it."""
        return f"{self.topic}.{self.field}" if self.topic else self.field


def series_of(topic: Topic, clock: Ticking | None) -> list[Series]:
    """Return the fields of a topic, but its clock and other times beside it."""
    column, seconds = (None, np.empty(0)) if clock is None else (clock.column, clock.seconds)
    return [
        Series(topic.name, name, unit_of(topic, name), seconds, values)
        for name, values in ((name, _measured(values)) for name, values in topic.fields.items())
        if name != column and not _is_stamp(name) and bool(np.isfinite(values).any())
    ]


def _is_stamp(name: str) -> bool:
    return parted(name)[0][-1:] in (("time",), ("timestamp",), ("stamp",)) or "stamp." in name


def together(series: Sequence[Series]) -> tuple[FloatArray, FloatArray]:
    """Bring series to the clock of the slowest: elapsed time and columns, a row of NaN at gaps."""
    clocks = {one.topic: Clock(one.topic, one.seconds) for one in series}
    try:
        stamps = dict(zip(clocks, set_right(list(clocks.values())), strict=True))
    except LogError:  # what seemed a clock is none
        return np.empty(0), np.empty((0, len(series)))
    base = max(stamps.values(), key=lambda one: one.step)
    thin = slice(None, None, 1 + len(base.time) // _MANY)
    ticks = Ticks(base.time[thin], base.run[thin])
    values = np.column_stack([_at(ticks, base, stamps[one.topic], one.values) for one in series])
    steps = np.diff(ticks.time, prepend=ticks.time[:1])
    broken = (np.diff(ticks.run, prepend=ticks.run[:1]) != 0) | (steps > base.limit)
    values[broken] = np.nan
    return np.cumsum(np.where(broken, base.step, steps)), values


def _at(ticks: Ticks, base: Stamps, stamps: Stamps, values: FloatArray) -> FloatArray:
    """Interpolate the numbers of a topic at ticks."""
    stamps = matched(stamps.kept(np.isfinite(values[stamps.rows])), base)
    if not len(stamps.rows):
        return np.full(len(ticks.time), np.nan)
    return interpolated(values[stamps.rows], brackets(stamps, ticks))

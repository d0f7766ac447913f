"""Suspicions about units and signs, each with its evidence; nothing is changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.data.attitude import (
    angle_ratio,
    down as down_in_body,
    euler_from_quaternion,
    path_ratios,
    rate_slopes,
)
from hydrodamp.data.channels import EULER
from hydrodamp.data.log import Log
from hydrodamp.data.units import UNITS, si_unit

_TOLERANCE = 0.08  # of a ratio, about that of a unit
_PULSE = (800.0, 2200.0)  # us, servo and ESC signals
_NEUTRAL = (1300.0, 1700.0)  # us
_FAST = 15.0  # m/s, the usual speed of hardly any craft with a log like this
_SLOW_CLOCK = 20.0  # s, a step of hardly any log
_ANGLE_NAMES = ("rudder", "fin", "elevator", "delta", "stern", "plane", "aileron")


def _mistaken(quantity: str, other: str) -> dict[float, str]:
    """Return what a ratio to another channel means, by the units of a quantity."""
    unit = si_unit(quantity)
    units = {factor: name for name, factor in reversed(UNITS[quantity].items()) if name != unit}
    return {
        -1.0: f"of the other sign, or of another frame than the {other}",
        **{
            factor: f"{unit} taken for {name} and converted once too often"
            for factor, name in units.items()
        },
        **{1 / factor: f"{name} taken for {unit}" for factor, name in units.items()},
    }


_RATES = _mistaken("angular rate", "attitude")
_SPEEDS = _mistaken("speed", "position") | {0.001: "m/s beside a position in mm"}


@dataclass(frozen=True)
class Suspicion:
    """Something about a channel that does not look right.

    Attributes
    ----------
    channel : str
        Which one.
    looks : str
        What it looks like.
    evidence : str
        Why, with the number it rests on.

    Examples
    --------
    >>> print(Suspicion("r", "is deg/s taken for rad/s", "it is 57.3 times the attitude's"))
    suspicion: `r` is deg/s taken for rad/s: it is 57.3 times the attitude's
    """

    channel: str
    looks: str
    evidence: str

    def __str__(self) -> str:
        """Return one sentence."""
        return f"suspicion: `{self.channel}` {self.looks}: {self.evidence}"


def suspicions(log: Log) -> tuple[Suspicion, ...]:
    """Return what looks wrong about the units and signs of a log.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    suspicions : tuple of Suspicion
        Empty where nothing looks wrong.

    Examples
    --------
    >>> log = Log.from_arrays([0, 0.1], {"u": [1, 2]}, commands={"m1": [1500, 1700]})
    >>> print(suspicions(log)[0])  # doctest: +ELLIPSIS
    suspicion: `m1` looks like a pulse width [us], not a force: it lies between 1500 and 1700...
    """
    return (
        *_clock(log),
        *_turning(log),
        *_speeds(log),
        *_accelerometer(log),
        *_pulses(log),
        *_angles(log),
        *_constant(log),
    )


def note_suspicions(log: Log) -> Log:
    """Write what looks wrong into the notes of a log; no sample is touched.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    log : Log
        The same measurements.

    Examples
    --------
    >>> note_suspicions(Log.from_arrays([0, 0.1], {"u": [1, 1.5]})).notes
    ()
    """
    found = suspicions(log)
    return log.noted(*map(str, found)) if found else log


def _clock(log: Log) -> Iterator[Suspicion]:
    steps = np.concatenate([np.diff(log.time[a:b]) for a, b in log.bounds])
    if (usual := float(np.median(steps))) > _SLOW_CLOCK:
        yield Suspicion("time", "may be in ms, not s", f"the median step is {usual:.4g}")


def _turning(log: Log) -> Iterator[Suspicion]:
    """Compare rates and attitude: rates of another unit or sign, angles in degrees."""
    if log.attitude is None:
        return
    with np.errstate(over="ignore"):  # an axis that does not turn has any ratio
        slopes = rate_slopes(log.time, log.attitude, log.velocity[:, 3:], log.bounds)
    angles = euler_from_quaternion(log.attitude)
    for k, (rate, angle) in enumerate(zip("pqr", EULER, strict=True)):
        if rate not in log.velocity_names:
            continue
        if looks := _unit(float(slopes[k]), _RATES):
            evidence = f"it is {slopes[k]:.3g} times the attitude's rate"
            yield Suspicion(rate, f"is {looks}", evidence)
        ratio = angle_ratio(log.time, angles[:, k], log.velocity[:, 3 + k], log.bounds)
        if abs(ratio * np.pi / 180 - 1) < _TOLERANCE:
            evidence = f"it turns {ratio:.3g} times as fast as `{rate}` says"
            yield Suspicion(angle, "is degrees taken for radians", evidence)


def _speeds(log: Log) -> Iterator[Suspicion]:
    recorded = [VELOCITIES.index(name) for name in log.velocity_names if name in VELOCITIES[:3]]
    if not recorded:
        return
    if log.position is not None and log.attitude is not None:
        ratios = path_ratios(log.time, log.velocity, log.attitude, log.position, log.bounds)
        mistaken = [k for k in recorded if _unit(float(ratios[k]), _SPEEDS)]
        for k in mistaken:
            evidence = f"its path is {ratios[k]:.3g} times its part of the position's"
            yield Suspicion(VELOCITIES[k], f"is {_unit(float(ratios[k]), _SPEEDS)}", evidence)
        if mistaken:
            return
    speed = np.linalg.norm(log.velocity[:, recorded], axis=1)
    if (usual := float(np.median(speed))) > _FAST:
        called, told = " ".join(VELOCITIES[k] for k in recorded), f"{usual:.3g} m/s"
        yield Suspicion(called, "may be cm/s or mm/s, not m/s", f"the median speed is {told}")


def _accelerometer(log: Log) -> Iterator[Suspicion]:
    if log.specific_force is None:
        return
    size = float(np.median(np.linalg.norm(log.specific_force, axis=1)))
    if abs(size - 1.0) < _TOLERANCE:
        yield Suspicion("specific_force", "is g taken for m/s^2", f"its median size is {size:.3g}")
    if log.attitude is None or size == 0.0:
        return
    along = np.sum(log.specific_force * down_in_body(log.attitude), axis=1)
    if (share := float(np.median(along)) / size) > 0.8:
        evidence = f"{100 * share:.0f} % of it points down; at rest it should point up"
        yield Suspicion("specific_force", "is of the other sign or frame", evidence)


def _pulses(log: Log) -> Iterator[Suspicion]:
    channels = {name: log.command(name) for name in log.command_names}
    if log.wrench is not None:
        channels |= dict(zip(AXES, log.wrench.T, strict=True))
    for name, values in channels.items():
        low, middle, high = np.quantile(values, (0.0, 0.5, 1.0)).tolist()
        inside = _PULSE[0] <= low < high <= _PULSE[1]
        if inside and _NEUTRAL[0] <= middle <= _NEUTRAL[1]:
            what = f"it lies between {low:.4g} and {high:.4g}"
            told = f"{what}; a thruster with a curve turns it into newtons"
            yield Suspicion(name, "looks like a pulse width [us], not a force", told)


def _angles(log: Log) -> Iterator[Suspicion]:
    for name in log.command_names:
        largest = float(np.abs(log.command(name)).max())
        if any(word in name.lower() for word in _ANGLE_NAMES) and np.pi / 2 < largest <= 90:
            yield Suspicion(name, "may be in degrees, not rad", f"it reaches {largest:.3g}")


def _constant(log: Log) -> Iterator[Suspicion]:
    for name in log.velocity_names:
        values = log.velocity[:, VELOCITIES.index(name)]
        if values[0] != 0.0 and (values == values[0]).all():
            told = f"it is {values[0]:.4g} throughout; leave it out"
            yield Suspicion(name, "was not measured", told)


def _unit(ratio: float, units: dict[float, str]) -> str:
    """Return what a ratio means, or nothing."""
    if not np.isfinite(ratio):
        return ""
    unit = min(units, key=lambda unit: abs(ratio / unit - 1))
    return units[unit] if abs(ratio / unit - 1) < _TOLERANCE else ""

"""Channels judged against each other: rates by attitude, velocity by position, clock by motion."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.conditioning.derivatives import GRAVITY
from hydrodamp.conditioning.dropouts import find_mocap_dropouts, varying_position
from hydrodamp.conditioning.gaps import ATTITUDE
from hydrodamp.conditioning.outliers import find_attitude_outliers
from hydrodamp.data.agreement import (
    ChannelRegression,
    integrate_displacement,
    integrate_rotation,
    noise_std,
    regress_channel,
)
from hydrodamp.data.channels import POSITION
from hydrodamp.data.log import Log
from hydrodamp.data.units import UNITS, si_unit

_SCALE_TOLERANCE, _SIGN_TOLERANCE = 0.08, 0.3  # of a ratio, about that of a unit, or about -1
_MAX_SCALE_ERROR = 1.5  # times too large or too small, of no unit
_SURE_CORRELATION = 0.95  # correlation from which a ratio of no unit is told
_MIN_CORRELATION = 0.5  # correlation below which two channels do not measure one motion
_DEAD_SCALE = 0.2  # of the other's motion; less is none
_DEAD_SCALE_ANY_UNIT = 1e-4  # of any two units of a rate or a speed
_MIN_SIGNAL_TO_NOISE = 10.0  # times the noise of a channel, from which it moves
_MIN_COMPONENT_SHARE = 0.2  # of the way, that a velocity's own part must have to be missed
_INLIER_SHARE = 0.95  # of the samples; the rest are spikes
_MIN_JITTER = 0.2  # of a step, from which a clock is asked
_MIN_ROUGHNESS_RATIO = 3.0  # times smoother by row than by clock
_MIN_SAMPLES = 200  # samples; in fewer, chance and spikes speak
_BURST_STEP_SHARE = 0.01  # of the mean step


@dataclass(frozen=True)
class QualityIssue:
    """Something about a channel that does not look right.

    Attributes
    ----------
    channel : str
        Which one, or several.
    looks : str
        What it looks like.
    evidence : str
        Why, with the number it rests on.
    where : str
        Which samples; empty where it is the whole channel.
    cure : str
        The step or the line of a mapping that mends it, or what to do.
    minor : bool
        Whether it concerns single samples, which the cure takes out.

    Examples
    --------
    >>> print(QualityIssue("r", "is deg/s taken for rad/s", "it is 57.3 times the attitude's"))
    suspicion: `r` is deg/s taken for rad/s: it is 57.3 times the attitude's
    """

    channel: str
    problem: str
    evidence: str
    where: str = ""
    remedy: str = ""
    is_minor: bool = False

    def __str__(self) -> str:
        """Return one sentence."""
        evidence = ", ".join(filter(None, (self.evidence, self.where)))
        told = "; ".join(filter(None, (evidence, self.remedy)))
        return f"suspicion: `{self.channel}` {self.problem}: {told}"


@dataclass(frozen=True)
class VehicleScale:
    """What is little and what is much for a vehicle, by Froude's law."""

    length: float  # m

    @classmethod
    def from_log(cls, log: Log) -> VehicleScale:
        """Return the size that the usual speed of a log speaks for."""
        speed = float(np.quantile(np.linalg.norm(log.velocity[:, :3], axis=1), 0.9))
        length = speed**2 / (_CRUISE_FROUDE**2 * GRAVITY)
        return cls(min(max(length, _MIN_LENGTH_M), _MAX_LENGTH_M))

    @property
    def time_scale(self) -> float:
        """Times, and speeds, beside those of a small vehicle."""
        return math.sqrt(self.length / _REFERENCE_LENGTH_M)

    def negligible(self, unit: str) -> float:
        """Return the standard deviation of a velocity that hardly varies."""
        return (
            _NEGLIGIBLE_SPEED * self.time_scale
            if unit == "m/s"
            else _NEGLIGIBLE_RATE / self.time_scale
        )

    def largest_plausible(self, unit: str) -> float:
        """Return a velocity that no such vehicle reaches."""
        of_length = self.length if unit == "m/s" else 1.0 / self.length
        return _MAX_FROUDE * math.sqrt(GRAVITY * of_length)


_CRUISE_FROUDE, _MAX_FROUDE = 0.25, 2.0  # usual, and of a boat that planes
_MIN_LENGTH_M, _MAX_LENGTH_M = 0.3, 100.0  # m
_REFERENCE_LENGTH_M, _NEGLIGIBLE_SPEED, _NEGLIGIBLE_RATE = 2.0, 0.02, 0.01  # m, m/s, rad/s


def _unit_confusions(quantity: str, other: str) -> dict[float, str]:
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


_RATE_CONFUSIONS = _unit_confusions("angular rate", "attitude")
_RATE_CONFUSIONS[UNITS["angular rate"]["deg/s"]] += ", or its angle is degrees taken for radians"
_SPEED_CONFUSIONS = _unit_confusions("speed", "position") | {0.001: "m/s beside a position in mm"}


#: By the first of three velocities: their units, what they are beside, what derives them.
_COMPARISONS = {
    0: (_SPEED_CONFUSIONS, "way of the position along it", "velocity_from_position"),
    3: (_RATE_CONFUSIONS, "rate of the attitude", "rates_from_attitude"),
}


def find_inconsistencies(log: Log, size: VehicleScale) -> Iterator[QualityIssue]:
    """Yield where channels that measure one motion contradict each other."""
    yield from _clock_issue(log)
    if log.attitude is None:
        return
    lost = find_mocap_dropouts(log)
    untold = find_attitude_outliers(log) | lost.get(ATTITUDE, False)
    attitude = np.where(untold[:, np.newaxis], np.nan, log.attitude)
    yield from _velocity_issues(
        log, 3, integrate_rotation(attitude, log.bounds), size.negligible("rad/s")
    )
    if (place := varying_position(log)) is not None:
        gone = lost[POSITION.columns[0]][:, np.newaxis]
        position = np.where(gone, np.nan, place)
        way = integrate_displacement(attitude, position, log.bounds)
        exchanged = position[:, (1, 0, 2)] * np.array([1.0, 1.0, -1.0])
        other = _frame_issue(
            log, place, integrate_displacement(attitude, exchanged, log.bounds), way
        )
        yield from [other] if other else _velocity_issues(log, 0, way, size.negligible("m/s"))


def _velocity_issues(
    log: Log, first: int, moved: FloatArray, little: float
) -> Iterator[QualityIssue]:
    """Yield what is wrong with three velocities, a sentence for all that look the same."""
    units, other, step = _COMPARISONS[first]
    names = VELOCITIES[first : first + 3]
    each = {
        name: regress_channel(log.time, log.bounds, log.velocity[:, [first + k]], moved[:, [k]])
        for k, name in enumerate(names)
        if name in log.velocity_names
    }
    most = max((both.rms_increment for both in each.values()), default=0.0)
    found: dict[str, list[str]] = {}
    for name, both in each.items():
        noise = _MIN_SIGNAL_TO_NOISE * noise_std(moved[:, names.index(name)], log.bounds)
        least = max(
            noise, little * both.window_s, _MIN_COMPONENT_SHARE * most if first == 0 else 0.0
        )
        looks = _describe_problem(both, units, least if log.n >= _MIN_SAMPLES else np.inf)
        found.setdefault(looks, []).append(name)
    for looks, alike in found.items():
        numbers = ", ".join(f"{each[name].scale:.3g}" for name in alike)
        likeness = ", ".join(f"{each[name].correlation:.2f}" for name in alike)
        span = each[alike[0]].window_s
        evidence = f"over {span:.3g} s it is {numbers} times the {other} (correlation {likeness})"
        cure = f"derive it: `steps: [{step}: {{names: [{', '.join(alike)}]}}]`"
        if "too often" in looks:
            cure = "write the units that the file has in the mapping, `unit: deg` for such an angle"
        elif " taken for " in looks:
            cure = f"write `unit: {looks.split()[1]}` for it in the mapping"
        elif "sign" in looks:
            cure = "write `sign: -1` for it, or other axes under `sensors`, in the mapping"
        if looks:
            yield QualityIssue(" ".join(alike), looks, evidence, remedy=cure)


def _describe_problem(both: ChannelRegression, units: dict[float, str], least: float) -> str:
    """Return what is wrong with a channel beside another that moves by more than its noise."""
    if both.is_consistent() and (unit := _unit_confusion(both.scale, units)):
        return f"is {unit}"
    seen = both.rms_increment > least
    if abs(both.scale) < (_DEAD_SCALE if seen else _DEAD_SCALE_ANY_UNIT) and (
        seen or both.is_consistent()
    ):
        return "measures nothing of its motion"
    if both.is_consistent():
        fits = (
            1 / _MAX_SCALE_ERROR < both.scale < _MAX_SCALE_ERROR
            or abs(both.correlation) < _SURE_CORRELATION
        )
        return "" if fits or not seen else "is of another size"
    unlike = seen and abs(both.correlation) < _MIN_CORRELATION
    return "is not the motion of the vehicle" if unlike else ""


def _unit_confusion(ratio: float, units: dict[float, str]) -> str:
    """Return what a ratio means, or nothing."""
    unit = min(units, key=lambda unit: abs(ratio / unit - 1))
    allowed = _SCALE_TOLERANCE if unit > 0.0 else _SIGN_TOLERANCE
    return units[unit] if abs(ratio / unit - 1) < allowed else ""


def _frame_issue(
    log: Log, position: FloatArray, exchanged: FloatArray, way: FloatArray
) -> QualityIssue | None:
    """Return in which axes velocities would make the way of the position that they do not."""
    ways = {
        "is along the axes of the world, not of the vehicle": (
            position,
            "name them `north`, `east` and `down` under `velocity` in the mapping",
        ),
        "has a position of another world, east and north exchanged": (
            exchanged,
            "name the axes of the position `east`, `north`, `up` in the mapping",
        ),
    }
    names = " ".join(name for name in VELOCITIES[:3] if name in log.velocity_names)
    both = regress_channel(log.time, log.bounds, log.velocity[:, :3], way)
    for looks, (other, cure) in ways.items():
        found = regress_channel(log.time, log.bounds, log.velocity[:, :3], other)
        if found.correlation > _SURE_CORRELATION and found.explains_more_than(both):
            told = f"added up it goes with the position by a correlation of {both.correlation:.2f}"
            return QualityIssue(names, looks, f"{told}, so by {found.correlation:.2f}", remedy=cure)
    return None


def _clock_issue(log: Log) -> Iterator[QualityIssue]:
    """Ask whether samples follow each other more evenly than their clock says."""
    few, low, step, high = np.quantile(log.steps, (0.1, 0.05, 0.5, 0.95)).tolist()
    if log.n < _MIN_SAMPLES or high - low < 2 * _MIN_JITTER * step:
        return
    blocks = [log.velocity] + ([] if log.position is None else [log.position])
    blocks += [] if log.attitude is None else [integrate_rotation(log.attitude, log.bounds)]
    times = _clock_roughness(log, np.column_stack(blocks))
    in_bursts = few < _BURST_STEP_SHARE * float(np.mean(log.steps))
    if in_bursts or (times.max() > _MIN_ROUGHNESS_RATIO and times.min() > 1 / _MIN_ROUGHNESS_RATIO):
        told = f"by row number the motion is {times.max():.2g} times smoother"
        yield QualityIssue(
            "time",
            "is not when the samples were taken",
            f"its steps are from {low:.2g} to {high:.2g} s, "
            + ("in bursts" if in_bursts else told),
            remedy="take the sensor's own stamp (`time: header.stamp` in the mapping), not when a "
            "message came",
        )


def _clock_roughness(log: Log, values: FloatArray) -> FloatArray:
    """Return how much farther samples are off between their neighbours by clock than by row."""
    inside = np.ones(log.n, dtype=np.bool_)
    inside[[*log.bounds[:, 0], *(log.bounds[:, 1] - 1)]] = False
    at = np.flatnonzero(inside)
    share = (log.time[at] - log.time[at - 1]) / (log.time[at + 1] - log.time[at - 1])
    rise, ahead = values[at] - values[at - 1], values[at + 1] - values[at - 1]
    by_clock, by_row = np.abs(rise - share[:, np.newaxis] * ahead), np.abs(rise - ahead / 2)
    usual = by_row <= np.quantile(by_row, _INLIER_SHARE, axis=0)
    one, other = (np.mean(each, axis=0, where=usual) for each in (by_clock, by_row))
    return np.asarray(np.divide(one, other, out=np.ones_like(one), where=other > 0.0))

"""Consistency of redundant channels: rates and attitude, velocity and position, clock and motion.

The integral of a rate is regressed on the increments of the channel it is the derivative of, over
windows longer than the noise (:mod:`hydrodamp.data.channel_regression`). The scale reveals a
wrong unit or sign; a low correlation reveals a channel that measures something else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.derivatives import GRAVITY, derivable_rates
from hydrodamp.conditioning.dropouts import ATTITUDE, find_mocap_dropouts, varying_position
from hydrodamp.conditioning.outliers import find_attitude_outliers
from hydrodamp.data.channel_regression import (
    ChannelRegression,
    integrate_displacement,
    integrate_rotation,
    noise_std,
    regress_channel,
)
from hydrodamp.data.channels import POSITION, UNITS, si_unit
from hydrodamp.data.log import Log, extract_segments

#: Relative error of a scale around a unit factor, and around -1.
_SCALE_TOLERANCE, _SIGN_TOLERANCE = 0.08, 0.3
_MAX_SCALE_ERROR = 1.5  # times too large or too small, without a unit that explains it
_SURE_CORRELATION = 0.95  # correlation from which a scale without a unit is reported
_MIN_CORRELATION = 0.5  # correlation below which two channels do not measure one motion
_DEAD_SCALE = 0.2  # share of the reference motion; a smaller scale is a dead channel
_DEAD_SCALE_ANY_UNIT = 1e-4  # smaller than the ratio of any two units of a rate or a speed
_MIN_SIGNAL_TO_NOISE = 10.0  # motion over noise from which a channel is moving
_MIN_COMPONENT_SHARE = 0.2  # of the largest increment, from which a component must be seen
_INLIER_SHARE = 0.95  # of the samples; the others are outliers
_MIN_JITTER = 0.2  # of a step, from which the clock is checked
_MIN_ROUGHNESS_RATIO = 3.0  # roughness by clock over roughness by row number
_MIN_SAMPLES = 200  # samples; fewer are dominated by chance and outliers
_MAX_SAMPLES = 100_000  # samples; longer logs are decimated
_BURST_STEP_SHARE = 0.01  # of the mean step


class Fix(NamedTuple):
    """A change of a mapping that corrects an issue; an ``option`` is a step to decide on."""

    kind: Literal["step", "option", "unit", "sign", "delay", "omit", "frame"]
    value: str

    def __str__(self) -> str:
        """Return the change as advice."""
        return {
            "step": f"add `{self.value}` to `steps` of the mapping",
            "option": f"derive it: `steps: [{self.value}]`",
            "delay": f"for a clock offset, add `delay: {self.value}` to its column in the mapping",
            "omit": f"omit {self.value} from `commands` of the mapping",
            "frame": f"write `frame: {self.value}` in a mapping, and list deviating sensors under "
            "`sensors`",
            "unit": f"write `unit: {self.value}` for it in the mapping"
            if self.value
            else "state the units of the file in the mapping, for example `unit: deg` for an angle",
            "sign": f"write `sign: {self.value}` for it, or other axes under `sensors`, in the "
            "mapping",
        }[self.kind]


@dataclass(frozen=True)
class QualityIssue:
    """A quality issue of a channel: problem, evidence and remedy.

    Attributes
    ----------
    channel : str
        The channel, or several separated by blanks.
    problem : str
        The problem.
    evidence : str
        The evidence, with its number.
    where : str
        The affected samples; empty if the whole channel is affected.
    remedy : str
        Advice in place of that of the change of the mapping.
    is_minor : bool
        Whether only single samples are affected, which the remedy removes.
    fix : Fix or None
        The change of the mapping that corrects it.

    Examples
    --------
    >>> print(QualityIssue("r", "is deg/s taken for rad/s", "it is 57.3 times the attitude's"))
    quality issue: `r` is deg/s taken for rad/s: it is 57.3 times the attitude's
    """

    channel: str
    problem: str
    evidence: str
    where: str = ""
    remedy: str = ""
    is_minor: bool = False
    fix: Fix | None = None

    def __str__(self) -> str:
        """Return one sentence."""
        evidence = ", ".join(filter(None, (self.evidence, self.where)))
        advice = self.remedy or ("" if self.fix is None else str(self.fix))
        details = "; ".join(filter(None, (evidence, advice)))
        return f"quality issue: `{self.channel}` {self.problem}: {details}"


@dataclass(frozen=True)
class VehicleScale:
    """Typical and negligible velocities of a vehicle of a given length, by Froude scaling."""

    length: float  # m

    @classmethod
    def from_log(cls, log: Log) -> VehicleScale:
        """Return the length at which the 90 % quantile of speed is a Froude number of 0.25."""
        speed = float(np.quantile(np.linalg.norm(log.velocity[:, :3], axis=1), 0.9))
        length = speed**2 / (_CRUISE_FROUDE**2 * GRAVITY)
        return cls(min(max(length, _MIN_LENGTH_M), _MAX_LENGTH_M))

    @property
    def time_scale(self) -> float:
        """Froude scale of times and speeds relative to a vehicle of 2 m."""
        return math.sqrt(self.length / _REFERENCE_LENGTH_M)

    def negligible(self, unit: str) -> float:
        """Return the standard deviation below which a velocity is not excited."""
        is_linear = unit == "m/s"
        return (
            _NEGLIGIBLE_SPEED * self.time_scale if is_linear else _NEGLIGIBLE_RATE / self.time_scale
        )

    def largest_plausible(self, unit: str) -> float:
        """Return the largest plausible velocity of a vehicle of this length."""
        of_length = self.length if unit == "m/s" else 1.0 / self.length
        return _MAX_FROUDE * math.sqrt(GRAVITY * of_length)


_CRUISE_FROUDE, _MAX_FROUDE = 0.25, 2.0  # at cruise speed, and of a planing boat
_MIN_LENGTH_M, _MAX_LENGTH_M = 0.3, 100.0  # m
_REFERENCE_LENGTH_M, _NEGLIGIBLE_SPEED, _NEGLIGIBLE_RATE = 2.0, 0.02, 0.01  # m, m/s, rad/s


#: Problem that a scale of a channel indicates, and what corrects it.
Confusion = tuple[str, Fix | None]
NO_CONFUSION: Confusion = ("", None)

OPPOSITE, OTHER_UNIT = Fix("sign", "-1"), Fix("unit", "")


def _unit_confusions(quantity: str, reference: str) -> dict[float, Confusion]:
    """Return the unit confusion or sign error that each scale of a channel indicates."""
    unit = si_unit(quantity)
    units = {factor: name for name, factor in reversed(UNITS[quantity].items()) if name != unit}
    result: dict[float, Confusion] = {
        -1.0: (f"is of opposite sign to, or in another frame than, the {reference}", OPPOSITE)
    }
    for factor, name in units.items():
        result[factor] = f"is {unit} taken for {name} and converted once too often", OTHER_UNIT
    for factor, name in units.items():
        result[1 / factor] = f"is {name} taken for {unit}", Fix("unit", name)
    return result


_RATE_CONFUSIONS = _unit_confusions("angular rate", "attitude")
_TWICE = UNITS["angular rate"]["deg/s"]
_RATE_CONFUSIONS[_TWICE] = (
    f"{_RATE_CONFUSIONS[_TWICE][0]}, or its angle is degrees taken for radians",
    OTHER_UNIT,
)
_SPEED_CONFUSIONS: dict[float, Confusion] = {
    **_unit_confusions("speed", "position"),
    0.001: ("is m/s with a position in mm", OTHER_UNIT),
}


#: By the first of three velocities: unit confusions, reference channel, step that derives them.
_COMPARISONS = {
    0: (_SPEED_CONFUSIONS, "displacement of the position along it", "velocity_from_position"),
    3: (_RATE_CONFUSIONS, "rate of the attitude", "rates_from_attitude"),
}


def find_inconsistencies(log: Log, size: VehicleScale) -> Iterator[QualityIssue]:
    """Yield contradictions between channels that measure the same motion."""
    yield from _clock_issue(log)
    if (every := -(-log.n // _MAX_SAMPLES)) > 1:
        log = extract_segments(log, [each for each in log.segments if len(each) > every], every)
    if log.attitude is None:
        return
    dropouts = find_mocap_dropouts(log)
    invalid = find_attitude_outliers(log) | dropouts.get(ATTITUDE, False)
    attitude = np.where(invalid[:, np.newaxis], np.nan, log.attitude)
    rotation = integrate_rotation(attitude, log.bounds)
    rates = derivable_rates(log.attitude)
    yield from _velocity_issues(log, rates, rotation, size.negligible("rad/s"))
    if (measured := varying_position(log)) is not None:
        missing = dropouts[POSITION.columns[0]][:, np.newaxis]
        position = np.where(missing, np.nan, measured)
        exchanged = position[:, (1, 0, 2)] * np.array([1.0, 1.0, -1.0])
        displacement, alternative = (
            integrate_displacement(attitude, values, log.bounds) for values in (position, exchanged)
        )
        if issue := _frame_issue(log, measured, alternative, displacement):
            yield issue
        else:
            yield from _velocity_issues(log, VELOCITIES[:3], displacement, size.negligible("m/s"))


def _velocity_issues(
    log: Log, compared: Sequence[str], reference_values: FloatArray, negligible: float
) -> Iterator[QualityIssue]:
    """Yield the issues of linear or angular velocities; those with the same problem share one."""
    first = VELOCITIES.index(compared[-1]) - 2
    units, reference, step = _COMPARISONS[first]
    columns = {
        name: first + k
        for k, name in enumerate(VELOCITIES[first : first + 3])
        if name in log.velocity_names and name in compared
    }
    regressions = {
        name: _regress(log, [column], reference_values[:, [column - first]])
        for name, column in columns.items()
    }
    largest = max((regression.rms_increment for regression in regressions.values()), default=0.0)
    least = _MIN_COMPONENT_SHARE * largest if first == 0 else 0.0
    names_by_problem: dict[Confusion, list[str]] = {}
    for name, regression in regressions.items():
        noise = noise_std(reference_values[:, columns[name] - first], log.bounds)
        threshold = (
            max(_MIN_SIGNAL_TO_NOISE * noise, negligible * regression.window_s, least)
            if log.n >= _MIN_SAMPLES
            else np.inf
        )
        confusion = _describe_problem(regression, units, threshold)
        names_by_problem.setdefault(confusion, []).append(name)
    names_by_problem.pop(NO_CONFUSION, None)
    for (problem, fix), names in names_by_problem.items():
        scales = ", ".join(f"{regressions[name].scale:.3g}" for name in names)
        correlations = ", ".join(f"{regressions[name].correlation:.2f}" for name in names)
        comparison = f"{scales} times the {reference} (correlation {correlations})"
        evidence = f"over {regressions[names[0]].window_s:.3g} s it is {comparison}"
        fix = fix or Fix("option", f"{step}: {{names: [{', '.join(names)}]}}")
        yield QualityIssue(" ".join(names), problem, evidence, fix=fix)


def _regress(log: Log, columns: list[int], reference: FloatArray) -> ChannelRegression:
    return regress_channel(log.time, log.bounds, log.velocity[:, columns], reference)


def _describe_problem(
    regression: ChannelRegression, units: dict[float, Confusion], threshold: float
) -> Confusion:
    """Return the problem that a regression on the reference channel reveals, and its fix."""
    is_consistent, scale = regression.is_consistent(), regression.scale
    if is_consistent and (unit := _unit_confusion(scale, units)):
        return unit
    is_moving = regression.rms_increment > threshold
    is_dead = abs(scale) < (_DEAD_SCALE if is_moving else _DEAD_SCALE_ANY_UNIT)
    if is_dead and (is_moving or is_consistent):
        return "does not measure the motion", None
    correlation = abs(regression.correlation)
    is_plausible = 1 / _MAX_SCALE_ERROR < scale < _MAX_SCALE_ERROR
    if is_moving and is_consistent and not is_plausible and correlation >= _SURE_CORRELATION:
        return "has a wrong scale", None
    is_uncorrelated = is_moving and correlation < _MIN_CORRELATION
    uncorrelated = "is uncorrelated with the motion of the vehicle", None
    return uncorrelated if is_uncorrelated else NO_CONFUSION


def _unit_confusion(ratio: float, units: dict[float, Confusion]) -> Confusion | None:
    """Return the unit confusion whose factor a scale matches."""
    unit = min(units, key=lambda unit: abs(ratio / unit - 1))
    allowed = _SCALE_TOLERANCE if unit > 0.0 else _SIGN_TOLERANCE
    return units[unit] if abs(ratio / unit - 1) < allowed else None


def _frame_issue(
    log: Log, position: FloatArray, exchanged: FloatArray, displacement: FloatArray
) -> QualityIssue | None:
    """Return the frame in which the velocities integrate to the position, if not the body frame."""
    alternatives = {
        "is given in world axes, not in body axes": (
            position,
            "name them `north`, `east` and `down` under `velocity` in the mapping",
        ),
        "contradicts a position whose east and north are exchanged": (
            exchanged,
            "name the axes of the position `east`, `north`, `up` in the mapping",
        ),
    }
    names = " ".join(name for name in VELOCITIES[:3] if name in log.velocity_names)
    expected = _regress(log, [0, 1, 2], displacement)
    for problem, (alternative, remedy) in alternatives.items():
        regression = _regress(log, [0, 1, 2], alternative)
        if regression.correlation > _SURE_CORRELATION and regression.explains_more_than(expected):
            evidence = (
                f"its integral correlates with the position by {expected.correlation:.2f}, in "
                f"those axes by {regression.correlation:.2f}"
            )
            return QualityIssue(names, problem, evidence, remedy=remedy)
    return None


def _clock_issue(log: Log) -> Iterator[QualityIssue]:
    """Yield an issue if the motion is smoother by row number than by clock."""
    shortest, low, step, high = np.quantile(log.steps, (0.1, 0.05, 0.5, 0.95)).tolist()
    if log.n < _MIN_SAMPLES or high - low < 2 * _MIN_JITTER * step:
        return
    blocks = [log.velocity] + ([] if log.position is None else [log.position])
    blocks += [] if log.attitude is None else [integrate_rotation(log.attitude, log.bounds)]
    ratios = _clock_roughness(log, np.column_stack(blocks))
    in_bursts = shortest < _BURST_STEP_SHARE * float(np.mean(log.steps))
    is_rough = ratios.max() > _MIN_ROUGHNESS_RATIO and ratios.min() > 1 / _MIN_ROUGHNESS_RATIO
    if in_bursts or is_rough:
        smoothness = f"by row number the motion is {ratios.max():.2g} times smoother"
        evidence = f"its steps are from {low:.2g} to {high:.2g} s, "
        remedy = (
            "use the sensor's time stamp (`time: header.stamp` in the mapping), not the arrival "
            "time of the message"
        )
        evidence += "in bursts" if in_bursts else smoothness
        yield QualityIssue("time", "is not the sampling time", evidence, remedy=remedy)


def _clock_roughness(log: Log, values: FloatArray) -> FloatArray:
    """Return the error of linear interpolation by clock over that by row number, per column."""
    inside = np.ones(log.n, dtype=np.bool_)
    inside[[*log.bounds[:, 0], *(log.bounds[:, 1] - 1)]] = False
    rows = np.flatnonzero(inside)
    share = (log.time[rows] - log.time[rows - 1]) / (log.time[rows + 1] - log.time[rows - 1])
    rise, ahead = values[rows] - values[rows - 1], values[rows + 1] - values[rows - 1]
    by_clock, by_row = np.abs(rise - share[:, np.newaxis] * ahead), np.abs(rise - ahead / 2)
    inliers = by_row <= np.quantile(by_row, _INLIER_SHARE, axis=0)
    clock_error, row_error = (np.mean(error, axis=0, where=inliers) for error in (by_clock, by_row))
    ratios = np.ones_like(clock_error)
    return np.asarray(np.divide(clock_error, row_error, out=ratios, where=row_error > 0.0))

"""Quality checks of a log before identification: problem, evidence and remedy of each issue."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Container, Iterator
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.conditioning.consistency import (
    Fix as Fix,
    QualityIssue as QualityIssue,
    VehicleScale,
    find_inconsistencies,
)
from hydrodamp.conditioning.dropouts import (
    ATTITUDE,
    MAX_SPEED,
    Masks,
    find_dvl_dropouts,
    find_frozen,
    find_mocap_dropouts,
    find_sample_and_hold,
    true_runs,
)
from hydrodamp.conditioning.outliers import find_attitude_outliers, find_outliers
from hydrodamp.conditioning.vertical_axis import vertical_tests
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.channels import EULER, POSITION, unit_of
from hydrodamp.data.log import Log, recorded_velocities

_GRAVITY_TOLERANCE = 0.08  # m/s^2 per m/s^2: deviation of the median specific force from 1 g
#: By channel the sensor whose samples fail together.
_SENSOR_OF = dict.fromkeys("uvw", "speed") | dict.fromkeys(POSITION.columns, "position")
_SENSOR_OF |= dict.fromkeys(EULER, ATTITUDE)
_PULSE_RANGE_US = (800.0, 2200.0)  # us, servo and ESC signals
_NEUTRAL_RANGE_US = (1300.0, 1700.0)  # us
_MAX_STEP_S = 20.0  # s; a longer median step indicates milliseconds
_JUMP_FACTOR, _JUMP_LENGTH_SHARE = 10.0, 0.1  # times the median position step; of the length
_MINOR_SHARE = 0.05  # of the samples; fewer make an issue minor
_OUTLIER_RANGE_FACTOR = 2.0  # times the 5-95 % range
_ANGLE_NAMES = ("rudder", "fin", "elevator", "delta", "stern", "plane", "aileron")


def check_quality(log: Log, length: float | None = None) -> tuple[QualityIssue, ...]:
    """Return the quality issues of a log: units, signs, clock, dropouts and outliers.

    Parameters
    ----------
    log : Log
        Any log, as used for identification.
    length : float, optional
        Length of the vehicle [m]; default: from its typical speed by Froude scaling.

    Returns
    -------
    issues : tuple of QualityIssue
        Empty if no check fails.

    Examples
    --------
    >>> log = Log.from_arrays([0, 0.1], {"u": [1, 2]}, commands={"m1": [1500, 1700]})
    >>> print(check_quality(log)[0])  # doctest: +ELLIPSIS
    quality issue: `m1` looks like a pulse width [us], not a force: it lies between 1500 and 1700...
    """
    size = VehicleScale.from_log(log) if length is None else VehicleScale(length)
    issues = [*_clock_unit_issue(log), *find_inconsistencies(log, size), *_speed_unit_issue(log)]
    reported = {name for issue in issues for name in issue.channel.split()}
    return (
        *issues,
        *_sample_issues(log, size, reported),
        *_accelerometer_issues(log),
        *_pulse_width_issues(log),
        *_degree_issues(log),
        *_constant_issues(log),
    )


def annotate_quality(log: Log) -> Log:
    """Append the quality issues to the notes of a log.

    Parameters
    ----------
    log : Log
        Any log.

    Returns
    -------
    log : Log
        With unchanged measurements.

    Examples
    --------
    >>> annotate_quality(Log.from_arrays([0, 0.1], {"u": [1, 1.5]})).notes
    ()
    """
    issues = check_quality(log)
    return log.with_notes(*map(str, issues)) if issues else log


def _clock_unit_issue(log: Log) -> Iterator[QualityIssue]:
    if (usual := float(np.median(log.steps))) > _MAX_STEP_S:
        yield QualityIssue("time", "may be in ms, not s", f"the median step is {usual:.4g}")


def _speed_unit_issue(log: Log) -> Iterator[QualityIssue]:
    # Velocities not recorded are zero.
    if (usual := float(np.median(np.linalg.norm(log.velocity[:, :3], axis=1)))) > MAX_SPEED / 2:
        names = " ".join(name for name in log.velocity_names if name in VELOCITIES[:3])
        evidence = f"the median speed is {usual:.3g} m/s"
        yield QualityIssue(names, "may be cm/s or mm/s, not m/s", evidence)


def _sample_issues(
    log: Log, size: VehicleScale, reported: Container[str]
) -> Iterator[QualityIssue]:
    """Yield issues of single samples; each sample is reported once per sensor."""
    velocities = recorded_velocities(log).items()
    speeds = {name: np.abs(values) for name, values in velocities if name not in reported}
    position = log.position
    jumps = {} if position is None else {"position": _position_speed(log, position, size)}
    issues = (
        *_excessive_speeds(size, speeds),
        *_detected_faults(log),
        *_excessive_speeds(size, jumps),
    )
    reported_rows = defaultdict[str, BoolArray](lambda: np.zeros(log.n, dtype=np.bool_))
    for issue, rows in issues:
        kinds = {_SENSOR_OF.get(name, name) for name in issue.channel.split()}
        new = rows & ~np.logical_and.reduce([reported_rows[kind] for kind in kinds])
        padded = np.pad(rows, 1)
        for kind in kinds:
            reported_rows[kind] = reported_rows[kind] | rows | padded[2:] | padded[:-2]
        if new.any():
            yield replace(issue, where=_format_times(log, new))


#: Issues and the rows they affect.
_LocatedIssues = Iterator[tuple[QualityIssue, BoolArray]]


def _excessive_speeds(size: VehicleScale, speeds: dict[str, FloatArray]) -> _LocatedIssues:
    """Yield speeds above the largest plausible one."""
    for name, values in speeds.items():
        unit = unit_of(name) if name in VELOCITIES else "m/s"
        rows = values > (limit := size.largest_plausible(unit))
        if rows.any() and np.median(values) < limit:
            problem = f"exceeds the plausible speed of a vehicle of {size.length:.2g} m"
            evidence = f"its maximum is {values.max():.3g} {unit}, the limit {limit:.2g} {unit}"
            remedy = (
                "check its unit; if positions jump, start the `steps` of the mapping with "
                "`clean`, or split the log there by `segment`"
            )
            yield QualityIssue(name, problem, evidence, remedy=remedy), rows


def _position_speed(log: Log, position: FloatArray, size: VehicleScale) -> FloatArray:
    """Return the speed of unusually long steps of the position, else zero."""
    steps, seconds = np.linalg.norm(np.diff(position, axis=0), axis=1), np.diff(log.time)
    long = steps > max(_JUMP_FACTOR * float(np.median(steps)), _JUMP_LENGTH_SHARE * size.length)
    pace = np.where(long, steps / np.maximum(seconds, np.median(seconds)), 0.0)
    pace[log.bounds[1:, 0] - 1] = 0.0
    return np.concatenate((np.zeros(1), pace))


def _outlier_masks(log: Log) -> Masks:
    """Return the outliers of velocities that exceed twice their 5-95 % range."""
    masks = {}
    for name, values in recorded_velocities(log).items():
        low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)).tolist()
        if (outlying := np.abs(values - middle) > _OUTLIER_RANGE_FACTOR * (high - low)).any():
            masks[name] = outlying & find_outliers(log, values)
    return masks


def _attitude_outlier_masks(log: Log) -> Masks:
    """Return the attitude outliers, by the angle that jumps most."""
    if log.attitude is None or not (outliers := find_attitude_outliers(log)).any():
        return {}
    turns = euler_from_quaternion(log.attitude)
    before = np.maximum.accumulate(np.where(outliers, 0, np.arange(log.n)))
    axis = np.argmax(np.abs(np.sin((turns - turns[before]) / 2)), axis=1)
    return {name: outliers & (axis == k) for k, name in enumerate(EULER)}


_DETECTORS: dict[str, tuple[Callable[[Log], Masks], str]] = {
    "mask_dvl_dropouts": (find_dvl_dropouts, "drops to zero or to an invalid value"),
    "mask_mocap_dropouts": (
        find_mocap_dropouts,
        "is zero in all components, as when motion capture loses the vehicle",
    ),
    "mask_frozen": (find_frozen, "is frozen while other channels change"),
    "interpolate_sample_and_hold": (find_sample_and_hold, "repeats the samples of a slower sensor"),
    "remove_attitude_outliers": (_attitude_outlier_masks, "jumps away and back"),
    "remove_outliers": (_outlier_masks, "has outliers"),
}


def _detected_faults(log: Log) -> _LocatedIssues:
    """Yield the samples that the cleaning steps would remove."""
    for step, (detect, problem) in _DETECTORS.items():
        masks = {name: rows for name, rows in detect(log).items() if rows.any()}
        if masks:
            rows = np.logical_or.reduce([*masks.values()])
            evidence = f"{rows.sum()} of {log.n} samples"
            is_minor = float(rows.mean()) < _MINOR_SHARE
            fix, names = Fix("step", step), " ".join(masks)
            yield QualityIssue(names, problem, evidence, is_minor=is_minor, fix=fix), rows


def _format_times(log: Log, rows: BoolArray) -> str:
    """Return the elapsed times of samples."""
    intervals, elapsed = true_runs(rows), log.elapsed
    first, last = elapsed[intervals[0][0]], elapsed[intervals[-1][1] - 1]
    if len(intervals) == 1:
        return f"at {first:.6g} s" if first == last else f"from {first:.6g} to {last:.6g} s"
    return f"in {len(intervals)} intervals from {first:.6g} to {last:.6g} s"


def _accelerometer_issues(log: Log) -> Iterator[QualityIssue]:
    if log.specific_force is None:
        return
    size = float(np.median(np.linalg.norm(log.specific_force, axis=1)))
    if abs(size - 1.0) < _GRAVITY_TOLERANCE:
        evidence = f"its median size is {size:.3g}"
        yield QualityIssue("specific_force", "is g taken for m/s^2", evidence)
    for test in vertical_tests(replace(log, position=None)):
        if test.log_odds < 0.0:
            problem = "has the opposite sign, or the log has z up"
            evidence = f"{test.message}, but z must be down"
            remedy = "if the whole log has z up, write `frame: FLU` in a mapping, else `sign: -1`"
            fix = Fix("frame", "FLU")
            yield QualityIssue("specific_force", problem, evidence, remedy=remedy, fix=fix)


def _pulse_width_issues(log: Log) -> Iterator[QualityIssue]:
    channels = dict(zip(log.command_names, log.commands.T, strict=True))
    if log.wrench is not None:
        channels |= dict(zip(AXES, log.wrench.T, strict=True))
    for name, values in channels.items():
        low, middle, high = np.quantile(values, (0.0, 0.5, 1.0)).tolist()
        inside = _PULSE_RANGE_US[0] <= low < high <= _PULSE_RANGE_US[1]
        if inside and _NEUTRAL_RANGE_US[0] <= middle <= _NEUTRAL_RANGE_US[1]:
            span = f"it lies between {low:.4g} and {high:.4g}"
            evidence = f"{span}; a thruster with a curve converts it to newtons"
            yield QualityIssue(name, "looks like a pulse width [us], not a force", evidence)


def _degree_issues(log: Log) -> Iterator[QualityIssue]:
    for name in log.command_names:
        largest = float(np.abs(log.command(name)).max())
        if any(word in name.lower() for word in _ANGLE_NAMES) and np.pi / 2 < largest <= 90:
            evidence, fix = f"it reaches {largest:.3g}", Fix("unit", "deg")
            problem = "may be in degrees, not rad"
            yield QualityIssue(name, problem, evidence, is_minor=True, fix=fix)  # gains absorb it


def _constant_issues(log: Log) -> Iterator[QualityIssue]:
    for name, values in recorded_velocities(log).items():
        if values[0] != 0.0 and (values == values[0]).all():
            evidence = f"it is constant at {values[0]:.4g}; omit it"
            yield QualityIssue(name, "was not measured", evidence)

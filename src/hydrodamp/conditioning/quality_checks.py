"""Suspicions about a log as it will be fitted, each with number, place and cure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Container, Iterator
from dataclasses import replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.conditioning.consistency import (
    QualityIssue as QualityIssue,
    VehicleScale,
    find_inconsistencies,
)
from hydrodamp.conditioning.dropouts import (
    MAX_SPEED,
    Masks,
    find_dvl_dropouts,
    find_frozen,
    find_mocap_dropouts,
    find_sample_and_hold,
)
from hydrodamp.conditioning.gaps import ATTITUDE, true_runs
from hydrodamp.conditioning.outliers import find_attitude_outliers, find_outliers
from hydrodamp.conditioning.vertical import vertical_tests
from hydrodamp.data.attitude import euler_from_quaternion
from hydrodamp.data.channels import EULER, POSITION, unit_of
from hydrodamp.data.log import Log, recorded_velocities

_GRAVITY_TOLERANCE = 0.08  # of the size of gravity
#: Channels of one sensor, whose samples fail together.
_SENSOR_OF = dict.fromkeys("uvw", "speed") | dict.fromkeys(POSITION.columns, "position")
_SENSOR_OF |= dict.fromkeys(EULER, ATTITUDE)
_PULSE_RANGE_US = (800.0, 2200.0)  # us, servo and ESC signals
_NEUTRAL_RANGE_US = (1300.0, 1700.0)  # us
_MAX_STEP_S = 20.0  # s, a step of hardly any log
_JUMP_FACTOR, _JUMP_LENGTH_SHARE = (
    10.0,
    0.1,
)  # times the usual step of a position, and of the vehicle's length
_MINOR_SHARE = 0.05  # of the samples
_OUTLIER_RANGE_FACTOR = 2.0  # times the range of most samples
_ANGLE_NAMES = ("rudder", "fin", "elevator", "delta", "stern", "plane", "aileron")


def check_quality(log: Log, length: float | None = None) -> tuple[QualityIssue, ...]:
    """Return what looks wrong about a log: units, signs, clock, dead and lost channels.

    Parameters
    ----------
    log : Log
        Any log, as it will be fitted.
    length : float, optional
        Of the vehicle [m]; taken from its usual speed by Froude's law where not given.

    Returns
    -------
    suspicions : tuple of Suspicion
        Empty where nothing looks wrong.

    Examples
    --------
    >>> log = Log.from_arrays([0, 0.1], {"u": [1, 2]}, commands={"m1": [1500, 1700]})
    >>> print(check_quality(log)[0])  # doctest: +ELLIPSIS
    suspicion: `m1` looks like a pulse width [us], not a force: it lies between 1500 and 1700...
    """
    size = VehicleScale.from_log(log) if length is None else VehicleScale(length)
    found = [*_clock_unit_issue(log), *find_inconsistencies(log, size), *_speed_unit_issue(log)]
    told = {name for one in found for name in one.channel.split()}
    return (
        *found,
        *_sample_issues(log, size, told),
        *_accelerometer_issues(log),
        *_pulse_width_issues(log),
        *_degree_issues(log),
        *_constant_issues(log),
    )


def annotate_quality(log: Log) -> Log:
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
    >>> annotate_quality(Log.from_arrays([0, 0.1], {"u": [1, 1.5]})).notes
    ()
    """
    found = check_quality(log)
    return log.with_notes(*map(str, found)) if found else log


def _clock_unit_issue(log: Log) -> Iterator[QualityIssue]:
    if (usual := float(np.median(log.steps))) > _MAX_STEP_S:
        yield QualityIssue("time", "may be in ms, not s", f"the median step is {usual:.4g}")


def _speed_unit_issue(log: Log) -> Iterator[QualityIssue]:
    # What was not recorded is zero.
    if (usual := float(np.median(np.linalg.norm(log.velocity[:, :3], axis=1)))) > MAX_SPEED / 2:
        called = " ".join(name for name in log.velocity_names if name in VELOCITIES[:3])
        told = f"{usual:.3g} m/s"
        yield QualityIssue(called, "may be cm/s or mm/s, not m/s", f"the median speed is {told}")


def _sample_issues(log: Log, size: VehicleScale, told: Container[str]) -> Iterator[QualityIssue]:
    """Yield what is wrong with some samples, each sample once for channels of a kind."""
    speeds = {
        name: np.abs(one) for name, one in recorded_velocities(log).items() if name not in told
    }
    place = {} if log.position is None else {"position": _position_speed(log, log.position, size)}
    seen: defaultdict[str, BoolArray] = defaultdict(lambda: np.zeros(log.n, dtype=np.bool_))
    for one, rows in (
        *_excessive_speeds(size, speeds),
        *_detected_faults(log),
        *_excessive_speeds(size, place),
    ):
        kinds = {_SENSOR_OF.get(name, name) for name in one.channel.split()}
        new = rows & ~np.logical_and.reduce([seen[kind] for kind in kinds])
        for kind in kinds:
            beside = np.pad(rows, 1)
            seen[kind] = seen[kind] | rows | beside[2:] | beside[:-2]
        if new.any():
            yield replace(one, where=_format_times(log, new))


#: What is wrong, and which samples are.
_LocatedIssues = Iterator[tuple[QualityIssue, BoolArray]]


def _excessive_speeds(size: VehicleScale, speeds: dict[str, FloatArray]) -> _LocatedIssues:
    """Yield speeds that no vehicle of this size reaches."""
    for name, values in speeds.items():
        unit = unit_of(name) if name in VELOCITIES else "m/s"
        rows = values > (most := size.largest_plausible(unit))
        if rows.any() and np.median(values) < most:
            one = QualityIssue(
                name,
                f"is faster than a vehicle of {size.length:.2g} m",
                f"it has up to {values.max():.3g} {unit}, and {most:.2g} {unit} is much",
                remedy="check its unit; where positions leap let the `steps` of the mapping begin "
                "with `clean`, or cut the log there by `segment`",
            )
            yield one, rows


def _position_speed(log: Log, position: FloatArray, size: VehicleScale) -> FloatArray:
    """Return the speed of steps of the position that are long for this log and this vehicle."""
    steps, seconds = np.linalg.norm(np.diff(position, axis=0), axis=1), np.diff(log.time)
    long = steps > max(_JUMP_FACTOR * float(np.median(steps)), _JUMP_LENGTH_SHARE * size.length)
    pace = np.where(long, steps / np.maximum(seconds, np.median(seconds)), 0.0)
    pace[log.bounds[1:, 0] - 1] = 0.0
    return np.concatenate((np.zeros(1), pace))


def _outlier_masks(log: Log) -> Masks:
    """Return the spikes of velocities that are larger than all their motion."""
    lost = {}
    for name, values in recorded_velocities(log).items():
        low, middle, high = np.quantile(values, (0.05, 0.5, 0.95)).tolist()
        if (far := np.abs(values - middle) > _OUTLIER_RANGE_FACTOR * (high - low)).any():
            lost[name] = far & find_outliers(log, values)
    return lost


def _attitude_outlier_masks(log: Log) -> Masks:
    """Return where the attitude leaps, by the angle that leaps most."""
    if log.attitude is None or not (found := find_attitude_outliers(log)).any():
        return {}
    turns = euler_from_quaternion(log.attitude)
    before = np.maximum.accumulate(np.where(found, 0, np.arange(log.n)))
    most = np.argmax(np.abs(np.sin((turns - turns[before]) / 2)), axis=1)
    return {name: found & (most == k) for k, name in enumerate(EULER)}


_DETECTORS: dict[str, tuple[Callable[[Log], Masks], str]] = {
    "mask_dvl_dropouts": (
        find_dvl_dropouts,
        "drops to zero or to a number that stands for no measurement",
    ),
    "mask_mocap_dropouts": (
        find_mocap_dropouts,
        "is all zeros, as where motion capture lost the vehicle",
    ),
    "mask_frozen": (find_frozen, "stands still to the last bit while others move"),
    "interpolate_sample_and_hold": (find_sample_and_hold, "repeats what a slower sensor sent"),
    "remove_attitude_outliers": (_attitude_outlier_masks, "leaps there and back"),
    "remove_outliers": (_outlier_masks, "has spikes"),
}


def _detected_faults(log: Log) -> _LocatedIssues:
    """Yield what the steps that clean a log would take out of it."""
    for step, (detect, looks) in _DETECTORS.items():
        lost = {name: rows for name, rows in detect(log).items() if rows.any()}
        if lost:
            rows = np.logical_or.reduce([*lost.values()])
            told = f"{rows.sum()} of {log.n} samples"
            cure = f"write `steps: [{step}]` in the mapping"
            few = float(rows.mean()) < _MINOR_SHARE
            yield QualityIssue(" ".join(lost), looks, told, remedy=cure, is_minor=few), rows


def _format_times(log: Log, rows: BoolArray) -> str:
    """Return the time of samples, counted from the first of the log."""
    places, when = true_runs(rows), log.elapsed
    first, last = when[places[0][0]], when[places[-1][1] - 1]
    if len(places) == 1:
        return f"at {first:.6g} s" if first == last else f"from {first:.6g} to {last:.6g} s"
    return f"in {len(places)} places from {first:.6g} to {last:.6g} s"


def _accelerometer_issues(log: Log) -> Iterator[QualityIssue]:
    if log.specific_force is None:
        return
    size = float(np.median(np.linalg.norm(log.specific_force, axis=1)))
    if abs(size - 1.0) < _GRAVITY_TOLERANCE:
        yield QualityIssue(
            "specific_force", "is g taken for m/s^2", f"its median size is {size:.3g}"
        )
    for sign in vertical_tests(replace(log, position=None)):
        if sign.log_odds < 0.0:
            cure = "if the whole log has z up write `frame: FLU` in a mapping, else `sign: -1`"
            looks = "is of the other sign, or the log of axes with z up"
            yield QualityIssue(
                "specific_force", looks, f"{sign.message}, and z is down", remedy=cure
            )


def _pulse_width_issues(log: Log) -> Iterator[QualityIssue]:
    channels = {name: log.command(name) for name in log.command_names}
    if log.wrench is not None:
        channels |= dict(zip(AXES, log.wrench.T, strict=True))
    for name, values in channels.items():
        low, middle, high = np.quantile(values, (0.0, 0.5, 1.0)).tolist()
        inside = _PULSE_RANGE_US[0] <= low < high <= _PULSE_RANGE_US[1]
        if inside and _NEUTRAL_RANGE_US[0] <= middle <= _NEUTRAL_RANGE_US[1]:
            what = f"it lies between {low:.4g} and {high:.4g}"
            told = f"{what}; a thruster with a curve turns it into newtons"
            yield QualityIssue(name, "looks like a pulse width [us], not a force", told)


def _degree_issues(log: Log) -> Iterator[QualityIssue]:
    for name in log.command_names:
        largest = float(np.abs(log.command(name)).max())
        if any(word in name.lower() for word in _ANGLE_NAMES) and np.pi / 2 < largest <= 90:
            yield QualityIssue(name, "may be in degrees, not rad", f"it reaches {largest:.3g}")


def _constant_issues(log: Log) -> Iterator[QualityIssue]:
    for name, values in recorded_velocities(log).items():
        if values[0] != 0.0 and (values == values[0]).all():
            told = f"it is {values[0]:.4g} throughout; leave it out"
            yield QualityIssue(name, "was not measured", told)

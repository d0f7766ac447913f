"""Velocities that a log lacks, rebuilt from its sensors, with the outliers that were left out.

The velocities p q r come from attitude and rates, u v w from positions and velocities, by
:mod:`hydrodamp.conditioning.velocity_smoother`. Attitude and position of the log itself are
sensors where the velocities that they integrate are not recorded.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, frozen, mad_std
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.position_outliers import position_outliers
from hydrodamp.conditioning.velocity_smoother import (
    PRIOR_FACTOR,
    Interpolation,
    Observation,
    angle_rate_matrices,
    interpolate_rows,
    interpolate_series,
    smooth_velocities,
    unwrapped_euler,
    white_noise_std,
)
from hydrodamp.data.attitude import quaternion_from_euler, rotation_matrices
from hydrodamp.data.log import Log
from hydrodamp.data.measurement import KINDS, Measurement

#: Share of the log that a sensor must cover, else a warning.
MIN_COVERAGE = 0.8

_LINEAR, _ANGULAR = VELOCITIES[:3], VELOCITIES[3:]
#: Kinds that observe the linear and the angular velocities.
LINEAR_KINDS = ("position", "velocity", "ground_velocity", "specific_force")
ANGULAR_KINDS = ("attitude", "rates")


@dataclass(frozen=True, eq=False)
class Sensor:
    """A measurement at interpolated rows of a log, with known noise and without outliers.

    ``valid`` (m, k) marks the values that are used.
    """

    measurement: Measurement
    rows: Interpolation
    std: FloatArray
    valid: BoolArray

    @property
    def kind(self) -> str:
        """The kind of measurement."""
        return self.measurement.kind


@dataclass(frozen=True, eq=False)
class SensorLog:
    """A log with rebuilt velocities, its sensors, and what is known of its poses.

    ``velocity_std`` and ``acceleration_std`` (6,) are zero where a velocity was recorded;
    ``coordinates`` (n, 6) are north, east, down [m] and roll, pitch, yaw [rad], without jumps.
    """

    log: Log
    names: tuple[str, ...]
    sensors: tuple[Sensor, ...]
    velocity_std: FloatArray
    acceleration_std: FloatArray
    coordinates: FloatArray
    remarks: tuple[str, ...]

    @property
    def description(self) -> str:
        """The sensors in words: name, components and rate."""
        texts = (
            f"{each.measurement.name} ({' '.join(each.measurement.components)}, "
            f"{each.measurement.rate:.3g} Hz)"
            for each in self.sensors
        )
        return ", ".join(texts)

    @property
    def error_note(self) -> str:
        """What replay errors contain where velocities are rebuilt."""
        return (
            f"the test data have no {' '.join(self.names)}: errors are against velocities rebuilt "
            "from sensors and contain theirs"
        )


def rebuild_velocities(log: Log, free: Sequence[str]) -> SensorLog:
    """Return the log with the velocities of free axes that it lacks."""
    missing = [name for name in free if name not in log.velocity_names]
    measurements = [*log.measurements, *_recorded_poses(log, missing)]
    log = _with_attitude(log, measurements)
    sensors = [_sensor(log, each) for each in measurements]
    euler, velocity = unwrapped_euler(log), log.velocity.copy()
    coordinates, std, acceleration_std = np.zeros((log.n, 6)), np.zeros(6), np.zeros(6)
    coordinates[:, 3:] = euler
    rotations = rotation_matrices(quaternion_from_euler(euler))
    for names, kinds, matrices in (
        (_ANGULAR, ANGULAR_KINDS, angle_rate_matrices(euler)),
        (_LINEAR, LINEAR_KINDS, rotations),
    ):
        axes = [VELOCITIES.index(name) for name in names]
        if not set(names) & set(missing):
            continue
        fixed = [name for name in names if name not in free]
        observations = [
            observation
            for sensor in sensors
            if sensor.kind in kinds
            for observation in _observations(sensor, velocity[:, 3:], rotations)
        ]
        observations += _recorded_observations(log, names, fixed)
        scale = _velocity_scale(log, observations) or _scale_of_forces(log, sensors)
        smoothed = smooth_velocities(log, matrices, observations, scale)
        absent = [axis for axis in axes if VELOCITIES[axis] in missing]
        velocity[:, absent] = smoothed.velocity[:, [axis % 3 for axis in absent]]
        std[absent] = smoothed.velocity_std[[axis % 3 for axis in absent]]
        acceleration_std[absent] = smoothed.acceleration_std[[axis % 3 for axis in absent]]
        coordinates[:, (0 if kinds is LINEAR_KINDS else 3) + np.arange(3)] = smoothed.coordinates
    recorded = tuple(name for name in VELOCITIES if name in log.velocity_names or name in missing)
    if missing:
        texts = (f"{name} {std[VELOCITIES.index(name)]:.2g}" for name in missing)
        log = log.with_notes(f"rebuilt from sensors, standard deviation: {', '.join(texts)}")
    log = replace(log, velocity=velocity, velocity_names=recorded)
    remarks = [sentence for sensor in sensors for sentence in _describe_faults(log, sensor)]
    return SensorLog(
        log, tuple(missing), tuple(sensors), std, acceleration_std, coordinates, tuple(remarks)
    )


def _recorded_poses(log: Log, missing: Iterable[str]) -> Iterator[Measurement]:
    """Yield position and attitude of the log as measurements where they must serve."""
    segment = log.segment_numbers
    kinds = {each.kind for each in log.measurements}
    if log.position is not None and "position" not in kinds and {*missing} & {*_LINEAR}:
        yield Measurement("position", "position", log.time, log.position, segment=segment)
    if log.attitude is not None and not kinds & {*ANGULAR_KINDS} and {*missing} & {*_ANGULAR}:
        euler = unwrapped_euler(log)
        moving = [k for k in range(3) if np.ptp(euler[:, k]) > 0.0] or [2]
        names = tuple(KINDS["attitude"][k] for k in moving)
        yield Measurement("attitude", "attitude", log.time, euler[:, moving], names,
                          segment=segment)  # fmt: skip


def _with_attitude(log: Log, measurements: Iterable[Measurement]) -> Log:
    """Return a log with an attitude, interpolated where only a sensor has it."""
    attitudes = [each for each in measurements if each.kind == "attitude"]
    if log.attitude is not None or not attitudes:
        return log
    euler = np.zeros((log.n, 3))
    for each in attitudes:
        for column, name in enumerate(each.components):
            index = KINDS["attitude"].index(name)
            for number, (start, stop) in enumerate(log.bounds.tolist()):
                rows = (each.segment == number) & np.isfinite(each.values[:, column])
                if rows.any():
                    series = np.unwrap(each.values[rows, column])
                    moment = each.time[rows] - each.delay
                    euler[start:stop, index] = np.interp(log.time[start:stop], moment, series)
    return replace(log, attitude=quaternion_from_euler(euler))


def _sensor(log: Log, measurement: Measurement) -> Sensor:
    rows = interpolate_rows(log, measurement)
    if measurement.kind == "attitude":
        measurement = _unwrap(log, measurement, rows)
    values = measurement.values
    std = measurement.std
    if std is None:
        std = np.array([
            white_noise_std(column[np.isfinite(column)], measurement.segment[np.isfinite(column)])
            for column in values.T
        ])  # fmt: skip
    valid = np.isfinite(values) & rows.inside[:, None]
    if measurement.kind == "position":
        valid &= ~position_outliers(measurement, std)
    return Sensor(measurement, rows, std, valid)


def _unwrap(log: Log, measurement: Measurement, rows: Interpolation) -> Measurement:
    """Return angles without jumps, near those of the log."""
    euler = unwrapped_euler(log)
    columns = [KINDS["attitude"].index(name) for name in measurement.components]
    near = euler[rows.lower][:, columns]
    turns = np.round((measurement.values - near) / (2.0 * np.pi))
    return replace(measurement, values=frozen(measurement.values - 2.0 * np.pi * turns))


def component_matrix(sensor: Sensor) -> FloatArray:
    """Return the rows of the unit matrix that select the components, (k, 3)."""
    known = KINDS[sensor.kind]
    return np.eye(3)[[known.index(name) for name in sensor.measurement.components]]


def known_part(sensor: Sensor, rates: FloatArray, rotations: FloatArray) -> FloatArray:
    """Return what the lever arm adds to the measured components, (m, k)."""
    arm, rows = sensor.measurement.lever_arm, sensor.rows
    if not arm.any() or sensor.kind in ANGULAR_KINDS:
        return np.zeros(sensor.valid.shape)
    series = rotations @ arm if sensor.kind == "position" else np.cross(rates, arm)
    values = interpolate_series(series, rows.lower, rows.upper, rows.share)
    return np.asarray(values @ component_matrix(sensor).T)


def _observations(
    sensor: Sensor, rates: FloatArray, rotations: FloatArray
) -> Iterator[Observation]:
    if sensor.kind == "specific_force":
        return
    values = sensor.measurement.values - known_part(sensor, rates, rotations)
    is_pose = sensor.kind in ("position", "attitude")
    for column, unit in enumerate(component_matrix(sensor)):
        used = sensor.valid[:, column]
        rows = sensor.rows._replace(inside=used)
        pair = (unit, np.zeros(3)) if is_pose else (np.zeros(3), unit)
        series = np.where(used, values[:, column], 0.0)
        yield Observation(rows, series, float(sensor.std[column]), *pair)


def _recorded_observations(
    log: Log, names: Sequence[str], fixed: Sequence[str]
) -> Iterator[Observation]:
    """Yield the velocities recorded at the samples, and zeros for locked axes."""
    last = log.bounds[:, 1] - 1
    lower = np.arange(log.n)
    share = np.zeros(log.n)
    lower[last], share[last] = last - 1, 1.0
    rows = Interpolation(lower, share, np.ones(log.n, dtype=bool))
    for index, name in enumerate(names):
        column = log.velocity[:, VELOCITIES.index(name)]
        if name in fixed:
            yield Observation(rows, np.zeros(log.n), 1e-6, np.zeros(3), np.eye(3)[index])
        elif name in log.velocity_names:
            std = white_noise_std(column, log.segment_numbers)
            yield Observation(rows, column, std, np.zeros(3), np.eye(3)[index])


def _velocity_scale(log: Log, observations: Sequence[Observation]) -> float:
    """Return the largest RMS velocity that observations show beyond their noise."""
    scales = [0.0]
    for each in observations:
        lower, share, inside = each.rows
        rows = np.flatnonzero(inside)
        values = each.values[rows]
        if each.velocity.any():
            scales.append(float(np.sqrt(np.mean(values**2))) if len(values) else 0.0)
            continue
        time = np.interp(lower[rows] + share[rows], np.arange(log.n), log.elapsed)
        for lag in 2 ** np.arange(10):
            if lag >= len(rows):
                break
            change = values[lag:] - values[:-lag]
            square = float(mad_std(change)) ** 2 - 2.0 * each.std**2
            scales.append(np.sqrt(max(square, 0.0)) / float(np.median(time[lag:] - time[:-lag])))
    return max(scales)


def _scale_of_forces(log: Log, sensors: Iterable[Sensor]) -> float:
    """Return the spread of the specific force times the correlation time, over PRIOR_FACTOR."""
    spreads = [
        float(np.nanstd(each.measurement.values[:, column]))
        for each in sensors
        if each.kind == "specific_force"
        for column in range(each.valid.shape[1])
    ]
    return max(spreads, default=1.0) * log.time_scale / PRIOR_FACTOR


def _describe_faults(log: Log, sensor: Sensor) -> Iterator[str]:
    """Yield a sentence on what a sensor does not cover, and on its outliers."""
    measurement = sensor.measurement
    covered = 0.0
    for number, (start, stop) in enumerate(log.bounds.tolist()):
        moments = measurement.time[(measurement.segment == number) & sensor.valid.any(axis=1)]
        span = log.time[start], log.time[stop - 1]
        covered += float(np.ptp(np.clip(moments, *span))) if len(moments) else 0.0
    if covered < MIN_COVERAGE * log.duration:
        yield (
            f"{measurement.name} covers {100.0 * covered / log.duration:.0f} % of the log: "
            "elsewhere only the other sensors count."
        )
    finite = np.isfinite(measurement.values) & sensor.rows.inside[:, None]
    for column, name in enumerate(measurement.components):
        wrong = np.flatnonzero(finite[:, column] & ~sensor.valid[:, column])
        if len(wrong):
            moments = ", ".join(f"{measurement.time[k]:.4g}" for k in wrong[:3])
            more = f" and {len(wrong) - 3} more" if len(wrong) > 3 else ""
            yield (
                f"{measurement.name}: {len(wrong)} outlier{'s' * (len(wrong) > 1)} of {name} left "
                f"out, at {moments} s{more}."
            )

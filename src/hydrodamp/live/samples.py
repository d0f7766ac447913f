"""Samples of a stream: read one, classify it as accepted or rejected, fill equation 1 with it.

Plausible ranges of commands and recorded wrenches are derived from the vehicle. A rejected
sample is counted and ends no run. After a gap the estimator restarts its block of time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.basis.term import AXES, VELOCITIES
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import ATTITUDE, EULER, RESERVED, SEGMENT
from hydrodamp.data.checks import NORM_ROUNDING
from hydrodamp.data.log import Log
from hydrodamp.data.plausibility import MAX_NORM_ERROR, MAX_RATIO, MAX_VELOCITY, SENTINELS
from hydrodamp.data.record import max_step
from hydrodamp.errors import ProblemError
from hydrodamp.identification.adaptive import observe
from hydrodamp.kernels.plant import Sample
from hydrodamp.models.model import DampingModel
from hydrodamp.simulation.problem import EquationTable, prepare
from hydrodamp.simulation.ranges import MIN_OUTLIER_STEP, Ranges
from hydrodamp.vehicle.vehicle import Vehicle

#: One sample as a source provides it: numbers by canonical column, and the segment.
Row = Mapping[str, object]

#: Classes of a sample. Those of ``RESTARTS`` are accepted as the first ones of a segment.
ACCEPTED = "taken"
RESTARTS = {
    "first": "a first sample",
    "joined": "another segment",
    "gap": "a gap",
    "clock": "a clock that was set back",
    "again": "rejected samples",
    "leapt": "a step in velocities, commands or wrenches that lasted",
}
REJECTED = {
    "unreadable": "that cannot be read",
    "incomplete": "without a required time, velocity, attitude or command",
    "absurd": "with a value outside the plausible range",
    "overflow": "that would make the estimate infinite",
    "failed": "that raises an error",
    "repeated": "with the same time as the previous sample",
    "late": "older than the previous sample",
    "spike": "with an outlier in a velocity, a command or a wrench",
    "frozen": "with velocities that have been constant for seconds",
}

MAX_LATE_SAMPLES = 20  # consecutive older samples after which the clock was set back; by choice
MAX_OUTLIERS = 3  # consecutive outliers after which the step is real; by choice
OUTLIER_RATIO = 20.0  # least ratio of an outlier's change to the usual one; by choice
MAX_CONSTANT_S = 2.0  # s, that velocities may stay equal to the last bit; by choice
STEP_MEMORY = 25  # time steps that define the longest regular one
CHANGE_GAIN = 0.01  # of the exponential average of changes; about 100 samples


def rows_of(log: Log) -> Iterator[Row]:
    """Yield the samples of a log."""
    columns = columns_of(log)
    for segment in log.segments:
        for k in range(segment.start, segment.stop):
            row = {name: float(values[k]) for name, values in columns.items()}
            yield {**row, SEGMENT: segment.name}


def read_number(row: Row, name: str, default: float = math.nan) -> float:
    """Return a value of a row as a float; NaN where it is no number."""
    value = row.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.nan


def read_velocity(row: Row, free: Sequence[bool]) -> tuple[float, ...]:
    """Return the six velocities; zero along locked axes."""
    return tuple(
        read_number(row, name) if is_free else 0.0
        for name, is_free in zip(VELOCITIES, free, strict=True)
    )


def read_inputs(row: Row, names: Sequence[str]) -> tuple[float, ...]:
    """Return commands and the recorded wrench; a missing axis of the wrench is zero."""
    return tuple(read_number(row, name, 0.0 if name in AXES else math.nan) for name in names)


def sample_equations(vehicle: Vehicle, model: DampingModel, row: Row) -> EquationTable:
    """Return equation 1 for samples with the columns of this row.

    Raises ``ProblemError`` where the row lacks a required column.
    """
    time = read_number(row, "time")
    if not math.isfinite(time):
        raise ProblemError("a sample must have a finite `time` [s].")
    attitude, commands, wrench, ratio = _read_channels(row)
    log = Log.from_arrays(
        [time, time + 1.0],
        {name: [read_number(row, name)] * 2 for name in VELOCITIES if name in row},
        attitude=None if attitude is None else [attitude] * 2,
        commands={name: [value] * 2 for name, value in commands.items() if math.isfinite(value)},
        wrench=None if wrench is None else [wrench] * 2,
        propulsion_ratio=None if ratio is None else [ratio] * 2,
        source="sample",
    )
    return prepare(vehicle, log, model).equations


def make_sample(
    equations: EquationTable, row: Row, velocity: Sequence[float], previous: Sample | None
) -> Sample:
    """Return the input of an estimator step; ``previous`` is the last one of the segment."""
    attitude, commands, wrench, ratio = _read_channels(row)
    return observe(
        equations,
        time=read_number(row, "time"),
        velocity=velocity,
        attitude=(0.0, 0.0, 0.0) if attitude is None else attitude,
        commands=commands,
        wrench=wrench,
        propulsion_ratio=ratio,
        previous=previous,
    )


def _read_channels(
    row: Row,
) -> tuple[list[float] | None, dict[str, float], list[float] | None, float | None]:
    """Return attitude, commands, wrench and propulsion ratio; None where the row has none."""
    attitude: list[float] | None = None
    if "qw" in row:
        attitude = _normalise([read_number(row, name) for name in ATTITUDE.columns])
    elif "yaw" in row or "roll" in row:
        attitude = [read_number(row, name, 0.0) for name in EULER]
    wrench = [read_number(row, x, 0.0) for x in AXES] if not row.keys().isdisjoint(AXES) else None
    ratio = read_number(row, "eta") if "eta" in row else None
    commands = {name: read_number(row, name) for name in row if name not in RESERVED}
    return attitude, commands, wrench, ratio


def _normalise(quaternion: list[float]) -> list[float]:
    """Return a unit quaternion as a log has it; NaN where the norm is not near one."""
    norm = math.sqrt(sum(element * element for element in quaternion))
    if abs(norm - 1.0) <= NORM_ROUNDING:
        return quaternion
    divisor = norm if abs(norm - 1.0) <= MAX_NORM_ERROR else math.nan
    return [element / divisor for element in quaternion]


class SampleValidator(NamedTuple):
    """State that classifies the next sample from the accepted ones."""

    time: float = math.nan
    velocity: tuple[float, ...] = ()
    segment: str = ""
    steps: tuple[float, ...] = ()  # s
    changes: tuple[float, ...] = (0.0,) * 6  # average change of each velocity per sample
    constant_since: tuple[float, float] = (0.0, 0.0)  # s, linear and angular velocities
    late: tuple[float, int] = (0.0, 0)  # time of the last late sample; consecutive late samples
    n_outliers: int = 0  # consecutive
    is_interrupted: bool = False  # the next accepted sample restarts
    inputs: tuple[float, ...] = ()  # largest accepted magnitudes of commands and wrenches
    time_before_gap: float | None = None  # s, while the segment has one or two samples


def classify(
    validator: SampleValidator,
    time: float,
    velocity: Sequence[float],
    segment: str,
    inputs: Sequence[float] = (),
    ranges: Ranges = Ranges(),  # noqa: B008 - immutable
) -> tuple[SampleValidator, str]:
    """Return the next state and the class of a sample; missing values are NaN."""
    if not all(map(math.isfinite, (time, *velocity, *inputs))):
        return validator._replace(is_interrupted=True), "incomplete"
    excess = [x for x, limit in zip(inputs, ranges.largest, strict=True) if abs(x) > limit]
    if excess or max(map(abs, velocity)) > MAX_VELOCITY:
        is_unknown = excess and SENTINELS.issuperset(excess)
        return validator._replace(is_interrupted=True), "incomplete" if is_unknown else "absurd"
    current, accepted = tuple(velocity), validator.inputs or (0.0,) * len(inputs)
    largest = tuple(max(old, abs(new)) for old, new in zip(accepted, inputs, strict=True))
    restarted = SampleValidator(time, current, segment, constant_since=(time, time), inputs=largest)
    step = time - validator.time
    is_next = bool(validator.velocity) and segment == validator.segment
    if is_next and step <= 0.0:
        return _classify_late(validator, restarted, step)
    has_input_step = _has_input_step(accepted, inputs, ranges)
    rejected = validator._replace(n_outliers=validator.n_outliers + 1)
    if validator.velocity and has_input_step and rejected.n_outliers < MAX_OUTLIERS:
        return rejected, "spike"
    if not is_next:
        return restarted, "joined" if validator.velocity else "first"
    if step > 1.0 and step > max_step(np.array(validator.steps)):
        return restarted._replace(time_before_gap=validator.time), "gap"
    change = [abs(new - old) for new, old in zip(current, validator.velocity, strict=True)]
    has_velocity_step = any(
        c > MIN_OUTLIER_STEP and c > OUTLIER_RATIO * average
        for c, average in zip(change, validator.changes, strict=True)
    )
    if has_velocity_step and rejected.n_outliers < MAX_OUTLIERS:
        return rejected, "spike"
    if has_velocity_step or has_input_step:
        return restarted, "leapt"
    constant_since = (
        validator.constant_since[0] if not any(change[:3]) and any(current[:3]) else time,
        validator.constant_since[1] if not any(change[3:]) and any(current[3:]) else time,
    )
    steps = (*validator.steps[1 - STEP_MEMORY :], step)
    is_frozen = time - min(constant_since) > MAX_CONSTANT_S
    state = SampleValidator(
        time,
        current,
        segment,
        steps,
        tuple(a + CHANGE_GAIN * (c - a) for c, a in zip(change, validator.changes, strict=True)),
        constant_since,
        is_interrupted=is_frozen,
        inputs=largest,
        time_before_gap=validator.time_before_gap if len(steps) < MAX_OUTLIERS - 1 else None,
    )
    return state, "frozen" if is_frozen else "again" if validator.is_interrupted else ACCEPTED


def _has_input_step(accepted: Sequence[float], inputs: Sequence[float], ranges: Ranges) -> bool:
    """Return whether an input is far above all accepted ones and above an ordinary one."""
    return any(
        abs(x) > ordinary and abs(x) > MAX_RATIO * largest and (largest or ordinary)
        for x, largest, ordinary in zip(inputs, accepted, ranges.ordinary, strict=True)
    )


def _classify_late(
    validator: SampleValidator, restarted: SampleValidator, step: float
) -> tuple[SampleValidator, str]:
    """Reject a sample that is not newer, unless many of them follow one another in order.

    Where the segment has only one or two samples since a gap, and this one continues the clock
    from before it, those were ahead of time: restart at once.
    """
    time = restarted.time
    if step == 0.0:
        return validator, "repeated"
    if validator.time_before_gap is not None and time > validator.time_before_gap:
        return restarted._replace(segment=validator.segment), "clock"
    last, count = validator.late
    count = count + 1 if time > last else 1
    if count < MAX_LATE_SAMPLES:
        return validator._replace(late=(time, count)), "late"
    return restarted._replace(segment=validator.segment), "clock"

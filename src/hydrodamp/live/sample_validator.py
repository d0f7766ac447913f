"""Classification of the samples of a stream as accepted or rejected.

A rejected sample is counted and ends no run. Without a required column it interrupts nothing, as a
lost one; with a missing value it does, as in a log. After a gap the estimator restarts its block.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hydrodamp.data.plausibility import MAX_RATIO
from hydrodamp.data.record import max_step
from hydrodamp.simulation.ranges import MIN_OUTLIER_STEP, Ranges

#: Classes of a sample. Those of ``RESTARTS`` are accepted as the first ones of a segment.
ACCEPTED = "taken"
RESTARTS = {
    "first": "a first sample",
    "joined": "another segment",
    "gap": "a gap",
    "clock": "a clock that was set back",
    "again": "rejected samples",
    "leapt": "a step in velocities, attitude, commands or wrenches that lasted",
}
REJECTED = {
    "unreadable": "that cannot be read",
    "foreign": "without any velocity",
    "incomplete": "without a required time, velocity, attitude, command or wrench",
    "absurd": "with a value outside the plausible range",
    "overflow": "that would make the estimate infinite",
    "failed": "that raises an error",
    "repeated": "with the same time as the previous sample",
    "late": "older than the previous sample",
    "spike": "with an outlier in a velocity, the attitude, a command or a wrench",
    "frozen": "with velocities that have been constant for seconds",
}

MAX_LATE_SAMPLES = 20  # consecutive older samples after which the clock was set back; by choice
MAX_OUTLIERS = 3  # consecutive outliers after which the step is real; by choice
MAX_INCOMPLETE = 20  # consecutive rows, then those before the estimate were strays; by choice
OUTLIER_RATIO = 20.0  # least ratio of an outlier's change to the usual one; by choice
QUANTILE, QUANTILE_GAIN = 0.99, 0.05  # of magnitudes: up 5 % per sample at most; by choice
MAX_CONSTANT_S = 2.0  # s, that velocities may stay equal to the last bit; by choice
STEP_MEMORY = 25  # time steps that define the longest regular one
CHANGE_GAIN = 0.01  # of the exponential average of changes; about 100 samples


class SampleValidator(NamedTuple):
    """State that classifies the next sample from the accepted ones."""

    time: float = math.nan
    motion: tuple[float, ...] = ()  # six velocities, and the down vector in the body frame
    segment: str = ""
    steps: tuple[float, ...] = ()  # s
    changes: tuple[float, ...] = (0.0,) * 9  # average change of each motion per sample
    constant_since: tuple[float, float] = (0.0, 0.0)  # s, linear and angular velocities
    late: tuple[float, int] = (0.0, 0)  # time of the last late sample; consecutive late samples
    n_outliers: int = 0  # consecutive
    is_interrupted: bool = False  # the next accepted sample restarts
    inputs: tuple[float, ...] = ()  # last accepted magnitudes of commands and wrenches
    usual: tuple[float, ...] = ()  # running 99 % quantiles of these magnitudes
    time_before_gap: float | None = None  # s, while the segment has one or two samples
    channels: tuple[str, ...] = ()  # optional columns that every row must have
    #: Optional columns of the last rows instead, and the number of these rows.
    new_channels: tuple[tuple[str, ...], int] = ((), 0)


def count_other_channels(validator: SampleValidator, names: tuple[str, ...]) -> SampleValidator:
    """Return the state after a row with these optional columns."""
    if names == validator.channels:
        return validator._replace(new_channels=((), 0))
    last, count = validator.new_channels
    return validator._replace(new_channels=(names, count + 1 if names == last else 1))


def classify(
    validator: SampleValidator,
    time: float,
    motion: Sequence[float],
    segment: str,
    inputs: Sequence[float] = (),
    ranges: Ranges = Ranges(),  # noqa: B008 - immutable
) -> tuple[SampleValidator, str]:
    """Return the next state and the class of a sample without a fault."""
    current, size = tuple(motion), tuple(map(abs, inputs))
    usual = tuple(map(_follow_quantile, validator.usual or ranges.ordinary, size))
    restarted = SampleValidator(time, current, segment, constant_since=(time, time))
    restarted = restarted._replace(inputs=size, usual=usual, channels=validator.channels)
    step = time - validator.time
    is_next = bool(validator.motion) and segment == validator.segment
    if is_next and step <= 0.0:
        return _classify_late(validator, restarted, step)
    has_input_step = _has_input_step(validator, size, ranges)
    rejected = validator._replace(n_outliers=validator.n_outliers + 1)
    if validator.motion and has_input_step and rejected.n_outliers < MAX_OUTLIERS:
        return rejected, "spike"
    if not is_next:
        return restarted, "joined" if validator.motion else "first"
    if step > 1.0 and step > max_step(np.array(validator.steps)):
        return restarted._replace(time_before_gap=validator.time), "gap"
    change = [abs(new - old) for new, old in zip(current, validator.motion, strict=True)]
    has_motion_step = any(
        c > MIN_OUTLIER_STEP and c > OUTLIER_RATIO * average
        for c, average in zip(change, validator.changes, strict=True)
    )
    if has_motion_step and rejected.n_outliers < MAX_OUTLIERS:
        return rejected, "spike"
    if has_motion_step or has_input_step:
        return restarted, "leapt"
    constant_since = (
        validator.constant_since[0] if not any(change[:3]) and any(current[:3]) else time,
        validator.constant_since[1] if not any(change[3:6]) and any(current[3:6]) else time,
    )
    steps = (*validator.steps[1 - STEP_MEMORY :], step)
    is_frozen = time - min(constant_since) > MAX_CONSTANT_S
    pairs = zip(change, validator.changes, strict=True)
    state = restarted._replace(
        steps=steps,
        changes=tuple(average + CHANGE_GAIN * (c - average) for c, average in pairs),
        constant_since=constant_since,
        is_interrupted=is_frozen,
        time_before_gap=validator.time_before_gap if len(steps) < MAX_OUTLIERS - 1 else None,
    )
    return state, "frozen" if is_frozen else "again" if validator.is_interrupted else ACCEPTED


def _has_input_step(validator: SampleValidator, size: Sequence[float], ranges: Ranges) -> bool:
    """Return whether an input is far above the usual, the last and an ordinary one."""
    accepted = map(max, validator.usual or size, validator.inputs or size)
    return any(
        x > ordinary and x > MAX_RATIO * reference and (reference or ordinary)
        for x, reference, ordinary in zip(size, accepted, ranges.ordinary, strict=True)
    )


def _follow_quantile(quantile: float, size: float) -> float:
    """Return the running quantile after a sample (H. Robbins and S. Monro, 1951)."""
    if size <= quantile:
        return quantile * (1.0 - QUANTILE_GAIN * (1.0 - QUANTILE))
    return min(size, quantile * (1.0 + QUANTILE_GAIN * QUANTILE)) or size


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

"""Is a log fit for the job: what is missing, what looks wrong, and what can be identified."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.atoms import AXES, VELOCITIES
from hydrodamp.conditioning.consistency import VehicleScale
from hydrodamp.conditioning.current import current_warning
from hydrodamp.conditioning.derivatives import rates_from_attitude
from hydrodamp.conditioning.quality_checks import QualityIssue, check_quality
from hydrodamp.conditioning.vertical import VerticalAxis, vertical_tests
from hydrodamp.data.agreement import noise_std
from hydrodamp.data.channels import unit_of
from hydrodamp.data.log import Log, recorded_arrays, recorded_velocities
from hydrodamp.ingest.inspection.delay import Delay, estimate_delays
from hydrodamp.ingest.inspection.orientation import (
    MIN_RESPONSE_SHARE,
    UNDECIDED,
    describe_frame,
    list_responses,
    misread_positions,
    reversed_wrench,
    wrong_frame,
)

_MIN_EXCITATION = 2.0  # times the deviation that is hardly any is excitation worth speaking of
_NOISE_FACTOR = 2.0  # times the noise of a channel, that hardly is any
_MIN_SAMPLES = 60  # samples, of which coefficients can be made
_MAX_JITTER = 0.25  # of a step
_MOTIONS = {"u": "surge", "v": "sway", "w": "heave", "p": "roll", "q": "pitch", "r": "yaw"}
_PLANAR_VELOCITIES = {"u", "v", "r"}
_MAX_STEP_S = 0.25  # s, a step of a small vehicle above which its accelerations are hardly resolved
_MIN_DURATION_S = 60.0  # s, below which little is determined of one


@dataclass(frozen=True)
class SegmentFacts:
    """One segment of a log."""

    name: str
    n_samples: int
    start: float
    end: float
    clock: float
    step: float
    longest_step: float


@dataclass(frozen=True)
class Channel:
    """One column of a log."""

    name: str
    unit: str
    mean: float
    std: float
    low: float
    high: float
    n_changes: int
    excitation: float = 0.0  # its deviation over one that is hardly any


@dataclass(frozen=True)
class Requirements:
    """What a vehicle asks of a log, and what of it the log lacks."""

    velocities: tuple[str, ...]
    missing: tuple[str, ...] = ()
    reservations: tuple[str, ...] = ()
    suspicions: tuple[QualityIssue, ...] = ()
    length: float | None = None  # of the vehicle [m]


@dataclass(frozen=True)
class QualityReport:
    """What a log holds, what it lacks, and what to expect of it."""

    source: str
    n_samples: int
    duration: float
    segments: tuple[SegmentFacts, ...]
    velocities: tuple[Channel, ...]
    commands: tuple[Channel, ...]
    recorded: tuple[str, ...]
    delays: tuple[Delay, ...]
    missing: tuple[str, ...]
    issues: tuple[QualityIssue, ...]
    remarks: tuple[str, ...]
    identifiable: tuple[str, ...]
    required: tuple[str, ...]
    vertical_axis: VerticalAxis
    responses: tuple[str, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What looks wrong, a sentence each."""
        return tuple(f"{each}." for each in self.issues)

    @property
    def is_usable(self) -> bool:
        """Whether the log can be used as it is."""
        grave = [one for one in self.issues if not one.is_minor]
        return not (self.missing or grave)

    @property
    def is_poorly_excited(self) -> bool:
        """Whether a velocity that is wanted hardly varies: another dive is needed."""
        return any(
            c.excitation < _MIN_EXCITATION for c in self.velocities if c.name in self.required
        )

    @property
    def report_quality(self) -> str:
        """The verdict itself."""
        if self.missing:
            return "Not fit for the job as it is: see what is missing."
        if not self.is_usable:
            return "Not fit for the job yet: correct what looks wrong first."
        grades = {c.name: c.excitation for c in self.velocities if c.name in self.required}
        well = [name for name, much in grades.items() if much >= _MIN_EXCITATION]
        little = [name for name, much in grades.items() if 1.0 <= much < _MIN_EXCITATION]
        poor = [name for name, much in grades.items() if much < 1.0]
        fit = "Fit for the job" if len(well) == len(grades) else f"Fit for {_motion_names(well)}"
        parts = [fit if well else "Fit for little" if little else "Not fit for the job"]
        parts += [f"little variation in {_motion_names(little)}"] if little else []
        parts += [f"hardly any variation in {_motion_names(poor)}"] if poor else []
        known = "" if self.vertical_axis.is_sure else f" {UNDECIDED}."
        return f"{'; '.join(parts)}.{' Clean it first.' if self.issues else ''}{known}"

    @property
    def frame(self) -> str:
        """What decides which way is down; or that nothing does, and what would."""
        return describe_frame(self.vertical_axis, self.responses)


def _motion_names(velocities: Sequence[str]) -> str:
    return ", ".join(f"{_MOTIONS[name]} ({name})" for name in velocities)


def verdict(
    log: Log,
    needs: Requirements | None = None,
    upright: VerticalAxis | None = None,
    measured: Mapping[str, str] = MappingProxyType({}),
) -> QualityReport:
    """Judge a log; without the needs of a vehicle all velocities are asked for.

    ``upright`` is what is known of its axes from elsewhere, ``measured`` the roles of commands
    that are none by their names.
    """
    needs = needs or Requirements(VELOCITIES, tuple(_missing_channels(log)))
    whole = log if log.attitude is None else rates_from_attitude(log)
    size = VehicleScale.from_log(log) if needs.length is None else VehicleScale(needs.length)
    late = tuple(one for one in estimate_delays(whole) if one.command not in measured)
    moving, segments = _velocity_channels(log, size), tuple(_segment_facts(log))
    depth = next((log.command(one) for one, of in measured.items() if of.endswith("depth")), None)
    upright = upright or VerticalAxis.combine(tuple(vertical_tests(log, depth)))
    commands = tuple(_channel(log, name, "", log.command(name)) for name in log.command_names)
    wanted = tuple(one for one in moving if one.name in needs.velocities)
    odd = (*check_quality(log, needs.length), *needs.suspicions, *misread_positions(measured))
    odd = (*odd, *wrong_frame(upright, odd), *reversed_wrench(late))
    few = (
        f"samples: {log.n} are too few to determine coefficients; record minutes, several a second."
    )
    reservations = _remarks(log, size, segments, wanted, commands)
    if all(one.channel != "time" for one in odd):
        reservations = itertools.chain(_jitter_remark(log), reservations)
    return QualityReport(
        source=log.source or "in memory",
        n_samples=log.n,
        duration=log.duration,
        segments=segments,
        velocities=moving,
        commands=commands,
        recorded=tuple(
            name for name in recorded_arrays(log) if name not in ("time", "velocity", "commands")
        ),
        delays=late,
        missing=(*needs.missing, *([few] if log.n < _MIN_SAMPLES else [])),
        issues=odd,
        remarks=(*reservations, *_wrench_remark(log, late), *needs.reservations),
        identifiable=tuple(_identifiable(_velocity_channels(whole, size), needs.velocities, late)),
        required=needs.velocities,
        vertical_axis=upright,
        responses=tuple(list_responses(late)),
    )


def _segment_facts(log: Log) -> Iterator[SegmentFacts]:
    for segment in log.segments:
        time = log.time[segment.start : segment.stop]
        steps = np.diff(time)
        ends = log.elapsed[[segment.start, segment.stop - 1]]
        numbers = (*ends, time[0], np.median(steps), steps.max())
        yield SegmentFacts(segment.name, len(time), *map(float, numbers))


def _velocity_channels(log: Log, size: VehicleScale) -> tuple[Channel, ...]:
    found = []
    for name, values in recorded_velocities(log).items():
        unit = unit_of(name)
        least = max(size.negligible(unit), _NOISE_FACTOR * noise_std(values, log.bounds))
        channel = _channel(log, name, unit, values)
        found.append(replace(channel, excitation=channel.std / least))
    return tuple(found)


def _channel(log: Log, name: str, unit: str, values: FloatArray) -> Channel:
    changed = np.diff(values) != 0.0
    changed[log.bounds[1:, 0] - 1] = False
    spread = values.mean(), values.std(), values.min(), values.max()
    mean, std, low, high = map(float, spread)
    return Channel(name, unit, mean, std, low, high, int(changed.sum()))


def _identifiable(
    channels: Iterable[Channel], wanted: Sequence[str], late: Sequence[Delay]
) -> Iterator[str]:
    """Yield what can be identified: excited axes, and gains of commands that were seen to act."""
    known = {channel.name: channel for channel in channels}
    fine = [one for one in known.values() if one.excitation >= _MIN_EXCITATION]
    if well := [one for one in fine if one.name in wanted]:
        told = ", ".join(f"{_MOTIONS[c.name]} (std {c.std:.2g} {c.unit})" for c in well)
        yield f"it can identify damping in {told}."
    if sure := [one for one in late if one.share >= MIN_RESPONSE_SHARE]:
        told = ", ".join(f"{one.command} ({_MOTIONS[one.velocity]})" for one in sure)
        yield f"gains can be fitted for commands that are seen to act: {told}."
    if set(known) == _PLANAR_VELOCITIES and set(wanted) == set(VELOCITIES):
        yield "for a vehicle of `axes: [X, Y, N]`, no velocity is missing."


def _missing_channels(log: Log) -> Iterator[str]:
    absent = [name for name in VELOCITIES if name not in log.velocity_names]
    if absent:
        yield (
            f"velocities {' '.join(absent)}: needed unless the vehicle's `axes` leave them out "
            "(ask again with --vehicle), or a step derives them: `rates_from_attitude`, "
            "`velocity_from_position`."
        )
    if log.attitude is None:
        yield "attitude (roll pitch yaw or qw qx qy qz): weight and buoyancy act along it."
    if log.wrench is None and not log.command_names:
        yield "actuation: the wrench X Y Z K M N, or command columns."


def _remarks(
    log: Log,
    size: VehicleScale,
    segments: Sequence[SegmentFacts],
    channels: Sequence[Channel],
    commands: Sequence[Channel],
) -> Iterator[str]:
    if log.duration < size.time_scale * _MIN_DURATION_S:
        yield f"only {log.duration:.3g} s were recorded; minutes of manoeuvres are better."
    if max(segment.step for segment in segments) > (
        slow := max(1.0, size.time_scale) * _MAX_STEP_S
    ):
        yield f"samples are more than {slow:.2g} s apart; {2.5 / slow:.2g} a second are better."
    for channel in channels:
        if channel.excitation < _MIN_EXCITATION:
            little = ("varies little", "uncertain")
            varies, so = ("hardly varies", "not determined") if channel.excitation < 1.0 else little
            yield (
                f"{channel.name} {varies} (std {channel.std:.2g} {channel.unit}): "
                f"coefficients with {channel.name} will be {so}."
            )
    for name in (channel.name for channel in channels if channel.low * channel.high > 0.0):
        yield (
            f"{name} never changes sign: {name}^2 and {name}|{name}| are then one column, and so "
            f"are {name} and |{name}|."
        )
    constant = [channel.name for channel in commands if channel.low == channel.high]
    if constant:
        yield f"commands that never change: {' '.join(constant)}."
    if carried := current_warning(log):
        yield carried
    if log.acceleration is None:
        yield "no recorded acceleration: least squares differentiates the velocities."


def _jitter_remark(log: Log) -> Iterator[str]:
    """Yield whether steps differ, though the motion does not tell that its clock is another's."""
    low, step, high = np.quantile(log.steps, (0.05, 0.5, 0.95)).tolist()
    if (jitter := (high - low) / 2 / step) > _MAX_JITTER:
        yield (
            f"the clock jitters by {jitter:.0%} of a step: {low:.2g} to {high:.2g} s. If it is "
            "when messages came, take the sensor's own stamp instead (`time` in the mapping)."
        )


def _wrench_remark(log: Log, late: Sequence[Delay]) -> Iterator[str]:
    """Yield whether no velocity follows a recorded wrench."""
    driven = log.wrench is not None and bool(np.ptp(log.wrench, axis=0).any())
    if driven and not any(one.command in AXES and one.share >= MIN_RESPONSE_SHARE for one in late):
        yield "no axis of the recorded wrench is seen to move the vehicle."

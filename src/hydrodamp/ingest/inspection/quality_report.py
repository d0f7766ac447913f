"""Quality report of a log: missing channels, issues, excitation and identifiable axes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.term import MOTIONS, VELOCITIES
from hydrodamp.conditioning.consistency import VehicleScale
from hydrodamp.conditioning.current import find_current
from hydrodamp.conditioning.derivatives import rates_from_attitude
from hydrodamp.conditioning.quality_checks import QualityIssue, check_quality
from hydrodamp.conditioning.vertical_axis import UNDECIDED, VerticalAxis, vertical_tests
from hydrodamp.data.channel_regression import noise_std
from hydrodamp.data.channels import unit_of
from hydrodamp.data.log import Log, recorded_arrays, recorded_velocities
from hydrodamp.ingest.inspection.command_signs import check_commands
from hydrodamp.ingest.inspection.delay import (
    Delay,
    estimate_delays,
    list_responses,
    wrench_remark,
)
from hydrodamp.ingest.inspection.equivalent_commands import equivalent_commands
from hydrodamp.ingest.inspection.frames import misread_positions, wrong_frame
from hydrodamp.ingest.inspection.missing_channels import (
    PLANAR_REMARK,
    Requirements as Requirements,
    constant_commands,
    is_level,
    missing_channels,
)

#: Verdict on a log that lacks a required channel.
UNUSABLE = "Not suitable for identification: see what is missing."
_MIN_EXCITATION = 2.0  # times the negligible standard deviation: sufficiently excited
_NOISE_FACTOR = 2.0  # times the noise of a channel: negligible variation
_MIN_SAMPLES = 60  # samples; fewer do not determine coefficients
_MAX_JITTER = 0.25  # of a step
_PLANAR_VELOCITIES = {"u", "v", "r"}
_MAX_STEP_S = 0.25  # s; longer steps do not resolve the accelerations of a small vehicle
_MIN_DURATION_S = 60.0  # s; shorter logs determine little of a small vehicle


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
    excitation: float = 0.0  # standard deviation over the negligible one


@dataclass(frozen=True)
class QualityReport:
    """Contents, deficiencies and identifiable axes of a log."""

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
    options: tuple[QualityIssue, ...] = ()  # issues that a remark states, with a step to decide on

    @property
    def warnings(self) -> tuple[str, ...]:
        """The quality issues, one message each."""
        return tuple(f"{issue}." for issue in self.issues)

    @property
    def is_usable(self) -> bool:
        """Whether the log can be used unchanged."""
        return not self.missing and all(issue.is_minor for issue in self.issues)

    @property
    def _required_channels(self) -> list[Channel]:
        return [channel for channel in self.velocities if channel.name in self.required]

    @property
    def is_planar(self) -> bool:
        """Whether the log has no required velocity but u, v and r."""
        return all(channel.name in _PLANAR_VELOCITIES for channel in self._required_channels)

    @property
    def is_poorly_excited(self) -> bool:
        """Whether a required velocity is not sufficiently excited."""
        return any(channel.excitation < _MIN_EXCITATION for channel in self._required_channels)

    @property
    def verdict(self) -> str:
        """The verdict in one sentence."""
        if self.missing:
            return UNUSABLE
        if not self.is_usable:
            return "Not yet suitable for identification: correct the quality issues first."
        required = self._required_channels
        well = [channel for channel in required if channel.excitation >= _MIN_EXCITATION]
        poor = [channel for channel in required if channel.excitation < 1.0]
        little = [channel for channel in required if channel not in (*well, *poor)]
        purpose = _motion_names(well) if little or poor else "identification"
        unsuitable = f"{'Hardly' if little else 'Not'} suitable for identification"
        clauses = [f"Suitable for {purpose}" if well else unsuitable]
        clauses += [f"little variation in {_motion_names(little)}"] if little else []
        clauses += [f"hardly any variation in {_motion_names(poor)}"] if poor else []
        known = "" if self.vertical_axis.is_sure or self.is_planar else f" {UNDECIDED}."
        issues = " The quality issues are minor." if self.issues else ""
        return f"{'; '.join(clauses)}.{issues}{known}"

    @property
    def frame(self) -> str:
        """The evidence for the direction of z, or what would determine it; empty where planar."""
        return "" if self.is_planar else self.vertical_axis.describe(self.responses)


def _motion_names(channels: Iterable[Channel]) -> str:
    return ", ".join(f"{MOTIONS[channel.name]} ({channel.name})" for channel in channels)


def report_quality(
    log: Log,
    needs: Requirements | None = None,
    upright: VerticalAxis | None = None,
    measured: Mapping[str, str] = MappingProxyType({}),
) -> QualityReport:
    """Return the quality report of a log; without a vehicle all velocities are required.

    ``upright`` is prior knowledge of its axes; ``measured`` gives the roles of columns
    that were read as commands but have names of measurements.
    """
    is_boat = needs is None and {*log.velocity_names} == _PLANAR_VELOCITIES and is_level(log)
    required_names = tuple("uvr") if is_boat else VELOCITIES
    needs = needs or Requirements(required_names, tuple(missing_channels(log, is_boat)))
    log_with_rates = log if log.attitude is None else rates_from_attitude(log)
    size = VehicleScale.from_log(log) if needs.length is None else VehicleScale(needs.length)
    groups = (group.prefer(needs.commands) for group in equivalent_commands(log))
    equivalent = [group for group in groups if group.omitted]
    excluded = {*measured, *(name for group in equivalent for name in group.omitted)}
    delays = tuple(item for item in estimate_delays(log_with_rates) if item.command not in excluded)
    channels, segments = _velocity_channels(log, size), tuple(_segment_facts(log))
    depths = [log.command(name) for name, role in measured.items() if role.endswith("depth")]
    upright = upright or VerticalAxis.combine(vertical_tests(log, depths[0] if depths else None))
    commands = tuple(_channel(log, name, "", log.command(name)) for name in log.command_names)
    issues = check_quality(log, needs.length)
    if needs.length is None:
        issues = tuple(map(_state_estimated_length, issues))
    issues = (*issues, *needs.suspicions, *misread_positions(measured))
    issues = (*issues, *wrong_frame(upright, issues), *(group.issue() for group in equivalent))
    issues = (*issues, *check_commands(log_with_rates, delays, needs.signs))
    options = tuple(find_current(log))
    missing = (*needs.missing, *constant_commands(log, needs.commands))
    if log.n < _MIN_SAMPLES:
        few = f"samples: {log.n} are too few to determine coefficients"
        missing = (*missing, f"{few}; record minutes at several hertz.")
    required = [channel for channel in channels if channel.name in needs.velocities]
    remarks = [
        *(() if any(issue.channel == "time" for issue in issues) else _jitter_remark(log)),
        *([PLANAR_REMARK] if is_boat else []),
        *_remarks(log, size, segments, required, commands),
        *(f"{each.evidence}: {each.remedy}." for each in options),
        *wrench_remark(log, delays),
        *needs.reservations,
    ]
    derived = _velocity_channels(log_with_rates, size)
    return QualityReport(
        source=log.source or "in memory",
        n_samples=log.n,
        duration=log.duration,
        segments=segments,
        velocities=channels,
        commands=commands,
        recorded=tuple(
            name for name in recorded_arrays(log) if name not in ("time", "velocity", "commands")
        ),
        delays=delays,
        missing=missing,
        issues=issues,
        remarks=tuple(remarks),
        identifiable=tuple(_identifiable(derived, needs.velocities, delays)),
        required=needs.velocities,
        vertical_axis=upright,
        responses=list_responses(delays),
        options=options,
    )


def _state_estimated_length(issue: QualityIssue) -> QualityIssue:
    """State that a length is an estimate where speeds exceed those plausible for it: it is minor.

    These are the only issues of single samples that no step of a mapping corrects.
    """
    if not issue.where or issue.fix is not None:
        return issue
    estimate = "a length estimated from the usual speed of the log at a Froude number of 0.25"
    remedy = f"pass `--vehicle`, which states the length; or {issue.remedy}"
    problem = f"{issue.problem}, {estimate}"
    return replace(issue, problem=problem, remedy=remedy, is_minor=True)


def _segment_facts(log: Log) -> Iterator[SegmentFacts]:
    for segment in log.segments:
        time = log.time[segment.start : segment.stop]
        steps = np.diff(time)
        ends = log.elapsed[[segment.start, segment.stop - 1]]
        numbers = (*ends, time[0], np.median(steps), steps.max())
        yield SegmentFacts(segment.name, len(time), *map(float, numbers))


def _velocity_channels(log: Log, size: VehicleScale) -> tuple[Channel, ...]:
    channels = []
    for name, values in recorded_velocities(log).items():
        channel = _channel(log, name, unit_of(name), values)
        noise = _NOISE_FACTOR * noise_std(values, log.bounds)
        negligible = max(size.negligible(channel.unit), noise)
        channels.append(replace(channel, excitation=channel.std / negligible))
    return tuple(channels)


def _channel(log: Log, name: str, unit: str, values: FloatArray) -> Channel:
    changed = np.diff(values) != 0.0
    changed[log.bounds[1:, 0] - 1] = False
    statistics = values.mean(), values.std(), values.min(), values.max()
    mean, std, low, high = map(float, statistics)
    return Channel(name, unit, mean, std, low, high, int(changed.sum()))


def _identifiable(
    channels: Iterable[Channel], required: Sequence[str], delays: Sequence[Delay]
) -> Iterator[str]:
    """Yield what can be identified: excited axes, and gains of commands with an effect."""
    known = {channel.name: channel for channel in channels}
    excited = [channel for channel in known.values() if channel.excitation >= _MIN_EXCITATION]
    if well := [delay for delay in excited if delay.name in required]:
        names = ", ".join(f"{MOTIONS[c.name]} (std {c.std:.2g} {c.unit})" for c in well)
        yield f"damping can be identified in {names}."
    if effective := [delay for delay in delays if delay.is_known]:
        names = ", ".join(f"{delay.command} ({MOTIONS[delay.velocity]})" for delay in effective)
        yield f"actuator gains can be estimated for {names}."


def _remarks(
    log: Log,
    size: VehicleScale,
    segments: Sequence[SegmentFacts],
    channels: Sequence[Channel],
    commands: Sequence[Channel],
) -> Iterator[str]:
    if log.duration < size.time_scale * _MIN_DURATION_S:
        yield f"only {log.duration:.3g} s were recorded; record minutes of manoeuvres."
    max_step = max(1.0, size.time_scale) * _MAX_STEP_S
    if max(segment.step for segment in segments) > max_step:
        rate = f"{2.5 / max_step:.2g} Hz"
        yield f"the sampling interval exceeds {max_step:.2g} s; sample at {rate} or more."
    for channel in channels:
        if channel.excitation < _MIN_EXCITATION:
            is_poor = channel.excitation < 1.0
            varies = f"{'hardly varies' if is_poor else 'varies little'} (std {channel.std:.2g}"
            yield (
                f"{channel.name} {varies} {channel.unit}): coefficients with {channel.name} will "
                f"be {'not determined' if is_poor else 'uncertain'}."
            )
    for name in (channel.name for channel in channels if channel.low * channel.high > 0.0):
        yield (
            f"{name} never changes sign: {name}^2 and {name}|{name}| are aliased, and so "
            f"are {name} and |{name}|."
        )
    if constant := [channel.name for channel in commands if channel.low == channel.high]:
        yield f"commands that never change: {' '.join(constant)}."
    if log.acceleration is None:
        yield "no recorded acceleration: least squares differentiates the velocities."


def _jitter_remark(log: Log) -> Iterator[str]:
    """Yield a remark if sampling intervals vary."""
    low, step, high = np.quantile(log.steps, (0.05, 0.5, 0.95)).tolist()
    if (jitter := (high - low) / 2 / step) > _MAX_JITTER:
        yield (
            f"the clock jitters by {jitter:.0%} of a step: {low:.2g} to {high:.2g} s. If these "
            "are arrival times, use the sensor time stamps (`time` in the mapping)."
        )

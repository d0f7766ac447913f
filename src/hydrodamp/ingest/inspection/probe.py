"""Inspection of an unknown recording: topics, roles, presets, draft mapping, quality report."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.basis.term import VELOCITIES
from hydrodamp.conditioning.consistency import QualityIssue
from hydrodamp.conditioning.pipeline import Step
from hydrodamp.conditioning.vertical_axis import VerticalAxis, vertical_tests
from hydrodamp.data.channels import unit_factor
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import HydrodampError, suppress_warnings
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.columns import TopicClock, find_clocks
from hydrodamp.ingest.inspection.draft import Draft, draft_from_preset, write_draft
from hydrodamp.ingest.inspection.frames import format_convention
from hydrodamp.ingest.inspection.names import NO_ROLE, words
from hydrodamp.ingest.inspection.preset_match import PresetMatch, match_presets
from hydrodamp.ingest.inspection.quality_report import QualityReport, Requirements, report_quality
from hydrodamp.ingest.inspection.roles import Roles, guess_roles
from hydrodamp.ingest.mapping import LogMapping, read_mapping
from hydrodamp.ingest.read import combine_recordings, is_canonical_recording

#: Name of a draft in messages.
DRAFT_NAME = "the draft"

#: Confidence [%] from which a log is made by the draft.
MIN_DRAFT_CONFIDENCE = 60

#: Remark on a table of canonical names that the draft reads otherwise.
WITHOUT_MAPPING = (
    "without a mapping the columns are taken in SI units and in forward-starboard-down axes: save "
    "the draft and pass it by `--mapping`."
)

_MOTION_GROUPS = ("time", "attitude", "velocity")

#: Returns the requirements of a vehicle on a log.
RequirementsOf = Callable[[Log], Requirements]


@dataclass(frozen=True)
class TopicFacts:
    """One topic of a recording in numbers."""

    name: str
    n: int
    n_fields: int
    rate: float | None
    jitter: float | None
    longest_gap: float | None
    start: float | None
    end: float | None
    backward: int
    units: tuple[tuple[str, str], ...]
    faults: tuple[str, ...]


def topic_facts(topic: Topic, clock: TopicClock | None) -> TopicFacts:
    """Return number, rate and gaps of the messages of a topic."""
    times = np.empty(0) if clock is None else clock.seconds[np.isfinite(clock.seconds)]
    steps = np.diff(times)
    rate, jitter, longest_gap = None, None, None
    if len(positive := steps[steps > 0.0]):
        low, step, high, longest_gap = np.quantile(positive, (0.05, 0.5, 0.95, 1.0)).tolist()
        rate, jitter = 1 / step, (high - low) / 2 / step
    start, end = (float(times[0]), float(times[-1])) if len(times) else (None, None)
    backward = int(np.count_nonzero(steps <= 0.0))
    units = tuple((name, unit) for name, unit in topic.units.items() if unit)
    faults = tuple(topic.faults.values())
    span = rate, jitter, longest_gap, start, end, backward
    return TopicFacts(topic.name, topic.n, len(topic.fields), *span, units, faults)


@dataclass(frozen=True, eq=False)
class Probe:
    """Contents of a recording and their guessed meaning.

    Attributes
    ----------
    source, format : str
        Of the recording.
    notes : tuple of str
        Notes of the reader.
    topics : tuple of TopicFacts
        Rates, gaps and spans.
    roles : Roles
        Guessed roles of its columns.
    without_role : tuple of str
        Numeric columns without a role.
    presets : tuple of PresetMatch
        Matching presets, the best first.
    draft : Draft
        A mapping file to start from.
    """

    source: str
    format: str
    notes: tuple[str, ...]
    topics: tuple[TopicFacts, ...]
    roles: Roles
    without_role: tuple[str, ...]
    presets: tuple[PresetMatch, ...]
    draft: Draft

    def mapping(self) -> LogMapping:
        """Return the draft as a mapping.

        Returns
        -------
        mapping : LogMapping
            As :func:`~hydrodamp.ingest.mapping.read_mapping` would read it from its file.

        Raises
        ------
        LogError
            If the draft is not a valid mapping.
        """
        return _parse_draft(self.draft)


def _parse_draft(draft: Draft) -> LogMapping:
    return LogMapping.from_dict(parse_yaml(draft.text, DRAFT_NAME), DRAFT_NAME)


def probe(recording: Recording, *others: Recording) -> Probe:
    """Inspect an unknown recording.

    Parameters
    ----------
    recording : Recording
        As read.
    *others : Recording
        Further recordings of the vehicle: a channel is constant only if constant in all.

    Returns
    -------
    probe : Probe
        Statistics, guesses with evidence, and a draft mapping.

    Examples
    --------
    >>> import numpy as np
    >>> from hydrodamp.data.recording import Topic
    >>> time = np.arange(0.0, 60.0, 0.1)
    >>> table = Topic(
    ...     "", None, {"t": time, "yaw_deg": 30 * np.sin(time), "yaw_rate": 30 * np.cos(time)}
    ... )
    >>> found = probe(Recording((table,), "turns.csv", "text in columns"))
    >>> found.roles.rates.unit
    'deg/s'
    """
    roles = guess_roles(recording, others)
    draft = write_draft(recording, roles)
    is_sure = draft.confidence >= MIN_DRAFT_CONFIDENCE
    presets = match_presets(recording, _parse_draft(draft) if is_sure else None)
    if presets and not presets[0].differences:
        draft = draft_from_preset(recording, presets[0].name)
    return Probe(
        recording.source,
        recording.format,
        recording.notes,
        tuple(topic_facts(topic, roles.clocks.get(topic.name)) for topic in recording.topics),
        roles,
        tuple(name for name, reason in roles.without_role.items() if reason == NO_ROLE),
        presets,
        draft,
    )


@dataclass(frozen=True)
class Inspection:
    """The log made of recordings and its quality report, or the reason why there is none."""

    mapping: str
    report: QualityReport | None
    notes: tuple[str, ...] = ()
    is_drafted: bool = False
    reason: str = ""
    log: Log | None = None

    @property
    def missing(self) -> tuple[str, ...]:
        """What the log lacks, or why there is no log."""
        if self.report is not None:
            return self.report.missing
        return (f"a log: {self.reason}\nCorrect the draft and pass it by --mapping.",)


def inspect(
    found: Probe,
    recordings: Sequence[Recording],
    mapping: LogMapping | str | None = None,
    needs: RequirementsOf | None = None,
) -> Inspection:
    """Make a log of probed recordings and report its quality."""

    def make_report(log: Log, origin: str, mapping: LogMapping | str | None = None) -> Inspection:
        read = read_mapping(mapping) if isinstance(mapping, str) else mapping
        roles, measured = found.roles, dict[str, str]()
        upright = _vertical_axis(log, roles, recordings[0].format, read)
        if read is None:
            positions = (guess for guess in roles.guesses if guess.role.startswith("position."))
            measured = {
                guess.column: guess.role for guess in positions if guess.column in log.command_names
            }
        report = report_quality(log, None if needs is None else needs(log), upright, measured)
        is_draft = read is not None and read.name == DRAFT_NAME
        unsure = roles.vertical_axis.warnings if is_draft and not report.is_planar else ()
        if is_draft and is_canonical:
            unsure = (WITHOUT_MAPPING, *unsure)
        report = replace(report, remarks=(*unsure, *report.remarks))
        report = omit_applied_steps(report, () if read is None else read.steps)
        return Inspection(origin, report, log.notes, is_draft, log=log)

    is_canonical = all(map(is_canonical_recording, recordings))
    if mapping is not None:
        name = mapping if isinstance(mapping, str) else mapping.name
        return make_report(
            combine_recordings(recordings, mapping), f"by the mapping {name}", mapping
        )
    reason = "the confidence in the roles of its columns is too low"
    choices: list[LogMapping | None] = [None] if is_canonical else []
    if found.draft.confidence >= MIN_DRAFT_CONFIDENCE:
        try:
            draft = found.mapping()
            choices.insert(int(_is_identity(draft, found.roles)), draft)
        except HydrodampError as error:
            reason = f"by the draft: {error}"
    for choice in choices:
        try:
            with suppress_warnings():
                log = combine_recordings(recordings, choice)
        except HydrodampError as error:
            reason = reason if choice is None else f"by the draft: {error}"
            continue
        return make_report(log, "" if choice is None else "by the draft", choice)
    return Inspection("", None, is_drafted=True, reason=reason)


def _is_identity(mapping: LogMapping, roles: Roles) -> bool:
    """Whether a mapping reads the columns of a canonical table as they are without it."""
    if mapping.frame != "FRD" or roles.rates.mirrored or roles.velocity.mirrored:
        return False
    entries = [entry for entry in mapping.entries if entry.group in _MOTION_GROUPS]
    recorded = {guess.column for guess in roles.guesses if guess.column in VELOCITIES}
    return recorded <= {entry.column for entry in entries} and all(
        source.model_dump(exclude_defaults=True, exclude={"unit"}) == {"column": entry.name}
        and (source.unit is None or unit_factor(source.unit) == 1.0)
        for entry in entries
        for source in entry.choices
    )


def omit_applied_steps(report: QualityReport, steps: Sequence[Step]) -> QualityReport:
    """Do not recommend steps that the mapping contains."""
    issues, missing, options = report.issues, report.missing, report.options
    for step in steps:
        name = str(getattr(getattr(step, "func", step), "__name__", ""))
        remedy = (
            f"`{name}` of the mapping does not remove it: split the log there by `segment`, or "
            "accept it"
        )
        issues = tuple(
            replace(issue, remedy=remedy, fix=None) if _step_of(issue) == name else issue
            for issue in issues
        )
        missing = tuple(
            item.replace(f"`{name}`", f"`{name}` (already applied)") for item in missing
        )
        options = tuple(issue for issue in options if _step_of(issue) != name)
    return replace(report, issues=issues, missing=missing, options=options)


def _step_of(issue: QualityIssue) -> str:
    """Return the name of the step that an issue proposes, empty without one."""
    fix = issue.fix
    is_step = fix is not None and fix.kind in ("step", "option")
    return fix.value.partition(":")[0] if fix is not None and is_step else ""


def _vertical_axis(
    log: Log, roles: Roles, format_name: str, mapping: LogMapping | None
) -> VerticalAxis | None:
    """Return the evidence on z, where FRD means that the log is forward-starboard-down.

    A draft follows the evidence in the file. For another mapping the convention of the format and a
    named depth count. None if only the log can be tested.
    """
    if mapping is None:
        return None
    if mapping.name == DRAFT_NAME:
        return replace(roles.vertical_axis, body="FRD")
    factor = 1.0 if mapping.frame == "FRD" else -1.0
    convention = [
        replace(test, log_odds=factor * test.log_odds) for test in format_convention(format_name)
    ]
    positions = [words(entry.column) for entry in mapping.entries if entry.group == "position"]
    has_depth = any("depth" in names for names in positions) and log.position is not None
    depth = log.position[:, 2] if has_depth and log.position is not None else None
    return VerticalAxis.combine((*convention, *vertical_tests(log, depth)))


def describe_join(recordings: Sequence[Recording]) -> str:
    """Suggest to join recordings whose clocks overlap and whose columns differ."""
    starts, ends, columns = [], [], []
    for recording in recordings:
        clocks = find_clocks(recording).values()
        times = [clock.seconds for clock in clocks if np.isfinite(clock.seconds).any()]
        if not times:
            return ""
        starts.append(min(float(np.nanmin(time)) for time in times))
        ends.append(max(float(np.nanmax(time)) for time in times))
        names = {name for topic in recording.topics for name in topic.fields}
        columns.append(names - {clock.column for clock in clocks})
    repeated = sum(map(len, columns)) - len(set().union(*columns))
    is_overlapping = len(columns) > 1 and max(starts) < min(ends)
    if not is_overlapping or 2 * repeated >= min(map(len, columns)):
        return ""
    return (
        f"`{'+'.join(item.source for item in recordings)}` reads these files as one recording: "
        "their clocks overlap. Separated by a blank, they are read as consecutive logs."
    )

"""Everything that can be said of an unknown recording, and the log that it makes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hydrodamp.conditioning.pipeline import Step
from hydrodamp.conditioning.quality_checks import QualityIssue
from hydrodamp.conditioning.vertical import AxisEvidence, VerticalAxis, vertical_tests
from hydrodamp.data.agreement import integrate_displacement, regress_channel
from hydrodamp.data.log import Log
from hydrodamp.data.recording import Recording, Topic
from hydrodamp.errors import HydrodampError, suppress_warnings
from hydrodamp.files import parse_yaml
from hydrodamp.ingest.inspection.columns import TopicClock, find_clocks
from hydrodamp.ingest.inspection.draft import Draft, draft_from_preset, write_draft
from hydrodamp.ingest.inspection.frames import format_convention
from hydrodamp.ingest.inspection.names import NO_ROLE, words
from hydrodamp.ingest.inspection.quality_report import QualityReport, Requirements, verdict
from hydrodamp.ingest.inspection.roles import Roles, guess_roles
from hydrodamp.ingest.mapping import LogMapping, presets, read_mapping
from hydrodamp.ingest.mapping.columns import find_columns
from hydrodamp.ingest.read import combine_recordings, is_canonical

#: How messages call a draft.
DRAFT_NAME = "the draft"

#: Confidence [%] from which a draft is worth making a log of.
MIN_DRAFT_CONFIDENCE = 60

_SCALE_TOLERANCE = 0.1  # of the way

#: Returns what a vehicle needs of a log.
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
    """Return how many messages a topic has, how often, with what gaps."""
    times = np.empty(0) if clock is None else clock.seconds[np.isfinite(clock.seconds)]
    steps = np.diff(times)
    pace: tuple[float | None, float | None, float | None] = (None, None, None)
    ends: tuple[float | None, float | None] = (None, None)
    if len(times):
        ends = float(times[0]), float(times[-1])
    if len(ahead := steps[steps > 0.0]):
        low, step, high, longest = np.quantile(ahead, (0.05, 0.5, 0.95, 1.0)).tolist()
        pace = 1 / step, (high - low) / 2 / step, longest
    return TopicFacts(
        topic.name,
        topic.n,
        len(topic.fields),
        *pace,
        *ends,
        int(np.count_nonzero(steps <= 0.0)),
        tuple((name, unit) for name, unit in topic.units.items() if unit),
        tuple(topic.faults.values()),
    )


@dataclass(frozen=True)
class PresetMatch:
    """A preset that has all its columns in a recording."""

    name: str
    channels: int


@dataclass(frozen=True, eq=False)
class Probe:
    """What a recording holds, and what it may mean.

    Attributes
    ----------
    source, format : str
        Of the recording.
    notes : tuple of str
        What the reader met.
    topics : tuple of TopicFacts
        Rates, gaps and spans.
    roles : Roles
        What its columns may be.
    without_role : tuple of str
        Columns of numbers of which nothing could be said.
    presets : tuple of Fitting
        Mappings of the package that fit, the best first.
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
            If too little was found to make a mapping of.
        """
        return LogMapping.from_dict(parse_yaml(self.draft.text, DRAFT_NAME), DRAFT_NAME)


def probe(recording: Recording, *others: Recording) -> Probe:
    """Look through a recording of which nothing is known.

    Parameters
    ----------
    recording : Recording
        As read.
    *others : Recording
        More of the same vehicle: a channel is at rest only where it rests in all of them.

    Returns
    -------
    probe : Probe
        Facts, guesses with their evidence, and a draft.

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
    roles, presets = guess_roles(recording, others), matching_presets(recording)
    drafted = write_draft(recording, roles)
    if drafted.confidence < MIN_DRAFT_CONFIDENCE and presets:
        drafted = draft_from_preset(recording, presets[0].name)
    return Probe(
        source=recording.source,
        format=recording.format,
        notes=recording.notes,
        topics=tuple(topic_facts(one, roles.clocks.get(one.name)) for one in recording.topics),
        roles=roles,
        without_role=tuple(name for name, why in roles.without_role.items() if why == NO_ROLE),
        presets=presets,
        draft=drafted,
    )


def matching_presets(recording: Recording) -> tuple[PresetMatch, ...]:
    """Return the presets that fit."""
    found = [one for name in presets() for one in _match_preset(name, recording)]
    return tuple(sorted(found, key=lambda one: -one.channels))


def _match_preset(name: str, recording: Recording) -> Iterator[PresetMatch]:
    mapping = read_mapping(name)
    timeless = [entry for entry in mapping.entries if entry.group != "time"]
    found, faults = find_columns(timeless, recording, name, mapping.topics)
    moves = [one.field for one in found if one.entry.group == "velocity" and one.topic]
    is_named = any(not field.startswith("column ") for field in moves)
    if not faults and moves and (is_named or _velocity_matches_position(mapping, recording)):
        yield PresetMatch(name, len(found))


def _velocity_matches_position(mapping: LogMapping, recording: Recording) -> bool:
    """Return whether velocities add up to the way of the position; any columns have places."""
    try:
        with suppress_warnings():
            log = mapping.log(recording)
    except HydrodampError:
        return False
    if log.attitude is None or log.position is None:
        return False
    way = integrate_displacement(log.attitude, log.position, log.bounds)
    both = regress_channel(log.time, log.bounds, log.velocity[:, :3], way)
    return both.is_consistent() and abs(both.scale - 1.0) < _SCALE_TOLERANCE


@dataclass(frozen=True)
class Inspection:
    """How a log was made of recordings and what the verdict is, or why there is no log."""

    mapping: str
    report: QualityReport | None
    notes: tuple[str, ...] = ()
    is_drafted: bool = False
    reason: str = ""

    @property
    def missing(self) -> tuple[str, ...]:
        """What the log lacks; without a log, the log itself."""
        if self.report is not None:
            return self.report.missing
        return (f"a log: {self.reason}\nCorrect the draft and ask again with --mapping.",)


def inspect(
    found: Probe,
    recordings: Sequence[Recording],
    mapping: str | None = None,
    needs: RequirementsOf | None = None,
) -> Inspection:
    """Make a log of recordings that were probed, and judge it."""

    def judged(made: str, mapping: LogMapping | str | None = None) -> Inspection:
        log = combine_recordings(recordings, mapping)
        read = read_mapping(mapping) if isinstance(mapping, str) else mapping
        roles = found.roles
        upright, measured = _vertical_axis(log, roles, recordings[0].format, read), dict[str, str]()
        if read is None:
            places = (one for one in roles.guesses if one.role.startswith("position."))
            measured = {one.column: one.role for one in places if one.column in log.command_names}
        its = verdict(log, None if needs is None else needs(log), upright, measured)
        unsure = roles.vertical_axis.warnings if isinstance(mapping, LogMapping) else ()
        its = replace(its, remarks=(*unsure, *its.remarks))
        its = omit_applied_steps(its, () if read is None else read.steps)
        return Inspection(made, its, log.notes)

    if mapping is not None:
        return judged(f"by the mapping {mapping}", mapping)
    tables = [one.topics[0] for one in recordings if [its.name for its in one.topics] == [""]]
    if len(tables) == len(recordings) and all(map(is_canonical, tables)):
        return judged("")
    reason = "the roles of its columns are too unsure to make a log of"
    if found.draft.confidence >= MIN_DRAFT_CONFIDENCE:
        try:
            with suppress_warnings():
                return replace(judged("by the draft", found.mapping()), is_drafted=True)
        except HydrodampError as error:
            reason = f"by the draft: {error}"
    return Inspection("", None, is_drafted=True, reason=reason)


def omit_applied_steps(found: QualityReport, steps: Sequence[Step]) -> QualityReport:
    """Advise no step that the mapping has."""
    named = [str(getattr(getattr(step, "func", step), "__name__", "")) for step in steps]

    def other(one: QualityIssue) -> QualityIssue:
        step = next((name for name in named if f"steps: [{name}" in one.remedy), None)
        cure = f"`{step}` in the mapping leaves it: cut the log there by `segment`, or leave it"
        return one if step is None else replace(one, remedy=cure)

    missing = found.missing
    for name in named:
        missing = tuple(one.replace(f"`{name}`", f"`{name}` (there already)") for one in missing)
    return replace(found, issues=tuple(map(other, found.issues)), missing=missing)


def _vertical_axis(
    log: Log, roles: Roles, form: str, mapping: LogMapping | None
) -> VerticalAxis | None:
    """Return the axes that signs speak for, where z down is what the log is in.

    A draft follows the signs in the file. Of another mapping the custom of the format counts, and
    a depth that it names. None where the log itself must say.
    """
    if mapping is None:
        return None
    if mapping.name == DRAFT_NAME:
        return replace(roles.vertical_axis, body="FRD")
    turn = 1.0 if mapping.frame == "FRD" else -1.0
    custom = (AxisEvidence(turn * sign.log_odds, sign.message) for sign in format_convention(form))
    has_depth = any(
        "depth" in words(one.column) for one in mapping.entries if one.group == "position"
    )
    depth = log.position[:, 2] if has_depth and log.position is not None else None
    return VerticalAxis.combine((*custom, *vertical_tests(log, depth)))


def describe_join(recordings: Sequence[Recording]) -> str:
    """Say how logs make one recording, where they are of one time and of different columns."""
    clocks = [
        [one for one in find_clocks(each).values() if np.isfinite(one.seconds).any()]
        for each in recordings
    ]
    if len(clocks) < 2 or not all(clocks):
        return ""
    first = max(min(float(np.nanmin(one.seconds)) for one in its) for its in clocks)
    last = min(max(float(np.nanmax(one.seconds)) for one in its) for its in clocks)
    own = [{name for topic in one.topics for name in topic.fields} for one in recordings]
    own = [names - {one.column for one in its} for names, its in zip(own, clocks, strict=True)]
    repeated = sum(map(len, own)) - len(set().union(*own))
    if first >= last or 2 * repeated >= min(map(len, own)):
        return ""
    return (
        f"`{'+'.join(one.source for one in recordings)}` makes one recording of these files: "
        "their clocks overlap. With a blank between them they are logs one after another."
    )

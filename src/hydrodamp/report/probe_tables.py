"""Tables and JSON document of `hydrodamp probe`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import yaml

from hydrodamp.errors import first_few
from hydrodamp.ingest.inspection.command_signs import MIN_LEAD_CONFIDENCE, MIN_LEAD_STEPS
from hydrodamp.ingest.inspection.delay import Delay
from hydrodamp.ingest.inspection.probe import MIN_DRAFT_CONFIDENCE, Inspection, Probe
from hydrodamp.ingest.inspection.quality_report import UNUSABLE, QualityReport
from hydrodamp.report.table import Table

#: Listed topics and segments, and channels that a preset does not read.
MAX_LISTED, MAX_DIFFERENCES = 25, 6

_COLUMNS = yaml.safe_load(Path(__file__).with_name("probe_columns.yaml").read_text("utf-8"))
_DRAFT_HEADER = "draft with the confidence of each line (--draft FILE saves it)"
_WORLD_NAMES = {"NED": "north-east-down", "NWU": "z up (NWU)", "ENU": "east-north-up"}


def probe_tables(found: Probe, judged: Inspection) -> Iterator[Table]:
    """Yield the verdict on a probed recording and its log, and their tables."""
    verdict = UNUSABLE if judged.report is None else judged.report.verdict
    yield Table("", (), (), (f"Verdict: {verdict}",))
    if judged.mapping or judged.is_drafted:
        yield _topic_table(found)
    if judged.is_drafted:
        yield _draft_table(found)
    if judged.report is None:
        notes = [line for each in judged.missing for line in f"missing: {each}".split("\n")]
        notes += [f"remark: {each}" for each in found.roles.vertical_axis.warnings]
        yield Table("No log", (), (), tuple(notes))
        return
    notes_made = (f"Made {judged.mapping}.",) if judged.mapping else ()
    yield _segment_table(judged.report, (*notes_made, *judged.notes))
    if judged.report.delays:
        step = max(segment.step for segment in judged.report.segments)
        yield _delay_table(judged.report.delays, step)
    yield _column_table(judged.report)


def probe_document(found: Probe, judged: Inspection) -> dict[str, Any]:
    """Return what ``probe --json`` prints."""
    roles, verdict = found.roles, judged.report
    absent = ("delays", "issues", "warnings", "remarks", "identifiable")
    facts: dict[str, Any] = {**dict.fromkeys(absent, ()), "verdict": UNUSABLE, "fit": False}
    if verdict is not None:
        facts = {**asdict(verdict), "warnings": verdict.warnings, "frame": verdict.frame}
        facts |= {"verdict": verdict.verdict, "fit": verdict.is_usable}
    return {
        **facts,
        "missing": judged.missing,
        "log": judged.mapping or (None if verdict is None else "canonical"),
        "log_notes": judged.notes,
        **{key: getattr(found, key) for key in ("source", "format", "notes", "without_role")},
        "topics": [{**asdict(item), "units": dict(item.units)} for item in found.topics],
        "guesses": [{**asdict(item), "role": item.role or None} for item in roles.guesses],
        "axes": {
            **asdict(roles.vertical_axis),
            "world": roles.world,
            "velocity": {True: "earth-fixed", False: "body", None: None}[_is_earth_fixed(found)],
            "velocity_mirrored": roles.velocity.mirrored,
            "rates_mirrored": roles.rates.mirrored,
            "rate_unit": roles.rates.unit,
        },
        "presets": [asdict(item) for item in found.presets],
        "draft": found.draft.text,
        "draft_confidence": found.draft.confidence,
    }


def _topic_table(found: Probe) -> Table:
    notes = [*_omitted_note(len(found.topics), "topics")]
    notes += [f"Reader: {note}." for note in found.notes]
    for topic in found.topics:
        name = topic.name or "table"
        notes += [f"{name}: {fault}" for fault in topic.faults]
        if topic.start is None and topic.n:
            notes.append(f"{name}: no clock: no column increases.")
        if topic.backward:
            notes.append(f"{name}: {topic.backward} times the clock repeats or runs backwards.")
    units = sorted({unit for topic in found.topics for _, unit in topic.units})
    notes.append(f"Units the file states: {', '.join(units) or 'none'}.")
    title = f"{found.source}: {found.format}"
    return Table.of_items(title, found.topics[:MAX_LISTED], _COLUMNS["topics"], notes)


def _omitted_note(count: int, what: str) -> tuple[str, ...]:
    return (f"and {count - MAX_LISTED} more {what}",) if count > MAX_LISTED else ()


def _draft_table(found: Probe) -> Table:
    lines = tuple((line,) for line in found.draft.text.rstrip("\n").split("\n"))
    notes = [*_axes_notes(found), *_preset_notes(found)]
    if found.draft.confidence < MIN_DRAFT_CONFIDENCE:
        notes.append(
            f"The confidence in the draft is too low ({found.draft.confidence} %): correct it, "
            "then pass it by --mapping."
        )
    return Table.of_words("Draft mapping", (_DRAFT_HEADER,), "l", lines, notes)


def _axes_notes(found: Probe) -> Iterator[str]:
    """Yield the axes of the recording, with the evidence."""
    roles, velocity = found.roles, found.roles.velocity
    upright = roles.vertical_axis
    yield f"Axes: body {upright.body} over {_WORLD_NAMES[roles.world]}, {upright.confidence} %."
    for sign in upright.evidence:
        yield f"- for {'FRD' if sign.log_odds > 0 else 'FLU'}: {sign.message}."
    if (earth := _is_earth_fixed(found)) is not None:
        kind = "earth-fixed" if earth else "along body axes"
        evidence = (
            f", by regression on the position (correlation {velocity.regression.correlation:.3f};"
            f" alternative {velocity.alternative.correlation:.2f})"
        )
        yield f"Velocities are {kind}{evidence if velocity.earth_fixed is not None else ''}."
    if roles.rates.unit:
        axes = ", ".join(f"{name} {likeness:.2f}" for name, likeness in roles.rates.axes)
        yield f"Rates are consistent with the attitude, in {roles.rates.unit} (correlation {axes})."
    for mirrored, channels in ((roles.rates.mirrored, "Rates"), (velocity.mirrored, "Velocities")):
        if mirrored:
            yield f"{channels} are in other axes than the attitude: y and z have opposite signs."


def _is_earth_fixed(found: Probe) -> bool | None:
    roles = found.roles
    if roles.best("velocity.north") or roles.best("velocity.east"):
        return True
    return roles.velocity.earth_fixed


def _preset_notes(found: Probe) -> Iterator[str]:
    for preset in found.presets:
        channels = " ".join(first_few([*preset.differences], MAX_DIFFERENCES, "channels"))
        reason = f"; the draft does not extend it, since they differ in {channels}"
        option = f"`--mapping {preset.name}`{reason if channels else ''}"
        yield f"Preset `{preset.name}` matches {preset.channels} channels ({option})."
    yield from () if found.presets else ("No shipped preset matches.",)


def _delay_table(delays: tuple[Delay, ...], step: float) -> Table:
    notes = [
        "sign: direction of the response. explains: share of the variance of the acceleration "
        "that the command explains in addition to the velocities."
    ]
    early = [
        item.command
        for item in delays
        if item.confidence >= MIN_LEAD_CONFIDENCE
        and item.seconds + (item.standard_deviation or 0.0) < -MIN_LEAD_STEPS * step
    ]
    if early:
        notes.append(
            f"The response precedes {' '.join(early)}: the clocks differ, the velocity was "
            "smoothed by a zero-phase filter, or the command follows the motion in a closed loop."
        )
    title = "Delay between commands and velocities (dead time plus lag)"
    return Table.of_items(title, delays, _COLUMNS["delays"], notes)


def _segment_table(found: QualityReport, notes: tuple[str, ...]) -> Table:
    n, segments = len(found.segments), found.segments[:MAX_LISTED]
    span = f"{found.n_samples} samples, {found.duration:.1f} s"
    title = f"{found.source}: {span} in {n} segment{'s' if n != 1 else ''}"
    notes = (*_omitted_note(n, "segments"), *notes)
    return Table.of_items(title, segments, _COLUMNS["segments"], notes)


def _column_table(judged: QualityReport) -> Table:
    notes = (
        f"Also recorded: {', '.join(judged.recorded) or 'nothing else'}.",
        *(f"missing: {message}" for message in judged.missing),
        *([f"frame: {judged.frame}"] if judged.frame else []),
        *judged.warnings,
        *(f"remark: {message}" for message in judged.remarks),
        *(f"identifiable: {message}" for message in judged.identifiable),
    )
    channels = (*judged.velocities, *judged.commands)
    return Table.of_items("Columns", channels, _COLUMNS["channels"], notes)

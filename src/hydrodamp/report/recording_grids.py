"""What was probed of a recording, as tables and as a document."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict

from hydrodamp.ingest.probing.delay import Delay
from hydrodamp.ingest.probing.draft import LEAST
from hydrodamp.ingest.probing.probe import SUFFICES, Probe
from hydrodamp.ingest.probing.shipped import Fitting
from hydrodamp.ingest.probing.topics import TopicFacts
from hydrodamp.report.document import Document
from hydrodamp.report.grid import Grid
from hydrodamp.report.numbers import NOTHING

TOPICS = 25
"""Topics that are spelt out."""

_EARLY = -0.05  # s
_SILENT = 12
_SURE = 90  # %, below which axes must be checked
_SAVED = "draft, and how sure each line is (--draft FILE saves it)"
_MIRROR = (
    "Motion alone cannot tell FRD over NED from FLU over a world with z up: each is the other "
    "turned half about the forward axis. An accelerometer, a depth or whoever wrote the log can."
)


def delay_grid(found: tuple[Delay, ...]) -> Grid:
    """Return the delays between commands and velocities as a table."""
    early = [one.command for one in found if one.seconds + (one.spread or 0.0) < _EARLY]
    notes = ["Explains: share of the growth of the velocity, beyond what velocities explain."]
    if early:
        notes.append(
            f"The answer comes before {' '.join(early)}: the clocks differ, a filter without phase "
            "smoothed the velocity, or a loop is closed and the command follows the motion."
        )
    return Grid(
        title="Delay between commands and what they move (dead time and lag together)",
        header=("command", "moves", "delay [s]", "± [s]", "explains", "sure"),
        rows=tuple(
            (
                one.command,
                f"{'+' if one.sense > 0 else '-'}{one.velocity}",
                f"{one.seconds:.2f}",
                NOTHING if one.spread is None else f"{one.spread:.2f}",
                f"{100 * one.share:.0f} %",
                f"{one.confidence} %",
            )
            for one in found
        ),
        align="llrrrr",
        notes=tuple(notes),
    )


def recording_document(found: Probe) -> Document:
    """Return what ``probe --json`` tells of a recording."""
    roles = found.roles
    return {
        "format": found.format,
        "notes": list(found.notes),
        "topics": [
            {**asdict(topic), "units": dict(topic.units), "faults": list(topic.faults)}
            for topic in found.topics
        ],
        "guesses": [
            {**asdict(one), "role": one.role or None, "evidence": list(one.evidence)}
            for one in roles.guesses
        ],
        "without_role": list(found.without_role),
        "axes": {
            "body": roles.upright.body,
            "world": roles.world,
            "confidence": roles.upright.confidence,
            "evidence": [sign.told for sign in roles.upright.signs],
            "velocity": {True: "earth-fixed", False: "body", None: None}[_earth_fixed(found)],
            "velocity_mirrored": roles.way.mirrored,
            "rates_mirrored": roles.rates.mirrored,
            "rate_unit": roles.rates.unit,
        },
        "presets": [_preset_document(one) for one in found.presets],
        "draft": found.draft.text,
        "draft_confidence": found.draft.confidence,
    }


def _preset_document(one: Fitting) -> Document:
    return {**asdict(one), "topics": dict(one.topics)}


def topics_grid(found: Probe) -> Grid:
    """Return the topics of a recording as a table."""
    notes = [f"Reader: {note}." for note in found.notes]
    for topic in found.topics:
        notes += [f"{topic.name or 'table'}: {fault}" for fault in topic.faults]
        if topic.start is None and topic.n:
            notes.append(f"{topic.name or 'table'}: no column increases; there is no clock.")
        if topic.backward:
            stand = f"{topic.backward} times the clock stands still or goes back"
            notes.append(f"{topic.name or 'table'}: {stand}.")
    units = sorted({unit for topic in found.topics for _, unit in topic.units})
    notes.append(f"Units the file states: {', '.join(units) or 'none'}.")
    more = len(found.topics) - TOPICS
    return Grid(
        title=f"{found.source}: {found.format}",
        header=(
            "topic",
            "messages",
            "fields",
            "rate [Hz]",
            "jitter",
            "gap [s]",
            "from [s]",
            "to [s]",
        ),
        rows=tuple(_topic(topic) for topic in found.topics[:TOPICS]),
        align="lrrrrrrr",
        notes=((f"and {more} more topics",) if more > 0 else ()) + tuple(notes),
    )


def _topic(topic: TopicFacts) -> tuple[str, ...]:
    def word(value: float | None, form: str) -> str:
        return NOTHING if value is None else format(value, form)

    return (
        topic.name or "(table)",
        str(topic.n),
        str(topic.n_fields),
        word(topic.rate, ".3g"),
        NOTHING if topic.jitter is None else f"{100 * topic.jitter:.0f} %",
        word(topic.longest_gap, ".3g"),
        word(topic.start, ".2f"),
        word(topic.end, ".2f"),
    )


def _earth_fixed(found: Probe) -> bool | None:
    roles = found.roles
    if roles.chosen("velocity.north") or roles.chosen("velocity.east"):
        return True
    return roles.way.earth_fixed


def _seen(found: Probe) -> Iterator[str]:
    roles = found.roles
    over = {"NED": "north-east-down", "NWU": "z up (NWU)", "ENU": "east-north-up"}[roles.world]
    yield f"Axes: body {roles.upright.body} over {over}, {roles.upright.confidence} %."
    yield from (
        f"- for {'FRD' if sign.weight > 0 else 'FLU'}: {sign.told}." for sign in roles.upright.signs
    )
    if roles.upright.confidence < _SURE:
        yield _MIRROR
    way = roles.way
    if way.earth_fixed is not None:
        turned = "as they stand" if way.earth_fixed else "turned by the attitude"
        kind = "earth-fixed" if way.earth_fixed else "along body axes"
        yield (
            f"Velocities are {kind}: {turned} they make the way of the position (correlation "
            f"{way.agreement.correlation:.3f}; otherwise {way.other.correlation:.2f} at best)."
        )
    elif _earth_fixed(found):
        yield "Velocities are earth-fixed: they are turned into the body by the attitude."
    if roles.rates.unit:
        axes = ", ".join(f"{name} {likeness:.2f}" for name, likeness in roles.rates.axes)
        yield f"Rates turn as the attitude does, in {roles.rates.unit} (correlation {axes})."
    for mirrored, what in ((roles.rates.mirrored, "Rates"), (way.mirrored, "Velocities")):
        if mirrored:
            yield f"{what} are in axes of the other kind than the attitude: y and z opposite."
    unsure = [one for one in roles.guesses if one.role and one.confidence < LEAST]
    if unsure:
        told = ", ".join(
            f"{one.column} ({one.role}, {one.confidence} %)" for one in unsure[:_SILENT]
        )
        yield f"Too unsure for the draft: {told}."
    if found.without_role:
        more = len(found.without_role) - _SILENT
        tail = f" and {more} more" if more > 0 else ""
        yield f"No role found for: {', '.join(found.without_role[:_SILENT])}{tail}."


def draft_grid(found: Probe) -> Grid:
    """Return the draft of a mapping as a table."""
    lines = tuple((line,) for line in found.draft.text.rstrip("\n").split("\n"))
    notes = [*_seen(found)]
    for one in found.presets:
        topics = ", ".join(f"{name}: {topic}" for name, topic in one.topics)
        extra = f", given `topics: {{{topics}}}` in a mapping that extends it" if topics else ""
        notes.append(
            f"Preset `{one.name}` fits{extra}: {one.channels} channels found, "
            f"{one.agreeing} of {one.guessed} as guessed."
        )
    if not found.presets:
        notes.append("No shipped preset fits.")
    if found.draft.confidence < SUFFICES:
        notes.append(
            f"The draft is too unsure ({found.draft.confidence} %) to make a log of: put it right, "
            "then ask again with --mapping."
        )
    return Grid("What its columns may be, as a mapping", (_SAVED,), lines, "l", tuple(notes))

"""Line of a draft that names the clocks of the topics in use."""

from __future__ import annotations

from collections.abc import Sequence

from hydrodamp.data.recording import Recording
from hydrodamp.ingest.inspection.columns import TopicClock
from hydrodamp.ingest.inspection.draft_names import format_source, quote_name
from hydrodamp.ingest.inspection.guess import Guess
from hydrodamp.ingest.inspection.roles import Roles


def time_line(recording: Recording, roles: Roles, used: Sequence[Guess]) -> str:
    """Return the clocks of the topics in use, sensor stamps before arrival times."""
    if not roles.clocks:
        return "time: {rate: HERTZ}    # no column is a clock: enter the sampling rate"
    topics = [guess.topic for guess in used if guess.topic in roles.clocks] or roles.clocks
    clocks = {name: roles.clocks[name] for name in topics}
    choices: dict[str, str] = {}
    for topic, clock in sorted(clocks.items(), key=lambda pair: pair[1].column is None):
        is_shared = any(
            clock.column in recording.topic(name).fields and candidate.column != clock.column
            for name, candidate in clocks.items()
        )
        is_stated = clock.column is not None or clock.rate is not None
        remark = f"    # {clock.confidence} %: {clock.evidence}" if is_stated else ""
        choices.setdefault(_format_clock(topic if is_shared else "", clock), remark)
    stamped = [name for name, clock in clocks.items() if clock.column]
    if any(recording.topic(name).time is not None for name in stamped):
        choices.setdefault("recorded", "")
    first, *alternatives = choices
    text = f"[{', '.join(choices)}]" if alternatives else first
    return f"time: {text}{choices[first]}"


def _format_clock(topic: str, clock: TopicClock) -> str:
    """Return a clock in the syntax of mappings."""
    if clock.rate is not None:
        return f"{{rate: {clock.rate:g}}}"
    if clock.column is None:
        return "recorded"
    stem = f"{topic}." if topic else ""
    column = quote_name(stem + clock.column)
    plus = ", ".join(f"{quote_name(stem + name)}: {scale!r}" for name, scale in clock.plus.items())
    is_plain = clock.unit == "s" and clock.stated in ("", "s")
    items = {
        "unit": None if is_plain else clock.unit,
        "offset": repr(clock.offset) if clock.offset else None,
        "plus": f"{{{plus}}}" if plus else None,
    }
    return format_source(column, items)

"""What is odd in a recording of any format, told in its notes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from hydrodamp.data.recording import Recording, Topic

_HUGE = 1e300
_LATE = 0.1  # of the time that all topics span
_NAMESPACE = re.compile(r"/[^/]+/(.*)")


def noted(recording: Recording) -> Recording:
    """Return a recording with notes on what is odd in it."""
    found = [note for topic in recording.topics for note in _topic_notes(topic)]
    found += [*_span_notes(recording), *_twin_notes(recording)]
    return replace(recording, notes=(*recording.notes, *found)) if found else recording


def _topic_notes(topic: Topic) -> Iterator[str]:
    head = f"topic `{topic.name}`: " if topic.name else ""
    for name, values in topic.fields.items():
        # One pass finds most columns clean; only the odd ones are looked at again.
        if len(values) and not (values.min() > -_HUGE and values.max() < _HUGE):
            rows = np.flatnonzero(np.abs(values) >= _HUGE)
            if len(rows):
                what = f"{head}`{name}` is infinite or beyond {_HUGE:g} {_times(len(rows))}"
                yield f"{what}, first in {_place(topic, int(rows[0]))}"
    if topic.time is not None:
        back = np.flatnonzero(np.diff(topic.time) < 0) + 1
        if len(back):
            before, after = topic.time[back[0] - 1 : back[0] + 1]
            yield (
                f"{head}its clock runs back {_times(len(back))}, first from {before:.10g} s to"
                f" {after:.10g} s in {_place(topic, int(back[0]))}"
            )
    if topic.n == 1:
        yield f"topic `{topic.name}` holds one message only" if topic.name else "there is one row"


def _span_notes(recording: Recording) -> Iterator[str]:
    """Name topics that miss much of the time which all of them span."""
    spans = recording.spans()
    if len(spans) < 2:
        return
    begin = min(first for first, _ in spans.values())
    end = max(last for _, last in spans.values())
    for name, (first, last) in spans.items():
        if recording.topic(name).n == 1:
            continue
        if first - begin > _LATE * (end - begin):
            yield f"topic `{name}` begins {first - begin:.4g} s after the first one"
        if end - last > _LATE * (end - begin):
            yield f"topic `{name}` ends {end - last:.4g} s before the last one"


def _twin_notes(recording: Recording) -> Iterator[str]:
    """Name topics that differ in the namespace only."""
    known: dict[tuple[str, frozenset[str]], str] = {}
    for topic in recording.topics:
        named = _NAMESPACE.match(topic.name)
        if named is None:
            continue
        other = known.setdefault((named[1], frozenset(topic.fields)), topic.name)
        if other != topic.name:
            yield (
                f"topics `{other}` and `{topic.name}` hold the same fields: two sensors, or two"
                " vehicles in one recording; map one of them"
            )


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def _place(topic: Topic, row: int) -> str:
    line = f" (line {topic.lines[row]})" if len(topic.lines) else ""
    return f"row {row + 1}{line}"

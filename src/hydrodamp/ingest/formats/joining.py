"""Topics of one name in files that follow one another, such as the parts of a split bag."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.data.recording import Topic
from hydrodamp.errors import LogError


def joined(topics: Iterable[Topic], source: str) -> tuple[Topic, ...]:
    """Join topics of one name, in the order of their clocks."""
    groups: dict[str, list[Topic]] = {}
    for topic in topics:
        groups.setdefault(topic.name, []).append(topic)
    faults = [fault for name, group in groups.items() if (fault := _fault(name, group))]
    if faults:
        raise LogError(faults, source=source)
    return tuple(_whole(group) for group in groups.values())


def _fault(name: str, group: Sequence[Topic]) -> str:
    """Say why topics of one name are not parts of one."""
    if len(group) == 1:
        return ""
    head = f"{len(group)} files hold a topic `{name}`"
    if any(topic.time is None for topic in group):
        return f"{head} without a clock of its own. Read each file by itself"
    ordered = [_clock(topic) for topic in sorted(group, key=_begin)]
    for before, after in pairwise(ordered):
        if len(before) and len(after) and after[0] <= before[-1]:
            return (
                f"{head}, and their times overlap ({after[0]:.10g} s to {before[-1]:.10g} s): these"
                " are different vehicles or dives. Read each file by itself"
            )
    return ""


def _clock(topic: Topic) -> FloatArray:
    return np.empty(0) if topic.time is None else topic.time


def _begin(topic: Topic) -> float:
    clock = _clock(topic)
    return float(clock[0]) if len(clock) else np.inf


def _whole(group: Sequence[Topic]) -> Topic:
    if len(group) == 1:
        return group[0]
    parts = sorted(group, key=_begin)
    faults = {name: fault for part in parts for name, fault in part.faults.items()}
    named = dict.fromkeys(name for part in parts for name in part.fields)
    fields = [name for name in named if name not in faults]
    texts = dict.fromkeys(name for part in parts for name in part.texts)
    return Topic(
        parts[0].name,
        np.concatenate([_clock(part) for part in parts]),
        {
            name: np.concatenate([part.fields.get(name, np.full(part.n, np.nan)) for part in parts])
            for name in fields
        },
        {
            name: tuple(word for part in parts for word in part.texts.get(name, ("",) * part.n))
            for name in texts
            if name not in fields
        },
        {name: unit for part in parts for name, unit in part.units.items()},
        faults,
    )

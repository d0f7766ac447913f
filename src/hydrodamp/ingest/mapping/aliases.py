"""Names that a mapping gives to topics, and the topics of a recording they stand for."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping

from hydrodamp.data.recording import Recording
from hydrodamp.ingest.mapping.entries import Entry, Source

Topics = tuple[tuple[str, tuple[str, ...]], ...]
"""For every name the topics it may stand for, the first that a recording has."""


def meant(topics: Topics, recording: Recording) -> dict[str, str]:
    """Return the topic of a recording that each name stands for."""
    known = {topic.name for topic in recording.topics}
    there = {name: [one for one in choices if one in known] for name, choices in topics}
    return {name: found[0] for name, found in there.items() if found}


def renamed(column: str, names: Mapping[str, str]) -> str:
    """Return a column with the name of its topic replaced by the topic."""
    for name, topic in names.items():
        if column.startswith(f"{name}."):
            return topic + column.removeprefix(name)
    return column


def resolved(entries: Iterable[Entry], names: Mapping[str, str]) -> list[Entry]:
    """Return entries that name the topics of a recording."""
    return [
        dataclasses.replace(entry, choices=tuple(_source(one, names) for one in entry.choices))
        for entry in entries
    ]


def _source(source: Source, names: Mapping[str, str]) -> Source:
    return dataclasses.replace(
        source,
        column=renamed(source.column, names),
        where=tuple((renamed(name, names), wanted) for name, wanted in source.where),
        plus=tuple((renamed(name, names), weight) for name, weight in source.plus),
    )

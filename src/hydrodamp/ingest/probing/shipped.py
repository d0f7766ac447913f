"""Presets that come with the package and fit a recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from hydrodamp.data.recording import Recording
from hydrodamp.ingest.mapping import LogMapping, presets, read_mapping
from hydrodamp.ingest.mapping.finding import Found, find
from hydrodamp.ingest.probing.roles import Roles

_AGREES = 0.75  # share of the channels with a guess
_SURE = 60  # %, a guess that may speak against a preset


@dataclass(frozen=True)
class Fitting:
    """A preset that has all its columns in a recording."""

    name: str
    channels: int
    agreeing: int
    guessed: int
    topics: tuple[tuple[str, str], ...] = ()


def fitting(recording: Recording, roles: Roles) -> tuple[Fitting, ...]:
    """Return the presets that fit."""
    found = [one for name in presets() for one in _fits(name, recording, roles)]
    return tuple(sorted(found, key=lambda one: -one.agreeing))


def _fits(name: str, recording: Recording, roles: Roles) -> Iterator[Fitting]:
    mapping = read_mapping(name)
    changed = dict(_other_topics(mapping, recording))
    topics = mapping.topics | {one: (topic,) for one, topic in changed.items()}
    timeless = [entry for entry in mapping.entries if entry.group != "time"]
    found, faults = find(timeless, recording, name, topics)
    if faults or not any(one.entry.group == "velocity" and one.topic for one in found):
        return
    guesses = {one.column: one for one in roles.guesses if one.confidence >= _SURE and one.chosen}
    told = [one for one in found if one.source.column in guesses]
    agreeing = sum(_agrees(one, guesses[one.source.column].role) for one in told)
    if told and agreeing >= _AGREES * len(told):
        yield Fitting(name, len(found), agreeing, len(told), tuple(changed.items()))


def _agrees(found: Found, role: str) -> bool:
    group, _, channel = role.partition(".")
    if found.entry.group == "commands":
        return group == found.entry.group
    same = {"up": "down", "depth": "down", "heading": "yaw"}
    names = (same.get(channel, channel), same.get(found.entry.name, found.entry.name))
    return group == found.entry.group and names[0] == names[1]


def _other_topics(mapping: LogMapping, recording: Recording) -> Iterator[tuple[str, str]]:
    """Find the one topic with all the fields that a name of a preset needs."""
    known = {topic.name for topic in recording.topics}
    for name, choices in mapping.topics.items():
        if known & set(choices):
            continue
        needed = {
            entry.choices[0].column.removeprefix(f"{name}.")
            for entry in mapping.entries
            if entry.choices[0].column.startswith(f"{name}.") and not entry.choices[0].optional
        }
        able = [topic.name for topic in recording.topics if needed and needed <= set(topic.fields)]
        if len(able) == 1 and able[0]:
            yield name, able[0]

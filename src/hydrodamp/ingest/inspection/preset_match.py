"""Presets all of whose columns are in a recording, and what a draft reads otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hydrodamp.data.channel_regression import integrate_displacement, regress_channel
from hydrodamp.data.recording import Recording
from hydrodamp.errors import HydrodampError, suppress_warnings
from hydrodamp.ingest.mapping import LogMapping, presets, read_mapping
from hydrodamp.ingest.mapping.columns import FoundColumn, find_columns

_SCALE_TOLERANCE = 0.1  # relative error of the integrated velocity


@dataclass(frozen=True)
class PresetMatch:
    """A preset all of whose columns are in a recording.

    ``differences`` names what a draft reads otherwise or in addition: such a draft does not extend
    the preset.
    """

    name: str
    channels: int
    differences: tuple[str, ...] = ()


def match_presets(recording: Recording, draft: LogMapping | None) -> tuple[PresetMatch, ...]:
    """Return the matching presets, those that read all that the draft reads first."""
    matches = [match for name in presets() for match in _match_preset(name, recording, draft)]
    return tuple(sorted(matches, key=lambda match: (bool(match.differences), -match.channels)))


def _match_preset(
    name: str, recording: Recording, draft: LogMapping | None
) -> Iterator[PresetMatch]:
    mapping = read_mapping(name)
    columns, faults = _find_channels(mapping, recording)
    fields = [item.field for item in columns if item.entry.group == "velocity" and item.topic]
    if faults or not fields:
        return
    is_named = any(not field.startswith("column ") for field in fields)
    if is_named or _velocity_matches_position(mapping, recording):
        differences = () if draft is None else _differences(draft, mapping, recording)
        yield PresetMatch(name, len(columns), tuple(differences))


def _find_channels(
    mapping: LogMapping, recording: Recording
) -> tuple[list[FoundColumn], list[str]]:
    """Return the columns of all channels but the time, and the faults of the others."""
    timeless = [entry for entry in mapping.entries if entry.group != "time"]
    return find_columns(timeless, recording, mapping.name, mapping.topics)


def _differences(draft: LogMapping, preset: LogMapping, recording: Recording) -> Iterator[str]:
    """Yield what a preset does not read as a draft: frame, time, channels."""
    if draft.frame != preset.frame:
        yield "frame"
    clocks = [[it.choices for it in each.entries if it.group == "time"] for each in (draft, preset)]
    if clocks[0] != clocks[1]:
        yield "time"
    known = [item for item in _find_channels(preset, recording)[0] if item.topic]
    commands = {_location(item) for item in known if item.entry.group == "commands"}
    channels = {item.entry.channel: item for item in known}
    for item in _find_channels(draft, recording)[0]:
        twin, is_command = channels.get(item.entry.channel), item.entry.group == "commands"
        is_known = _location(item) in commands if is_command else twin and _is_same(item, twin)
        if item.topic and not is_known:
            yield item.entry.channel


def _location(item: FoundColumn) -> tuple[str, str]:
    return (item.topic.name if item.topic else "", item.field)


def _is_same(first: FoundColumn, second: FoundColumn) -> bool:
    """Return whether two channels have the same column, unit and sign."""
    same_column = _location(first) == _location(second)
    return same_column and np.allclose(first.values(), second.values(), equal_nan=True)


def _velocity_matches_position(mapping: LogMapping, recording: Recording) -> bool:
    """Return whether velocities integrate to the position."""
    try:
        with suppress_warnings():
            log = mapping.log(recording)
    except HydrodampError:
        return False
    if log.attitude is None or log.position is None:
        return False
    displacement = integrate_displacement(log.attitude, log.position, log.bounds)
    regression = regress_channel(log.time, log.bounds, log.velocity[:, :3], displacement)
    return regression.is_consistent() and abs(regression.scale - 1.0) < _SCALE_TOLERANCE

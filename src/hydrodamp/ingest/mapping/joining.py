"""From a recording to a record: channels found, clocks set right, axes turned."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.data.canonical import record_of_columns
from hydrodamp.data.record import Record, name_after
from hydrodamp.data.recording import Recording
from hydrodamp.errors import ClockWarning, LogError
from hydrodamp.ingest.clock.met import Met, Oddity
from hydrodamp.ingest.mapping.aliases import meant, renamed, resolved
from hydrodamp.ingest.mapping.assembling import Assembly
from hydrodamp.ingest.mapping.entries import RECORDED, Entry, Source
from hydrodamp.ingest.mapping.feeds import Feeds, feeds_of
from hydrodamp.ingest.mapping.finding import Found, find, locate
from hydrodamp.ingest.mapping.sampler import Sampler

if TYPE_CHECKING:
    from hydrodamp.ingest.mapping.log_mapping import LogMapping


def record_of(mapping: LogMapping, recording: Recording) -> Record:
    """Return the record that a mapping makes of a recording."""
    try:
        sampler = Sampler(
            _feeds(mapping, recording),
            meant(mapping.topics, recording).get(mapping.topic or "", mapping.topic),
            mapping.rate,
        )
    except LogError as error:
        raise LogError(error.faults, source=recording.source) from error
    record = _put_together(mapping, sampler, recording.source)
    if told := [str(one) for one in sampler.met if _worth_a_warning(one)]:
        warnings.warn(f"{recording.source}: {'; '.join(told)}", ClockWarning, stacklevel=4)
    notes = (*recording.notes, *_summary(sampler, mapping.rate), *map(str, sampler.met))
    return dataclasses.replace(record, notes=notes)


def _feeds(mapping: LogMapping, recording: Recording) -> Feeds:
    """Find all channels and set their clocks right, or tell every fault."""
    names = meant(mapping.topics, recording)
    entries = resolved(mapping.entries, names)
    time = next(entry for entry in entries if entry.group == "time")
    wanted = [entry for entry in entries if entry is not time]
    segment = None if mapping.segment is None else renamed(mapping.segment, names)
    if segment is not None and locate(segment, recording) is None:
        wanted.append(Entry("segment", "segment", (Source(segment),)))
    table = any(not topic.name and topic.time is None for topic in recording.topics)
    if table and time.column != RECORDED:
        wanted.insert(0, time)
    given = [name for name, _ in mapping.topics]
    found, faults = find(wanted, recording, mapping.source, given)
    channels: list[Found] = [one for one in found if one.entry is not time]
    feeds, untimed = feeds_of(channels, time, segment, recording)
    if faults := [*faults, *(() if table and faults else untimed)]:
        raise LogError(faults)
    return feeds


def _put_together(mapping: LogMapping, sampler: Sampler, source: str) -> Record:
    """Return the record of the channels, or tell every fault of theirs."""
    made = Assembly(mapping, sampler)
    moves = any(name in made.numbers for name in "uvwpqr")
    # Columns without a velocity make no log; a position may yet give one.
    numbers = made.numbers if moves else {**made.numbers, "u": np.zeros(sampler.n)}
    record, faults = record_of_columns(
        numbers,
        tuple(name for name in mapping.commands if name in numbers),
        sampler.labels(name_after(source)),
        sampler.lines(),
        source,
    )
    faults = [*made.faults, *faults]
    if faults or record is None:
        raise LogError(faults or ["there are no samples"], source=source)
    if not moves:
        record = dataclasses.replace(record, velocity_names=())
    blocks = {**record.blocks, "position": made.position, "specific_force": made.specific_force}
    there = {name: block for name, block in blocks.items() if block is not None}
    return dataclasses.replace(record, blocks=there)


def _summary(sampler: Sampler, rate: float | None) -> Iterator[str]:
    """Say whose clock the log follows, where there was a choice."""
    base = sampler.feeds.feeds[sampler.base].topic.name
    others = len({feed.topic.name for feed in sampler.feeds.feeds} - {base})
    if rate is not None:
        yield f"brought to {rate:g} Hz over the messages of `{base}`"
    elif others:
        yield f"{others} topic{'s' if others > 1 else ''} brought to the clock of `{base}`"
    for one in sampler.feeds.constants:
        value = float(one.values()[0])
        yield f"`{one.entry.name}` was not recorded; the mapping takes it as {value:g} throughout"


def _worth_a_warning(met: Met) -> bool:
    """Tell what may change a result from what a log is expected to have."""
    return met.oddity not in (Oddity.DROPOUT, Oddity.EMPTY)

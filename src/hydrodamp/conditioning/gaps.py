"""Dropouts of sensors taken out: bridged where the gap is short, cut where it is long."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import slerp
from hydrodamp.data.canonical import columns_of
from hydrodamp.data.channels import BLOCKS
from hydrodamp.data.log import Log, extract_segments
from hydrodamp.data.record import Segment, max_step
from hydrodamp.errors import LogError

#: How the channel of the quaternions is called.
ATTITUDE = "attitude"

_SENSOR_CHANNELS = [
    (block.name, place, name)
    for block in BLOCKS
    if block.is_sensed
    for place, name in enumerate(block.columns)
]


class _Gaps(NamedTuple):
    """The good samples about every sample of a channel."""

    before: IntArray
    after: IntArray
    share: FloatArray  # of the way from one to the other
    bridged: BoolArray
    cut: BoolArray


def sensor_columns(log: Log) -> dict[str, FloatArray]:
    """Return what sensors wrote, column by column, without attitude and commands."""
    sensed = {name for _, _, name in _SENSOR_CHANNELS}
    return {name: values for name, values in columns_of(log).items() if name in sensed}


def remove_samples(
    log: Log, lost: Mapping[str, BoolArray], reason: str, longest: float | None = None
) -> Log:
    """Return a log without some samples of some channels, with a note on each channel."""
    span = max_step(log.steps) if longest is None else longest
    gaps = {name: _find_gaps(log, rows, span) for name, rows in lost.items() if rows.any()}
    if not gaps:
        return log
    notes = [
        count_note(reason, name, int(rows.sum()), log.n, done)
        for name, one in gaps.items()
        for rows, done in ((one.bridged, "interpolated"), (one.cut, "cut out"))
        if rows.any()
    ]
    cut = np.logical_or.reduce([one.cut for one in gaps.values()])
    return _cut_rows(_interpolate_gaps(log, gaps), cut, reason).with_notes(*notes)


def true_runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Return the first and one-past-last place of each run of true ones."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def count_note(reason: str, channel: str, samples: int, of: int, done: str) -> str:
    """Return the sentence on samples of a channel and what became of them."""
    share = f"{100 * samples / of:.2g} %"
    return f"{reason}: {samples} of {of} samples of `{channel}` ({share}) {done}"


def _find_gaps(log: Log, lost: BoolArray, longest: float) -> _Gaps:
    index = np.arange(log.n)
    before = np.maximum.accumulate(np.where(lost, -1, index))
    after = np.minimum.accumulate(np.where(lost, log.n, index)[::-1])[::-1]
    inside = (before >= 0) & (after < log.n)
    before, after = np.maximum(before, 0), np.minimum(after, log.n - 1)
    segment = np.repeat(np.arange(len(log.segments)), np.diff(log.bounds, axis=1).ravel())
    near = inside & (segment[before] == segment) & (segment[after] == segment)
    span = log.time[after] - log.time[before]
    bridged = lost & near & (span <= longest * (1 + 1e-9))
    share = np.divide(log.time - log.time[before], span, out=np.zeros(log.n), where=bridged)
    return _Gaps(before, after, share, bridged, lost & ~bridged)


def _interpolate_gaps(log: Log, gaps: Mapping[str, _Gaps]) -> Log:
    blocks: dict[str, Any] = {}
    for block, place, name in _SENSOR_CHANNELS:
        if name in gaps:
            column = blocks.setdefault(block, getattr(log, block).copy())[:, place]
            one, rows = gaps[name], gaps[name].bridged
            first, last = column[one.before[rows]], column[one.after[rows]]
            column[rows] = first + one.share[rows] * (last - first)
    if ATTITUDE in gaps and log.attitude is not None:
        one, rows = gaps[ATTITUDE], gaps[ATTITUDE].bridged
        first, last = log.attitude[one.before[rows]], log.attitude[one.after[rows]]
        blocks[ATTITUDE] = log.attitude.copy()
        blocks[ATTITUDE][rows] = slerp(first, last, one.share[rows])
    return dataclasses.replace(log, **blocks)


def _cut_rows(log: Log, cut: BoolArray, reason: str) -> Log:
    """Leave out samples; each segment falls into the pieces between them."""
    if not cut.any():
        return log
    pieces = [piece for part in log.segments for piece in _split_segment(part, cut)]
    if not pieces:
        fault = f"{reason}: no two neighbouring samples are left; all {log.n} were to be taken out"
        raise LogError(fault, source=log.source)
    return extract_segments(log, pieces)


def _split_segment(part: Segment, cut: BoolArray) -> Iterator[Segment]:
    """Yield what is left of a segment, numbered where there are several."""
    spans = [(a, b) for a, b in true_runs(~cut[part.start : part.stop]) if b - a >= 2]
    for number, (start, stop) in enumerate(spans, start=1):
        name = part.name if len(spans) == 1 else f"{part.name}.{number}"
        yield Segment(name, part.start + start, part.start + stop)

"""Removal of samples: interpolate short gaps, cut the log at long gaps."""

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

#: Name of the quaternion channel.
ATTITUDE = "attitude"

_SENSOR_CHANNELS = [
    (block.name, place, name)
    for block in BLOCKS
    if block.is_sensed
    for place, name in enumerate(block.columns)
]


class _Gaps(NamedTuple):
    """The valid samples before and after every sample of a channel."""

    before: IntArray
    after: IntArray
    share: FloatArray  # interpolation weight of the sample after
    bridged: BoolArray
    cut: BoolArray


def sensor_columns(log: Log) -> dict[str, FloatArray]:
    """Return the columns of sensors, without attitude and commands."""
    sensed = {name for _, _, name in _SENSOR_CHANNELS}
    return {name: values for name, values in columns_of(log).items() if name in sensed}


def remove_samples(
    log: Log, masks: Mapping[str, BoolArray], reason: str, longest: float | None = None
) -> Log:
    """Return a log without the masked samples; its notes count them per channel."""
    span = max_step(log.steps) if longest is None else longest
    gaps = {name: _find_gaps(log, rows, span) for name, rows in masks.items() if rows.any()}
    if not gaps:
        return log
    notes = [
        count_note(reason, name, int(rows.sum()), log.n, done)
        for name, gap in gaps.items()
        for rows, done in ((gap.bridged, "interpolated"), (gap.cut, "cut out"))
        if rows.any()
    ]
    cut = np.logical_or.reduce([gap.cut for gap in gaps.values()])
    return _cut_rows(_interpolate_gaps(log, gaps), cut, reason).with_notes(*notes)


def true_runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Return the half-open index ranges in which a mask is true."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))


def count_note(reason: str, channel: str, samples: int, of: int, done: str) -> str:
    """Return the note on removed samples of a channel."""
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
    for block, column_index, name in _SENSOR_CHANNELS:
        if name in gaps:
            column = blocks.setdefault(block, getattr(log, block).copy())[:, column_index]
            gap, rows = gaps[name], gaps[name].bridged
            first, last = column[gap.before[rows]], column[gap.after[rows]]
            column[rows] = first + gap.share[rows] * (last - first)
    if ATTITUDE in gaps and log.attitude is not None:
        gap, rows = gaps[ATTITUDE], gaps[ATTITUDE].bridged
        first, last = log.attitude[gap.before[rows]], log.attitude[gap.after[rows]]
        blocks[ATTITUDE] = log.attitude.copy()
        blocks[ATTITUDE][rows] = slerp(first, last, gap.share[rows])
    return dataclasses.replace(log, **blocks)


def _cut_rows(log: Log, cut: BoolArray, reason: str) -> Log:
    """Remove samples and split segments there."""
    if not cut.any():
        return log
    pieces = [piece for segment in log.segments for piece in _split_segment(segment, cut)]
    if not pieces:
        fault = f"{reason}: no two adjacent samples remain of {log.n}"
        raise LogError(fault, source=log.source)
    return extract_segments(log, pieces)


def _split_segment(segment: Segment, cut: BoolArray) -> Iterator[Segment]:
    """Yield the remaining parts of a segment, numbered if there are several."""
    spans = [(a, b) for a, b in true_runs(~cut[segment.start : segment.stop]) if b - a >= 2]
    for number, (start, stop) in enumerate(spans, start=1):
        name = segment.name if len(spans) == 1 else f"{segment.name}.{number}"
        yield Segment(name, segment.start + start, segment.start + stop)

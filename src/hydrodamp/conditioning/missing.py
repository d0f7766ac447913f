"""What becomes of samples that are taken out: bridged where the gap is short, cut where not."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.conditioning.channels import measured, segment_of, with_columns
from hydrodamp.conditioning.touched import Cleaned, Touched, cleaned
from hydrodamp.data.attitude import turn
from hydrodamp.data.log import Log, take
from hydrodamp.data.record import Segment, longest_step, unique_names
from hydrodamp.errors import LogError

ATTITUDE = "attitude"
"""How the channel of the quaternions is called."""


@dataclasses.dataclass(frozen=True, eq=False)
class _Between:
    """The good samples about every sample of a channel."""

    before: IntArray
    after: IntArray
    share: FloatArray  # of the way from one to the other
    bridged: BoolArray
    cut: BoolArray


def without_samples(
    log: Log, lost: Mapping[str, BoolArray], step: str, longest: float | None = None
) -> Cleaned:
    """Return a log without some of its samples, bridged or cut."""
    span = usual_gap(log) if longest is None else longest
    between = {name: _between(log, rows, span) for name, rows in lost.items() if rows.any()}
    if not between:
        return Cleaned(log)
    touched = [
        Touched(step, name, int(rows.sum()), log.n, done)
        for name, one in between.items()
        for rows, done in ((one.bridged, "interpolated"), (one.cut, "cut out"))
    ]
    cut = np.logical_or.reduce([one.cut for one in between.values()])
    return cleaned(_without_rows(_bridged(log, between), cut, step), touched)


def usual_gap(log: Log) -> float:
    """Return the longest step of a log that is no gap [s]."""
    joins = np.zeros(log.n, dtype=np.bool_)
    joins[log.bounds[:, 0]] = True
    return longest_step(log.time, joins)


def _between(log: Log, lost: BoolArray, longest: float) -> _Between:
    index = np.arange(log.n)
    before = np.maximum.accumulate(np.where(lost, -1, index))
    after = np.minimum.accumulate(np.where(lost, log.n, index)[::-1])[::-1]
    inside = (before >= 0) & (after < log.n)
    before, after = np.maximum(before, 0), np.minimum(after, log.n - 1)
    segment = segment_of(log)
    near = inside & (segment[before] == segment) & (segment[after] == segment)
    span = log.time[after] - log.time[before]
    bridged = lost & near & (span <= longest * (1 + 1e-9))
    share = np.divide(log.time - log.time[before], span, out=np.zeros(log.n), where=bridged)
    return _Between(before, after, share, bridged, lost & ~bridged)


def _bridged(log: Log, between: Mapping[str, _Between]) -> Log:
    columns, given = {}, measured(log)
    for name, one in between.items():
        if name != ATTITUDE:
            first, last = given[name][one.before], given[name][one.after]
            line = first + one.share * (last - first)
            columns[name] = np.where(one.bridged, line, given[name])
    if ATTITUDE in between and log.attitude is not None:
        log = dataclasses.replace(log, attitude=_turned(log.attitude, between[ATTITUDE]))
    return with_columns(log, columns)


def _turned(attitude: FloatArray, between: _Between) -> FloatArray:
    """Turn the good attitude before each bridged sample towards the one after it."""
    from scipy.spatial.transform import Rotation  # takes long to import

    rows = np.flatnonzero(between.bridged)
    first, last = attitude[between.before[rows]], attitude[between.after[rows]]
    part = turn(first, last) * between.share[rows, np.newaxis]
    made = Rotation.from_quat(first, scalar_first=True) * Rotation.from_rotvec(part)
    values = attitude.copy()
    values[rows] = made.as_quat(scalar_first=True)
    return values


def _without_rows(log: Log, cut: BoolArray, step: str) -> Log:
    """Leave out samples; each segment falls into the pieces between them."""
    if not cut.any():
        return log
    pieces = [piece for part in log.segments for piece in _pieces(part, cut)]
    if not pieces:
        fault = f"{step}: no two neighbouring samples are left; all {log.n} were to be taken out"
        raise LogError(fault, source=log.source)
    names = unique_names(piece.name for piece in pieces)
    kept: list[Any] = [
        Segment(name, piece.start, piece.stop) for name, piece in zip(names, pieces, strict=True)
    ]
    return take(log, kept)


def _pieces(part: Segment, cut: BoolArray) -> Iterator[Segment]:
    """Yield what is left of a segment, numbered where it fell apart."""
    keep = np.concatenate(([False], ~cut[part.start : part.stop], [False]))
    edges = (np.flatnonzero(keep[1:] != keep[:-1]) + part.start).tolist()
    spans = [(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a >= 2]
    for number, (start, stop) in enumerate(spans, start=1):
        name = part.name if len(spans) == 1 else f"{part.name}.{number}"
        yield Segment(name, start, stop)

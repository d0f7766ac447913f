"""Unchecked records, and their segmentation at joins, gaps and missing samples."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from hydrodamp.arrays import BoolArray, FloatArray, IntArray, frozen
from hydrodamp.basis.term import VELOCITIES, check_command_name
from hydrodamp.data.attitude import quaternion_from_euler
from hydrodamp.data.channels import ACCELERATION, ATTITUDE, BLOCKS, EULER, VELOCITY
from hydrodamp.data.plausibility import mask_absurd
from hydrodamp.data.time_scale import motion_time_scale
from hydrodamp.errors import LogError, TermError, did_you_mean, first_few, format_time, unique_names

#: A step longer than this many median steps, and than the shortest gap, is a gap.
MIN_GAP_STEPS = 5.0

#: Shortest gap of a log over the time scale of its motion [1].
RELATIVE_GAP = 0.4

#: Stamps that differ by more than this, 11 days, belong to two epochs [s].
EPOCH_GAP_S = 1e6

#: Longest delay of a message that is no dropout [s]: that of computers, whatever the vehicle.
MIN_GAP_S = 1.0


@dataclass(frozen=True)
class Segment:
    """A part of a log without a join or a gap: samples start to stop - 1."""

    name: str
    start: int
    stop: int

    def __len__(self) -> int:
        """Return the number of samples."""
        return self.stop - self.start


@dataclass(frozen=True, eq=False)
class Record:
    """Arrays of one recording in SI units and canonical axes; NaN where nothing was measured."""

    blocks: Mapping[str, FloatArray]  # as a Log has them; time, velocity and commands always
    velocity_names: tuple[str, ...] = VELOCITIES
    command_names: tuple[str, ...] = ()
    labels: tuple[str, ...] | None = None
    run: IntArray | None = None  # number of the clock run, which changes when the clock restarts
    lines: Sequence[int] | None = None
    source: str = ""
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Make the arrays read-only, so that a log shares them."""
        for block in self.blocks.values():
            block.setflags(write=False)

    @property
    def time(self) -> FloatArray:
        """Sample times [s]."""
        return self.blocks["time"]

    @property
    def n(self) -> int:
        """The number of samples."""
        return len(self.time)

    @property
    def joins(self) -> BoolArray:
        """Whether a segment begins at each sample by its label or its clock, shape (n,)."""
        starts = label_changes(self.labels, self.n) | label_changes(self.run, self.n)
        starts[:1] = True
        return starts

    @property
    def missing(self) -> BoolArray:
        """Whether any column is NaN at each sample, shape (n,)."""
        lacking = np.zeros(self.n, dtype=np.bool_)
        for name, block in self.blocks.items():
            absent = np.isnan(block) & ~unrecorded_columns(name, block)
            lacking |= absent.reshape(self.n, -1).any(axis=1)
        return lacking

    def row_name(self, row: int) -> str:
        """Return the name of a sample in messages."""
        return f"row {row + 1}" + ("" if self.lines is None else f" (line {self.lines[row]})")

    def log_fields(self, keep: BoolArray) -> dict[str, Any]:
        """Return the fields of a log that holds some of the samples."""
        names = ("velocity_names", "command_names", "source", "notes")
        blocks = dict(self.blocks)
        if not keep.all():
            blocks = {name: block[keep] for name, block in blocks.items()}
        return blocks | {name: getattr(self, name) for name in names}


def record_of_arrays(
    given: Mapping[str, Any],
    commands: Mapping[str, npt.ArrayLike],
    segment: Sequence[object] | None,
    source: str,
) -> Record:
    """Return the record of named blocks; raise LogError with all faults."""
    n, velocity, attitude = np.size(given["time"]), given["velocity"], given["attitude"]
    names: tuple[str, ...] = VELOCITIES
    faults = command_faults(commands)
    if isinstance(velocity, Mapping):
        names = tuple(name for name in VELOCITIES if name in velocity)
        columns, wrong = copy_arrays({name: (velocity[name], ()) for name in velocity}, n)
        velocity = stack_columns(columns, VELOCITIES, n)
        faults += wrong + [
            f"velocity names are u v w p q r; got '{name}'.{did_you_mean(name, VELOCITIES)}"
            for name in columns
            if name not in VELOCITIES
        ]
    if attitude is not None and np.shape(attitude) == (n, 3):
        euler, wrong = copy_arrays({"attitude": (attitude, (3,))}, n)
        angles = dict(zip(EULER, euler["attitude"].T, strict=True))
        angles = mask_absurd(angles, given["time"], source)
        attitude = quaternion_from_euler(stack_columns(angles, EULER, n))
        faults += wrong
    complete = {**given, "velocity": velocity, "attitude": attitude}
    shapes = {block.name: (complete[block.name], block.shape) for block in BLOCKS}
    blocks, wrong = copy_arrays(shapes, n)
    channels, wrong_too = copy_arrays({name: (values, ()) for name, values in commands.items()}, n)
    faults += wrong + wrong_too
    if segment is not None and len(segment) != n:
        faults.append(f"`segment` must have {n} labels; got {len(segment)}")
    if faults:
        raise LogError(faults, source=source)
    for block in (VELOCITY, ATTITUDE):
        if block.name in blocks:
            columns = dict(zip(block.columns, blocks[block.name].T, strict=True))
            columns = mask_absurd(columns, blocks["time"], source)
            blocks[block.name] = stack_columns(columns, block.columns, n)
    labels = None if segment is None else tuple(map(str, segment))
    blocks["commands"] = stack_columns(channels, [*channels], n)
    return Record(blocks, names, tuple(channels), labels, source=source)


def copy_arrays(
    given: Mapping[str, tuple[Any, tuple[int | None, ...]]], n: int
) -> tuple[dict[str, FloatArray], list[str]]:
    """Copy arrays of n samples, given with the shape of an entry; return them and their faults."""
    blocks: dict[str, FloatArray] = {}
    faults = []
    for name, (values, shape) in given.items():
        if values is None:
            continue
        try:
            blocks[name] = frozen(values, (n, *shape), name)
        except ValueError as error:
            turned = np.shape(values) == (*shape, n) != (n, *shape)
            hint = ". Did you pass it transposed? Rows are samples" if turned else ""
            faults.append(f"{error}{hint}")
    return blocks, faults


def unrecorded_columns(name: str, block: FloatArray) -> BoolArray:
    """Return which columns of a block are not recorded (only accelerations can be partial)."""
    if name != ACCELERATION.name:
        return np.zeros(block.shape[1:], dtype=np.bool_)
    largest: FloatArray = np.fmax.reduce(block, axis=0, initial=np.nan)  # no mask of a long log
    return np.isnan(largest)


def stack_columns(columns: Mapping[str, FloatArray], names: Sequence[str], n: int) -> FloatArray:
    """Stack columns; absent columns are zero."""
    return np.column_stack([np.empty((n, 0)), *(columns.get(name, np.zeros(n)) for name in names)])


def label_changes(labels: Sequence[object] | IntArray | None, n: int) -> BoolArray:
    """Return which of n samples have another label than the previous sample."""
    changed = np.zeros(n, dtype=np.bool_)
    if labels is not None:
        names = np.array(labels, dtype=object)
        changed[1:] = names[1:] != names[:-1]
    return changed


def command_faults(names: Iterable[str]) -> list[str]:
    """Return the faults of command names."""
    faults = []
    for name in names:
        try:
            check_command_name(name)
        except TermError as error:
            faults.append(f"column `{name}`: {error}")
    return faults


def max_step(steps: FloatArray, shortest_gap: float = MIN_GAP_S) -> float:
    """Return the longest step [s] that is not a gap."""
    median = float(np.median(steps)) if len(steps) else 0.0
    return max(MIN_GAP_STEPS * median, shortest_gap)


def _shortest_gap(record: Record) -> float:
    """Return the shortest gap [s] by the correlation time of the velocities."""
    velocity = record.blocks["velocity"]
    rows = np.isfinite(record.time) & np.isfinite(velocity).all(axis=1)
    if np.count_nonzero(rows) < 2:
        return 0.0
    edges = [0, *np.flatnonzero(record.joins[rows][1:]) + 1, np.count_nonzero(rows)]
    bounds = np.array([*itertools.pairwise(edges)], dtype=np.int64)
    return RELATIVE_GAP * motion_time_scale(record.time[rows], velocity[rows], bounds)


def split_segments(record: Record) -> tuple[BoolArray, tuple[Segment, ...], tuple[str, ...]]:
    """Return which samples to keep, their segments, and a note on every cut except joins."""
    joins, missing = record.joins, record.missing
    steps = np.diff(record.time, prepend=record.time[:1])
    inside = steps[1:][~joins[1:]]
    gaps = (steps > max_step(inside, 0.0)) & ~joins
    if gaps.any():  # long against the motion, too
        gaps &= steps > max_step(inside, _shortest_gap(record))
    starts = joins | gaps | (missing != np.roll(missing, 1))
    edges = np.append(np.flatnonzero(starts), record.n).tolist()
    pieces = [(a, b) for a, b in itertools.pairwise(edges) if not missing[a] and b - a >= 2]
    keep = np.zeros(record.n, dtype=np.bool_)
    for a, b in pieces:
        keep[a:b] = True
    return keep, _segments(record, pieces), tuple(_notes(record, gaps, missing, edges, pieces))


def name_of_source(source: str) -> str:
    """Return the segment name of a file; of several files, the first."""
    name = Path(source.split(", ")[0]).name
    return Path(name[:-3] if name.lower().endswith(".gz") else name).stem or "1"


def consecutive_segments(names: Iterable[str], lengths: Iterable[int]) -> tuple[Segment, ...]:
    """Return consecutive segments of given lengths with unique names."""
    edges = itertools.pairwise(itertools.accumulate(lengths, initial=0))
    pairs = zip(unique_names(names), edges, strict=True)
    return tuple(Segment(name, start, stop) for name, (start, stop) in pairs)


def matches_name(segment: str, name: str) -> bool:
    """Return whether a name is that of a segment or of its label."""
    label, _, piece = segment.rpartition(".")
    return segment == name or (piece.isdigit() and matches_name(label, name))


def _segments(record: Record, pieces: list[tuple[int, int]]) -> tuple[Segment, ...]:
    """Name each piece after its label or file, numbered if a label has several."""
    run = np.cumsum(label_changes(record.labels, record.n))
    count = np.bincount([run[a] for a, _ in pieces], minlength=1)
    n_seen: dict[int, int] = {}
    names = []
    for a, _ in pieces:
        label = name_of_source(record.source) if record.labels is None else record.labels[a]
        n_seen[run[a]] = n_seen.get(run[a], 0) + 1
        names.append(f"{label}.{n_seen[run[a]]}" if count[run[a]] > 1 else label)
    return consecutive_segments(names, [b - a for a, b in pieces])


def _notes(
    record: Record,
    gaps: BoolArray,
    missing: BoolArray,
    edges: list[int],
    segment_bounds: list[tuple[int, int]],
) -> Iterator[str]:
    """Yield notes on cuts and discarded samples."""
    time, pieces = record.time.tolist(), [*itertools.pairwise(edges)]
    first = time[segment_bounds[0][0]] if segment_bounds else time[0]
    pauses = [
        f"no samples for {time[row] - time[row - 1]:.3g} s from {format_time(time[row - 1], first)}"
        for row in np.flatnonzero(gaps).tolist()
    ]
    discarded = [
        f"{b - a} sample{'s' if b - a > 1 else ''}"
        f" {'with missing values' if missing[a] else 'alone, left out'}"
        f" at {format_time(time[a], first)}"
        + ("" if record.labels is None else f" (segment '{record.labels[a]}')")
        for a, b in pieces
        if missing[a] or b - a == 1
    ]
    yield from first_few(pauses, 5, "gaps")
    yield from first_few(discarded, 5, "parts left out")

"""Timestamps: cleaning of a topic's clock, and resampling at the ticks of another clock.

Cleaning drops missing, duplicate and out-of-order timestamps, splits runs where the clock is reset,
and spaces samples of a coarse clock evenly. Resampling interpolates linearly, or holds the last
sample (sample and hold), and gives NaN across dropouts: steps above a limit from the median step.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from hydrodamp.arrays import BoolArray, FloatArray, IntArray
from hydrodamp.data.attitude import slerp
from hydrodamp.data.record import EPOCH_GAP_S, label_changes, max_step
from hydrodamp.errors import LogError, format_time
from hydrodamp.ingest.wrapped_counters import unwrap_counter

#: Share of rows with the timestamp of the previous row above which the clock is coarse.
COARSE_SHARE = 0.25

_MAX_RESETS = 200  # of a clock; more is no clock
_MAX_STOPPED_ROWS = 20  # rows with the last timestamp, and ratio to the median count


class IrregularityKind(Enum):
    """Kind of irregularity; the value is the template of its sentence."""

    MISSING = "{count} without a timestamp, dropped"
    REPEATED = "{count} with a duplicate timestamp, dropped (first at {first})"
    COARSE = (
        "{count} with new values but the timestamp of the previous one: the resolution of the clock"
        " is coarse; they were spaced evenly up to the next timestamp (first at {first})"
    )
    STOPPED = (
        "the clock stops at {first}; {count} after it were dropped. If evenly sampled, set"
        " `time: {{rate: HERTZ}}`"
    )
    OUT_OF_ORDER = "{count} out of order, dropped (first at {first})"
    RESET = "the clock was reset or changed its epoch {times}; a segment begins (first at {first})"
    WRAPPED = "the counter of the clock wrapped {times}; the time continues (first at {first})"
    DROPOUT = "{times} no message for longer than {limit:.3g} s (first after {first})"
    INVALID = "{count} without a value of {channel}, dropped (first at {first})"


@dataclass(frozen=True)
class Irregularity:
    """Irregularities of one kind in one topic: count, time of the first [s], longest step [s]."""

    topic: str
    kind: IrregularityKind
    count: int
    first_time: float
    limit: float = 0.0
    channel: str = ""

    def describe(self, first: float = 0.0) -> str:
        """Return the sentence; times count from the first sample of the log."""
        noun = "message" if self.topic else "row"
        return self.kind.value.format(
            count=f"{self.count} {noun}{'s' if self.count != 1 else ''}",
            times="once" if self.count == 1 else f"{self.count} times",
            first=format_time(self.first_time, first),
            limit=self.limit,
            channel=self.channel,
        )


def describe_irregularities(
    irregularities: Iterable[Irregularity], first: float
) -> Iterator[tuple[IrregularityKind, str]]:
    """Yield each distinct sentence once, with the topics it applies to."""
    topics: dict[tuple[IrregularityKind, str], list[str]] = {}
    for it in irregularities:
        topics.setdefault((it.kind, it.describe(first)), []).append(it.topic)
    for (kind, sentence), names in topics.items():
        listed = " ".join(f"`{name}`" for name in names if name)
        yield kind, f"{listed}: {sentence}" if listed else sentence


@dataclass(frozen=True, eq=False)
class Clock:
    """Timestamps of a topic as recorded [s], with segment labels and runs of the clock.

    ``is_new`` marks rows that differ from the previous row; ``run`` gives the run of each row where
    the rows are a selection of a table.
    """

    topic: str
    time: FloatArray
    labels: Sequence[str] | None = None
    is_new: BoolArray | None = None
    run: IntArray | None = None

    @cached_property
    def runs(self) -> IntArray:
        """Run of each row: the number of clock resets before it."""
        stamps, run = clean_timestamps(self), np.zeros(len(self.time), dtype=np.int64)
        run[stamps.rows] = stamps.run
        return np.maximum.accumulate(run)


@dataclass(frozen=True, eq=False)
class Timestamps:
    """Cleaned timestamps of a topic: increasing within each run.

    ``rows`` are indices into the recorded rows, ``step`` is the median step [s], and steps above
    ``limit`` [s] are dropouts.
    """

    rows: IntArray
    time: FloatArray
    run: IntArray
    step: float
    limit: float
    irregularities: tuple[Irregularity, ...] = ()

    def select(self, mask: BoolArray) -> Timestamps:
        """Return the selected messages."""
        if mask.all():
            return self
        return replace(self, rows=self.rows[mask], time=self.time[mask], run=self.run[mask])


def clean_timestamps(clock: Clock) -> Timestamps:
    """Drop missing, duplicate and out-of-order timestamps; split runs at resets."""
    return _TimestampCleaner(clock).stamps()


class _TimestampCleaner:
    """Cleaning of one clock; holds the rows kept so far and the irregularities found."""

    def __init__(self, clock: Clock) -> None:
        self.topic, self.irregularities = clock.topic, list[Irregularity]()
        self.rows: IntArray = np.arange(len(clock.time))
        self.time, self.is_segment_start = clock.time, label_changes(clock.labels, len(clock.time))
        if clock.run is not None:
            self.is_segment_start |= np.diff(clock.run, prepend=clock.run[:1]) != 0
        self._drop_unless(np.isfinite(clock.time), IrregularityKind.MISSING)
        continued = unwrap_counter(self.time)
        if len(wraps := np.flatnonzero(np.diff(continued - self.time))):
            kind, first = IrregularityKind.WRAPPED, float(continued[wraps[0] + 1])
            self.irregularities.append(Irregularity(self.topic, kind, len(wraps), first))
        self.time = continued
        steps = np.abs(np.diff(self.time))[~self.is_segment_start[1:]]
        self.max_step = max_step(steps[steps > 0.0])  # s; a larger step back is a reset
        self._spread_coarse(clock.is_new)

    def _spread_coarse(self, fresh: BoolArray | None) -> None:
        """Space rows that share a coarse timestamp evenly up to the next timestamp."""
        if fresh is not None:
            is_valid = fresh[self.rows] | ~_is_repeated(self.time)
            self._drop_unless(is_valid, IrregularityKind.REPEATED)
        is_repeated = _is_repeated(self.time)
        starts = np.flatnonzero(~is_repeated)
        counts = np.diff(np.append(starts, len(self.time)))
        if len(counts) and counts[-1] > _MAX_STOPPED_ROWS * np.median(counts):
            counts[-1] = 1  # the clock stopped; it is not coarse
        if len(counts) < 2 or np.sum(counts - 1) < COARSE_SHARE * len(self.time):
            return
        steps = np.maximum(np.diff(self.time[starts]), 0.0)
        steps = np.append(steps, np.median(steps))
        block = np.repeat(np.arange(len(starts)), counts)
        self._report(IrregularityKind.COARSE, is_repeated[: len(block)])
        offsets = steps[block] * (np.arange(len(block)) - starts[block]) / counts[block]
        self.time = self.time + np.pad(offsets, (0, len(self.time) - len(block)))

    def _drop_unless(self, keep: BoolArray, kind: IrregularityKind) -> None:
        """Keep the selected rows and report the others."""
        if keep.all():
            return
        self._report(kind, ~keep)
        # If a segment start is dropped, the next row that remains starts the segment.
        segment = np.cumsum(self.is_segment_start)[keep]
        self.rows, self.time = self.rows[keep], self.time[keep]
        self.is_segment_start = np.append(False, np.diff(segment) > 0)[: len(segment)]

    def _report(self, kind: IrregularityKind, mask: BoolArray) -> None:
        first, count = float(self.time[np.argmax(mask)]), int(np.count_nonzero(mask))
        self.irregularities.append(Irregularity(self.topic, kind, count, first))

    def stamps(self) -> Timestamps:
        """Return the increasing timestamps by run, and report dropouts."""
        run: IntArray = np.cumsum(self._find_resets(), dtype=np.int64)
        is_increasing = self._is_increasing(self.time, run)
        keep = slice(None) if is_increasing.all() else is_increasing
        rows, time, run = self.rows[keep], self.time[keep], run[keep]
        steps = np.diff(time)
        same_run = run[1:] == run[:-1]
        step = float(np.median(steps[same_run])) if same_run.any() else 0.0
        limit = max_step(steps[same_run])
        if len(gaps := np.flatnonzero((steps > limit) & same_run)):
            kind, first = IrregularityKind.DROPOUT, float(time[gaps[0]])
            self.irregularities.append(Irregularity(self.topic, kind, len(gaps), first, limit))
        return Timestamps(rows, time, run, step, limit, tuple(self.irregularities))

    def _find_resets(self) -> BoolArray:
        """Return where a run begins: at a segment start, a large step back or a change of epoch."""
        steps = np.append(0.0, np.diff(self.time))[: len(self.time)]
        is_reset = ((steps < -self.max_step) | (steps > EPOCH_GAP_S)) & ~self.is_segment_start
        count = int(np.count_nonzero(is_reset))
        if count > _MAX_RESETS:
            of_topic = f" of `{self.topic}`" if self.topic else ""
            raise LogError(
                f"the clock{of_topic} is reset {count} times; expected an increasing time. Set"
                " another column in `time`"
            )
        if count:
            self._report(IrregularityKind.RESET, is_reset)
        return np.asarray(is_reset | (self.is_segment_start & (steps <= 0)))

    def _is_increasing(self, time: FloatArray, run: IntArray) -> BoolArray:
        """Return which messages are later than all previous ones in their run."""
        edges = np.flatnonzero(np.diff(run)) + 1
        latest = np.concatenate([np.maximum.accumulate(times) for times in np.split(time, edges)])
        before = np.append(-np.inf, latest[:-1])
        before[edges] = -np.inf
        repeated = time == before
        tail = len(time) - int(np.flatnonzero(~repeated)[-1]) - 1 if len(time) else 0
        stopped = np.arange(len(time)) >= len(time) - (tail if tail > _MAX_STOPPED_ROWS else 0)
        masks = {
            IrregularityKind.REPEATED: repeated & ~stopped,
            IrregularityKind.STOPPED: stopped,
            IrregularityKind.OUT_OF_ORDER: time < before,
        }
        for kind in (kind for kind, mask in masks.items() if mask.any()):
            self._report(kind, masks[kind])
        return np.asarray(time > before)


def _is_repeated(time: FloatArray) -> BoolArray:
    return np.append(False, np.diff(time) == 0)[: len(time)]


class Ticks(NamedTuple):
    """Sample times of the resampled log [s], and the run of each."""

    time: FloatArray
    run: IntArray


class Brackets(NamedTuple):
    """Message before each tick, and whether the tick may be interpolated or held.

    Times of messages and ticks are offset run by run, so that runs do not overlap. ``invalid``: no
    interpolation (dropout or end of a run); ``stale``: the last sample is too old to hold;
    ``before_first``: no message precedes the tick in its run.
    """

    messages: FloatArray
    ticks: FloatArray
    before: IntArray
    invalid: BoolArray
    stale: BoolArray
    before_first: BoolArray


def bracket_ticks(stamps: Timestamps, ticks: Ticks) -> Brackets:
    """Return the message before each tick; there must be at least one message."""
    messages, times = _offset_runs(stamps, ticks)
    # Faster than searchsorted since both increase; rounding may give the next message.
    index = np.interp(times, messages, np.arange(float(len(messages)))).astype(np.int64)
    index -= (messages[index] > times) & (index > 0)
    since = times - messages[index]
    before_first = (since < 0) | (stamps.run[index] != ticks.run)
    is_run_end = np.append(np.diff(stamps.run) != 0, True)
    is_gap = np.append(np.diff(messages) > stamps.limit, True) | is_run_end
    invalid = before_first | ((since > 0) & is_gap[index])
    stale = invalid & (before_first | ~is_run_end[index] | (since > stamps.step))
    return Brackets(messages, times, index, invalid, stale, before_first)


def _offset_runs(stamps: Timestamps, ticks: Ticks) -> tuple[FloatArray, FloatArray]:
    """Return both times with offsets that separate the runs, also after a reset."""
    if stamps.run[-1] == ticks.run[-1] == 0:
        return stamps.time, ticks.time  # a single run, the common case
    edges = [edge for time in (stamps.time, ticks.time) for edge in (time.min(), time.max())]
    span = max(edges) - min(edges) + 1.0
    return stamps.time + span * stamps.run, ticks.time + span * ticks.run


def interpolate(values: FloatArray, brackets: Brackets) -> FloatArray:
    """Interpolate values linearly between messages; NaN across dropouts."""
    result: FloatArray = np.interp(brackets.ticks, brackets.messages, values)
    result[brackets.invalid] = np.nan
    return result


def sample_and_hold(
    values: FloatArray, brackets: Brackets, *, until_next: bool = False
) -> FloatArray:
    """Return the value of the last message before each tick; NaN where it is stale."""
    result = values[brackets.before]
    result[brackets.before_first if until_next else brackets.stale] = np.nan
    return result


def interpolate_attitude(quaternions: FloatArray, brackets: Brackets) -> FloatArray:
    """Interpolate attitudes between messages (slerp); NaN across dropouts."""
    after = np.minimum(brackets.before + 1, len(quaternions) - 1)
    start, end = brackets.messages[brackets.before], brackets.messages[after]
    fraction = (brackets.ticks - start) / np.where(end > start, end - start, 1.0)
    fraction[brackets.invalid] = np.nan
    return slerp(quaternions[brackets.before], quaternions[after], fraction)


def make_even_ticks(stamps: Timestamps, rate: float) -> Ticks:
    """Return ticks at a rate [Hz] over the runs of a topic."""
    times, runs = [], []
    for number, span in split_runs(stamps.run):
        first, last = stamps.time[span][[0, -1]].tolist()
        # Tolerance for rounding, so that the last tick is not lost.
        count = int((last - first) * rate * (1 + 1e-12) + 1e-9) + 1
        times.append(np.minimum(first + np.arange(count) / rate, last))
        runs.append(np.full(count, number))
    return Ticks(np.concatenate(times), np.concatenate(runs))


def align_runs(stamps: Timestamps, base: Timestamps) -> Timestamps:
    """Match the runs of a topic with those of the reference clock; drop runs without a match."""
    runs, base_runs = split_runs(stamps.run), split_runs(base.run)
    indices = [*range(len(runs))]
    if len(runs) != len(base_runs):
        indices = _match_by_overlap(
            [stamps.time[[span.start, span.stop - 1]].tolist() for _, span in runs],
            [base.time[[span.start, span.stop - 1]].tolist() for _, span in base_runs],
        )
    numbers = [*(number for number, _ in base_runs), -1]
    lengths = [span.stop - span.start for _, span in runs]
    run = np.repeat(np.array([numbers[index] for index in indices], np.int64), lengths)
    return replace(stamps, run=run).select(run >= 0)


def _match_by_overlap(
    spans: Sequence[Sequence[float]], base_spans: Sequence[Sequence[float]]
) -> list[int]:
    """Return for each span the reference span of largest overlap, in order."""
    indices: list[int] = []
    for first, last in spans:
        first_free = indices[-1] + 1 if indices else 0
        overlaps = [min(last, b) - max(first, a) for a, b in base_spans[first_free:]]
        indices.append(first_free + int(np.argmax(overlaps)) if overlaps else len(base_spans))
    return indices


def split_runs(run: IntArray) -> list[tuple[int, slice]]:
    """Return number and slice of each run of equal numbers."""
    if len(run) == 0:
        return []
    edges = [0, *(np.flatnonzero(np.diff(run)) + 1).tolist(), len(run)]
    return [(int(run[a]), slice(a, b)) for a, b in itertools.pairwise(edges)]

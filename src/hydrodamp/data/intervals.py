"""Intervals of a log by text: START:END in seconds from its first sample, or by its clock."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hydrodamp.data.concatenation import concatenate
from hydrodamp.data.log import Log
from hydrodamp.errors import ProblemError

#: Rounding of times that are copied from output [s].
CLOCK_TOLERANCE = 1.0

#: Overlap of training data that contain all test data.
ALL_TEST_DATA = "all test data"

_NUMBER = r"[0-9]+(?:\.[0-9]*)?(?:[eE][+-]?[0-9]+)?|\.[0-9]+"
INTERVAL = re.compile(rf"({_NUMBER}):({_NUMBER})")


class Interval(NamedTuple):
    """An interval of a log [s] as given, and the shift to seconds from the first sample."""

    start: float
    end: float
    shift: float


def parse_interval(text: str, log: Log) -> Interval | None:
    """Return the interval that a text names, None if it names a segment."""
    if ":" not in text or text in {segment.name for segment in log.segments}:
        return None
    match = INTERVAL.fullmatch(text.strip())
    if not match or not float(match[1]) < float(match[2]):
        raise ProblemError(
            "a time span must be START:END in seconds from the first sample of LOG, or by its "
            f"clock, with 0 <= START < END, such as 0:900; got '{text}'."
        )
    start, end = float(match[1]), float(match[2])
    return Interval(start, end, _shift(start, end, log))


def select_data(log: Log, text: str) -> Log:
    """Return the segment or the interval of a log that a text names."""
    interval = parse_interval(text, log)
    if interval is None:
        return log.select(text)
    return log.between(interval.start + interval.shift, interval.end + interval.shift)


def find_overlap(log: Log, train: Iterable[str], test: Iterable[str]) -> str:
    """Return the intervals of a log [s] that are in both training and test data; empty for none."""
    index = np.arange(log.n, dtype=float)
    numbered = replace(log, commands=index[:, None], command_names=("index",))
    in_train, in_test = (
        np.isin(index, concatenate(select_data(numbered, each) for each in names).commands)
        for names in (train, test)
    )
    if not (in_test & ~in_train).any():
        return ALL_TEST_DATA
    edges = np.flatnonzero(np.diff(in_train & in_test, prepend=False, append=False))
    pairs = edges.reshape(-1, 2)
    return ", ".join(f"{log.elapsed[a]:.10g}:{log.elapsed[b - 1]:.10g} s" for a, b in pairs)


def _shift(start: float, end: float, log: Log) -> float:
    """Return the offset of an interval by the clock of the log; 0 if it is in seconds."""
    if end <= log.elapsed[-1] + CLOCK_TOLERANCE:
        return 0.0
    shifts = (log.elapsed - log.time).round(3)
    runs = {shift: log.time[shifts == shift] for shift in dict.fromkeys(shifts.tolist())}
    fit = [
        shift
        for shift, time in runs.items()
        if time[0] - CLOCK_TOLERANCE <= start and end <= time[-1] + CLOCK_TOLERANCE
    ]
    return float(fit[0]) if len(fit) == 1 else 0.0

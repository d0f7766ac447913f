"""Lines over time: the extremes of every bin, segments end to end, joins marked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.data.log import Log
from hydrodamp.report.figures.look import FAINT, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Bins of a line: more than twice as many as fit beside each other across a column.
PAIRS = 800

# Segments whose names are written; of more, the number is.
MOST_NAMED = 8

# Letters of the names that fit above a panel.
_LETTERS = 56


def extremes(values: FloatArray, most: int = PAIRS) -> IntArray:
    """Return which samples to draw so that a line looks like all of them."""
    n = len(values)
    if n <= 2 * most:
        return np.arange(n)
    length = -(-n // most)
    bins = np.append(values, np.full(-n % length, np.nan)).reshape(-1, length)
    starts = np.arange(0, n, length)
    low = np.argmin(np.where(np.isnan(bins), np.inf, bins), axis=1)
    high = np.argmax(np.where(np.isnan(bins), -np.inf, bins), axis=1)
    return np.unique(np.concatenate([[0, n - 1], starts + low, starts + high]))


def clock(log: Log) -> FloatArray:
    """Return the time that figures show: recorded time, segments end to end."""
    steps = np.diff(log.time, prepend=log.time[0])
    steps[[segment.start for segment in log.segments]] = 0.0
    return np.cumsum(steps)


def trace(log: Log, *channels: FloatArray) -> tuple[FloatArray, ...]:
    """Return the time and the channels that draw as all samples would, broken at joins."""
    time, parts = clock(log), []
    for segment in log.segments:
        part = slice(segment.start, segment.stop)
        share = max(round(PAIRS * len(segment) / log.n), 1)
        kept = np.unique(np.concatenate([extremes(one[part], share) for one in channels]))
        columns = np.array([one[part][kept] for one in (time, *channels)])
        join = np.concatenate([columns[:1, -1:], np.full((len(channels), 1), np.nan)])
        parts += [columns, join]
    return tuple(np.concatenate(parts, axis=1))


def mark_segments(panels: Sequence[Axes], log: Log) -> None:
    """Mark joins in every panel, name segments above the first, time below the last."""
    time, segments = clock(log), log.segments
    end = max(float(time[-1]), 1e-9)
    panels[-1].set_xlim(0.0, end)
    number = f"{len(segments)} " if len(segments) > MOST_NAMED else ""
    several = f"recorded time, {number}segments end to end [s]"
    panels[-1].set_xlabel(several if len(segments) > 1 else "time [s]")
    for segment in segments[1:]:
        for panel in panels:
            panel.axvline(float(time[segment.start]), color=FAINT, linewidth=0.6, linestyle=":")
    for segment in segments if 1 < len(segments) <= MOST_NAMED else ():
        start, stop = float(time[segment.start]), float(time[segment.stop - 1])
        room = int(_LETTERS * (stop - start) / end)
        panels[0].annotate(
            plain(segment.name, room) if room > 2 else "",
            (0.5 * (start + stop), 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0.0, 2.0),
            textcoords="offset points",
            ha="center",
            fontsize=6.5,
            color=FAINT,
        )

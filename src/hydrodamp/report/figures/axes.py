"""Axes and lines of figures: units, symbols, logarithmic scales, min-max decimation of series."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.term import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.models.model import read_label
from hydrodamp.report.figures.style import FAINT, escape_text
from hydrodamp.simulation.replay import RateUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def velocity_unit(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the display unit of a velocity."""
    return "m/s" if name in VELOCITIES[:3] else f"{rate_unit}/s"


def velocity_label(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the axis label of a velocity."""
    return f"${name}$ [{velocity_unit(name, rate_unit)}]"


def shown_velocities(velocity: FloatArray, name: str, rate_unit: RateUnit = "deg") -> FloatArray:
    """Return one velocity in its display unit."""
    column = velocity[:, VELOCITIES.index(name)]
    return np.degrees(column) if velocity_unit(name, rate_unit) == "deg/s" else column


def coefficient_symbol(label: str) -> str:
    r"""Return the symbol of a coefficient in matplotlib's math text."""
    axis, term = read_label(label)
    latex = re.sub(r"\\[lr]vert ?", "|", term.latex())
    return f"${axis}_{{{latex}}}$"


def error_scale(panel: Axes) -> None:
    """Make the vertical axis logarithmic with plain numbers; after drawing."""
    from matplotlib.ticker import LogLocator, NullLocator

    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=9))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter("{x:g}")


# Points of a line: more than twice the number of pixels of a column.
POINTS = 1600

MAX_SEGMENT_NAMES = 8  # segments whose names are written
PANEL_LETTERS = 56  # letters that fit above a panel


@dataclass(frozen=True)
class Bins:
    """Min-max decimation: intervals of samples, drawn by their minimum and maximum."""

    starts: IntArray
    stops: IntArray
    joins: IntArray  # intervals that start a segment, without the first

    @classmethod
    def over(cls, bounds: IntArray, points: int) -> Bins:
        """Return intervals of equal length with a given number of points in total."""
        n = int(np.diff(bounds).sum())
        edges = [
            np.arange(start, stop + 1)
            if n <= points
            else np.linspace(
                start, stop, min(max(round(points / 2 * (stop - start) / n), 1), stop - start) + 1
            ).astype(np.intp)
            for start, stop in bounds.tolist()
        ]
        return cls(
            starts=np.concatenate([edge[:-1] for edge in edges]),
            stops=np.concatenate([edge[1:] for edge in edges]),
            joins=np.cumsum([len(edge) - 1 for edge in edges])[:-1],
        )

    @property
    def is_exact(self) -> bool:
        """Whether every interval is one sample."""
        return bool(np.all(self.stops - self.starts == 1))

    def times(self, time: FloatArray) -> FloatArray:
        """Return the first and last time of each interval, and one between segments."""
        between = 0.5 * (time[self.starts[self.joins]] + time[self.stops[self.joins - 1] - 1])
        return self._interleave(time[self.starts], time[self.stops - 1], between)

    def values(self, series: FloatArray) -> FloatArray:
        """Return the extremes of each interval, in order of time."""
        ends = np.column_stack([self.starts, self.stops]).ravel()
        extended = np.append(series, np.nan)  # an index one past the end must be there
        low, high = (extreme.reduceat(extended, ends)[0::2] for extreme in (np.fmin, np.fmax))
        falling = series[self.starts] > series[self.stops - 1]
        gaps = np.full(len(self.joins), np.nan)
        first, second = np.where(falling, high, low), np.where(falling, low, high)
        return self._interleave(first, second, gaps)

    def _interleave(self, first: FloatArray, second: FloatArray, gaps: FloatArray) -> FloatArray:
        pairs = first[:, None] if self.is_exact else np.column_stack([first, second])
        series: FloatArray = np.insert(pairs.ravel(), self.joins * pairs.shape[1], gaps)
        return series


def clock(log: Log) -> FloatArray:
    """Return recorded time with segments end to end."""
    steps = np.diff(log.time, prepend=log.time[0])
    steps[[segment.start for segment in log.segments]] = 0.0
    return np.cumsum(steps)


def trace(log: Log, *channels: FloatArray) -> tuple[FloatArray, ...]:
    """Return decimated time and channels, with gaps between segments."""
    bins = Bins.over(log.bounds, POINTS)
    return bins.times(clock(log)), *map(bins.values, channels)


def mark_segments(panels: Sequence[Axes], log: Log) -> None:
    """Mark segment boundaries in all panels, with names above the first panel."""
    time, segments = clock(log), log.segments
    end = max(float(time[-1]), 1e-9)
    panels[-1].set_xlim(0.0, end)
    label = f"recorded time, {len(segments)} segments end to end [s]"
    panels[-1].set_xlabel(label if len(segments) > 1 else "time [s]")
    for segment in segments[1:]:
        for panel in panels:
            panel.axvline(float(time[segment.start]), color=FAINT, linewidth=0.6, linestyle=":")
    for segment in segments if 1 < len(segments) <= MAX_SEGMENT_NAMES else ():
        start, stop = float(time[segment.start]), float(time[segment.stop - 1])
        n_letters = int(PANEL_LETTERS * (stop - start) / end)
        text = escape_text(segment.name, n_letters) if n_letters > 2 else ""
        name = panels[0].text(0.5 * (start + stop), 1.02, text, ha="center", color=FAINT)
        name.set(transform=panels[0].get_xaxis_transform(), fontsize=6.5)

"""Axes and lines of figures: units and symbols, wide scales, extremes over time, joins."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hydrodamp.arrays import FloatArray, IntArray
from hydrodamp.basis.atoms import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.models.model import read_label
from hydrodamp.report.figures.style import FAINT, escape_text
from hydrodamp.simulation.replay import RateUnit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def velocity_unit(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the unit a velocity is shown in."""
    return "m/s" if name in VELOCITIES[:3] else f"{rate_unit}/s"


def velocity_label(name: str, rate_unit: RateUnit = "deg") -> str:
    """Return the label of an axis that shows a velocity."""
    return f"${name}$ [{velocity_unit(name, rate_unit)}]"


def shown_velocities(velocity: FloatArray, name: str, rate_unit: RateUnit = "deg") -> FloatArray:
    """Return one column of velocities in the unit it is shown in."""
    column = velocity[:, VELOCITIES.index(name)]
    return np.degrees(column) if velocity_unit(name, rate_unit) == "deg/s" else column


def coefficient_symbol(label: str) -> str:
    r"""Return the symbol of a coefficient as matplotlib's mathematics."""
    axis, term = read_label(label)
    spelt = re.sub(r"\\[lr]vert ?", "|", term.latex())
    return f"${axis}_{{{spelt}}}$"


def error_scale(panel: Axes) -> None:
    """Put a logarithmic scale with plain numbers up the side of a panel that is drawn."""
    from matplotlib.ticker import LogLocator, NullLocator

    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=9))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter("{x:g}")


# Points of a line: more than twice as many as fit beside each other across a column.
POINTS = 1600

# Segments whose names are written, and letters of them that fit above a panel.
_NAMED, _LETTERS = 8, 56


@dataclass(frozen=True)
class Bins:
    """Stretches of samples, each drawn by its lowest and its highest value."""

    starts: IntArray
    stops: IntArray
    joins: IntArray  # the stretches that begin a segment, without the first

    @classmethod
    def over(cls, bounds: IntArray, points: int) -> Bins:
        """Return stretches of equal length that together have about so many points."""
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
            starts=np.concatenate([each[:-1] for each in edges]),
            stops=np.concatenate([each[1:] for each in edges]),
            joins=np.cumsum([len(each) - 1 for each in edges])[:-1],
        )

    @property
    def is_exact(self) -> bool:
        """Whether every stretch is one sample."""
        return bool(np.all(self.stops - self.starts == 1))

    def times(self, time: FloatArray) -> FloatArray:
        """Return the first and the last time of each stretch, and one between segments."""
        between = 0.5 * (time[self.starts[self.joins]] + time[self.stops[self.joins - 1] - 1])
        return self._in_row(time[self.starts], time[self.stops - 1], between)

    def values(self, series: FloatArray) -> FloatArray:
        """Return the extremes of each stretch, in the sense in which it runs."""
        ends = np.column_stack([self.starts, self.stops]).ravel()
        joined = np.append(series, np.nan)  # an index one past the end must be there
        low, high = (each.reduceat(joined, ends)[0::2] for each in (np.fmin, np.fmax))
        falling = series[self.starts] > series[self.stops - 1]
        gaps = np.full(len(self.joins), np.nan)
        first, second = np.where(falling, high, low), np.where(falling, low, high)
        return self._in_row(first, second, gaps)

    def _in_row(self, first: FloatArray, second: FloatArray, gaps: FloatArray) -> FloatArray:
        pairs = first[:, None] if self.is_exact else np.column_stack([first, second])
        laid: FloatArray = np.insert(pairs.ravel(), self.joins * pairs.shape[1], gaps)
        return laid


def clock(log: Log) -> FloatArray:
    """Return the time that figures show: recorded time, segments end to end."""
    steps = np.diff(log.time, prepend=log.time[0])
    steps[[segment.start for segment in log.segments]] = 0.0
    return np.cumsum(steps)


def trace(log: Log, *channels: FloatArray) -> tuple[FloatArray, ...]:
    """Return the time and the channels that draw as all samples would, broken at joins."""
    bins = Bins.over(log.bounds, POINTS)
    return bins.times(clock(log)), *map(bins.values, channels)


def mark_segments(panels: Sequence[Axes], log: Log) -> None:
    """Mark joins in every panel, name segments above the first, time below the last."""
    time, segments = clock(log), log.segments
    end = max(float(time[-1]), 1e-9)
    panels[-1].set_xlim(0.0, end)
    several = f"recorded time, {len(segments)} segments end to end [s]"
    panels[-1].set_xlabel(several if len(segments) > 1 else "time [s]")
    for segment in segments[1:]:
        for panel in panels:
            panel.axvline(float(time[segment.start]), color=FAINT, linewidth=0.6, linestyle=":")
    for segment in segments if 1 < len(segments) <= _NAMED else ():
        start, stop = float(time[segment.start]), float(time[segment.stop - 1])
        room = int(_LETTERS * (stop - start) / end)
        words = escape_text(segment.name, room) if room > 2 else ""
        name = panels[0].text(0.5 * (start + stop), 1.02, words, ha="center", color=FAINT)
        name.set(transform=panels[0].get_xaxis_transform(), fontsize=6.5)

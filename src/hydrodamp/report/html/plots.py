"""What the time series of a report are drawn from: measured and replayed velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hydrodamp.arrays import FloatArray
from hydrodamp.basis.axes import VELOCITIES
from hydrodamp.data.log import Log
from hydrodamp.report.gallery.findings import chosen_row
from hydrodamp.report.html.levels import Level, level
from hydrodamp.report.html.packing import BYTES, pack, pack_exactly
from hydrodamp.report.html.plot_lines import BandLine, Line, band_line, lines_of
from hydrodamp.report.html.score_table import ranked
from hydrodamp.report.html.stage import staged_time, worst_window
from hydrodamp.validation.bands import PredictionBand
from hydrodamp.validation.comparison import Comparison, Row

MOST = 32
"""Replays drawn; those with the lowest errors where there are more."""

OVERVIEW = 1600
"""Points of a series when the whole log is in view."""

DETAIL_BYTES = 1_250_000
"""What all series may take at the second zoom."""

WORST_BYTES = 800_000
"""What all series may take at full rate."""

STRETCHES = 12
"""Rows of the table that stands for the plots."""


@dataclass(frozen=True)
class Plots:
    """The time series and the words around them."""

    document: dict[str, object]
    rows: tuple[Row, ...]
    lines: tuple[Line, ...]
    band: BandLine | None
    worst: str
    left_out: int
    names: tuple[str, ...]
    stretches: tuple[tuple[str, ...], ...]


def plots(comparison: Comparison, band: PredictionBand | None = None) -> Plots | None:
    """Return the time series of a comparison."""
    replayed = [row for row in ranked(comparison.rows) if row.trajectory is not None]
    logs = [row.trajectory.log for row in replayed if row.trajectory is not None]
    if not logs:
        return None
    return _Drawing(comparison, replayed, logs[0], band).plots()


class _Drawing:
    """The parts that the document shares."""

    def __init__(
        self, comparison: Comparison, replayed: Sequence[Row], log: Log, band: PredictionBand | None
    ) -> None:
        rate_unit = comparison.rate_unit
        self.rows = tuple(replayed[:MOST])
        self.left_out = len(replayed) - len(self.rows)
        self.unit = f"{rate_unit}/s"
        self.log = log
        self.lines = lines_of(comparison, self.rows)
        self.chosen, self.band = chosen_row(comparison), band
        names = [name for row in self.rows for name in row.score.rms_by_axis]
        self.names = tuple(name for name in VELOCITIES if name in names)
        self.columns = [VELOCITIES.index(name) for name in self.names]
        turn = np.degrees(1.0) if rate_unit == "deg" else 1.0
        self.scale = np.array([1.0] * 3 + [turn] * 3)[self.columns]
        self.time = staged_time(self.log)
        self.bounds = [(part.start, part.stop) for part in self.log.segments]
        self.n_series = len(self.names) * (1 + len(self.rows) + 2 * (self.band is not None))

    def plots(self) -> Plots:
        window = self._worst()
        return Plots(
            document=self._document(window),
            rows=self.rows,
            lines=self.lines,
            band=self._band_line(),
            worst=self._where(window.start, window.stop - 1) + self._on_axis(window),
            left_out=self.left_out,
            names=self.names,
            stretches=tuple(self._stretches()),
        )

    def series(self, row: Row | None) -> FloatArray:
        """Return the velocities of a row's replay, or of the log, in units to read."""
        found = self.log.velocity
        if row is not None and row.trajectory is not None:
            found = row.trajectory.velocity
        return self.shown(found)

    def shown(self, velocity: FloatArray) -> FloatArray:
        """Return the velocities that are drawn, in units to read."""
        found: FloatArray = velocity[:, self.columns] * self.scale
        return found

    def _worst(self) -> slice:
        errors = self.series(self.rows[0]) - self.series(None)
        most = max(int(WORST_BYTES / BYTES / self.n_series), 2)
        return worst_window(self.time, np.array(self.bounds), errors, most)

    def _document(self, window: slice) -> dict[str, object]:
        said = self._band_line()
        detail = int(DETAIL_BYTES / BYTES / self.n_series)
        levels = [level(self.bounds, OVERVIEW), level(self.bounds, max(detail, OVERVIEW))]
        if levels[0].exact:
            del levels[0]
        if not levels[-1].exact:
            levels.append(level([(window.start, window.stop)], window.stop - window.start))
        return {
            "velocities": [
                {"name": name, "unit": "m/s" if name in "uvw" else self.unit} for name in self.names
            ],
            "segments": [
                {
                    "name": part.name,
                    "start": self.time[part.start],
                    "stop": self.time[part.stop - 1],
                }
                for part in self.log.segments
            ],
            "replays": [
                {"name": line.name, "colour": line.colour, "dashes": line.dashes}
                for line in self.lines
            ],
            "band": None if said is None else {"name": said.name, "colour": said.colour},
            "worst": [self.time[window.start], self.time[window.stop - 1]],
            "levels": [self._level(each) for each in levels],
        }

    def _level(self, each: Level) -> dict[str, object]:
        times = each.times(self.time)
        return {
            "time": pack_exactly(times),
            "series": [
                [pack(each.values(values)) for values in self.series(row).T]
                for row in (None, *self.rows)
            ],
            "band": self._band(each),
        }

    def _band(self, each: Level) -> list[tuple[dict[str, object], dict[str, object]]]:
        """Return lower and upper edge of the band in each velocity, if there is one."""
        if self.band is None:
            return []
        edges = self.shown(self.band.lower).T, self.shown(self.band.upper).T
        return [
            (pack(each.lowest(lower)), pack(each.highest(upper)))
            for lower, upper in zip(*edges, strict=True)
        ]

    def _band_line(self) -> BandLine | None:
        if self.band is None or self.chosen is None:
            return None
        half = 0.5 * self.shown(self.band.upper - self.band.lower)
        return band_line(self.chosen, self.band, half, self.names, self.unit)

    def _stretches(self) -> list[tuple[str, ...]]:
        """Return the RMS errors of the first replay in a few stretches of the log."""
        errors = self.series(self.rows[0]) - self.series(None)
        coarse = level(self.bounds, 2 * max(STRETCHES, len(self.bounds)))
        found = []
        for start, stop in zip(coarse.starts.tolist(), coarse.stops.tolist(), strict=True):
            rms = np.sqrt(np.mean(errors[start:stop] ** 2, axis=0))
            words = (f"{value:.3g}" if np.isfinite(value) else "diverged" for value in rms)
            found.append((self._where(start, stop - 1), *words))
        return found

    def _on_axis(self, window: slice) -> str:
        """Say where that is in the plots, whose segments follow one another."""
        if len(self.log.segments) == 1:
            return ""
        shown = self.time[[window.start, window.stop - 1]]
        return f" ({shown[0]:.0f} to {shown[1]:.0f} s in the plots)"

    def _where(self, first: int, last: int) -> str:
        part = next(part for part in self.log.segments if part.start <= first < part.stop)
        since = self.log.time[[first, last]] - self.log.time[part.start]
        return f"{part.name}, {since[0]:.1f} to {since[1]:.1f} s"
